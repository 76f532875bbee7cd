// The first screen: studies, examples, and files that are dropped.

import { get } from "../api.mjs";
import { h } from "../dom.mjs";
import { uploader } from "../upload.mjs";

const WORDS = {
  none: "nothing found missing",
  effect: "missing physics found",
  class: "one of a few is missing",
  ambiguous: "one of a few is missing",
  unknown: "something unknown is missing",
  insufficient: "the data do not allow a verdict",
};

export async function show(page) {
  page.home = await get("home");
  const { studies, folder } = page.home;
  page.same("bristle page");
  page.ended = (job) => {
    if (job.what === "example" && job.state === "done" && page.view === "home") {
      location.hash = page.link("data", job.study);
    }
  };
  return [
    h("h1", {}, "Find the physics that a damper model misses"),
    h("p", { class: "lead" }, "Begin with an example, or with your own measurements. Everything stays on this machine, in the folder ",
      h("code", {}, folder), "."),
    h("h2", {}, "Try it"),
    h("ul", { class: "cards" },
      example(page, "bench", "Example bench", "A damper on a test bench, five runs. An effect that is missing from the model is hidden in it."),
      example(page, "building", "Example building", "A base-isolated building on a shake table with a damper, and something hidden in it."),
      h("li", { class: "card" }, h("h3", {}, "Simulate a building"),
        h("p", {}, "Move the voltage or the ground motion and see the building answer."),
        h("a", { href: "#/-/simulate" }, "Open the simulation"))),
    h("h2", {}, "Your measurements"),
    uploader(page),
    h("h2", {}, "Studies in this folder"),
    studies.length
      ? h("div", { class: "cards" }, studies.map((study) => card(page, study)))
      : h("p", { class: "soft" }, "None yet."),
  ];
}

function card(page, study) {
  const about = study.error
    ? study.error
    : `${study.rig === "structure" ? "building" : "test bench"}, ${study.runs} run${study.runs === 1 ? "" : "s"}, ${study.held_out} held out`;
  return h("a", { class: "card", href: page.link("data", study.name) },
    h("h3", {}, study.name),
    h("p", { class: "soft small" }, study.title === study.name ? "" : `${study.title}: `, about),
    study.verdict ? h("span", { class: "tag" }, [WORDS[study.verdict] ?? study.verdict, ...study.effects].join(" · ")) : null);
}

function example(page, rig, title, text) {
  const taken = new Set(page.home.studies.map((study) => study.name));
  let name = `example_${rig}`;
  for (let k = 2; taken.has(name); k++) name = `example_${rig}_${k}`;
  const there = taken.has(`example_${rig}`);
  const button = h("button", { type: "button", class: "main" }, there ? `Make another ${rig}` : `Make the ${title.toLowerCase()}`);
  button.addEventListener("click", async () => {
    button.disabled = true;
    if (!(await page.run("example", { rig, seed: 1 + taken.size }, name))) button.disabled = false;
  });
  page.onJobs(() => {
    button.disabled = Boolean(page.working(name));
  });
  return h("li", { class: "card" }, h("h3", {}, title), h("p", {}, text), button);
}

