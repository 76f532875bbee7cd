// View 3, Where it fails: time, loops and the map of the error, linked by what is chosen in any.

import { packed } from "../api.mjs";
import { bars, h, key, number, percent, z } from "../dom.mjs";
import { Linked } from "../linked.mjs";
import { Plot, extent } from "../plot.mjs";

export async function show(page) {
  const role = page.role ?? "holdout";
  const found = await packed(page.path(`errors?role=${role}`));
  page.same(`bristle compare ${page.study}${role === "train" ? " --role train" : ""}`);
  const linked = new Linked(found);
  const select = h("select", { id: "role" },
    h("option", { value: "holdout", selected: role === "holdout" }, "held-out runs"),
    h("option", { value: "train", selected: role === "train" }, "training runs"));
  select.addEventListener("change", () => {
    page.role = select.value;
    page.again();
  });
  window.bristleLinked = linked;
  return [
    h("h1", {}, found.right ? "Noise explains the error" : `The error is ${z(found.z)} times the noise floor`),
    found.sentences.slice(0, 3).map((text, k) => h("p", { class: k ? null : "lead" }, text)),
    h("div", { class: "act" }, h("label", { class: "field", for: "role" }, "Runs", select),
      h("a", { href: page.link("verdict") }, "Next: what is missing")),
    h("h2", {}, "Where the error is"),
    found.sites.length ? sites(found) : null,
    linked.nodes(),
    h("div", { class: "grid" }, perRun(found), dependence(found), spectrum(found)),
    found.every > 1 ? h("p", { class: "soft small" }, `Every ${found.every}th sample is shown.`) : null,
  ];
}

function perRun(found) {
  const worst = Math.max(...found.runs.map((run) => run.z));
  return h("figure", {}, h("h3", {}, "Error / noise (z) on each run"),
    bars("z on each run", found.runs.map((run) => ({ name: run.name, value: run.z, strong: run.z === worst && !found.right, good: run.z <= 1.1, text: z(run.z) })), { edge: 1 }),
    h("figcaption", {}, "Green line: the noise floor, z = 1. A correct model reaches it."));
}

function dependence(found) {
  const rows = found.patterns.filter((one) => one.share > 0.002);
  if (!rows.length) return null;
  const first = rows[0];
  return h("figure", {}, h("h3", {}, "On what the error depends"),
    bars("share of the error's power by coordinate", rows.map((one) => ({
      name: one.name, value: one.share, strong: one.significant, text: percent(one.share), title: `chance ${number(one.p, 2)}`,
    })), { most: 1 }),
    new Plot("", `mean error along ${first.name}`, (p) => {
      const spread = [...first.mean.map((m, k) => m + 2 * first.std[k]), ...first.mean.map((m, k) => m - 2 * first.std[k]), 0];
      p.axes(extent([first.centre]), extent([spread]), `${first.name}${first.unit ? ` [${first.unit}]` : ""}`, `error [${found.unit}]`);
      p.between(first.centre, (k) => first.mean[k] - 1.96 * first.std[k], (k) => first.mean[k] + 1.96 * first.std[k], "floor");
      p.line(first.centre, first.mean, "red", { width: 1.6 });
      p.dots(first.centre, first.mean, "red", { size: 4 });
    }).canvas,
    h("figcaption", {}, first.significant ? "Blue: beyond chance. Below: the mean error along the first, with its 95 % interval." : "None beyond chance."));
}

function spectrum(found) {
  const { frequency, residual, noise } = found.spectrum;
  const log = (values) => values.map((value) => Math.log10(Math.max(value, 1e-30)));
  const [r, n] = [log(residual), log(noise)];
  return h("figure", {}, h("h3", {}, "Spectrum of the error and of the noise"),
    new Plot("", "power of error and noise over frequency", (p) => {
      const last = frequency.length;
      p.axes([0, frequency[last - 1]], extent([r.subarray(1), n.subarray(1)]), "frequency [Hz]", `log10 of ${found.unit}²/Hz`);
      p.line(frequency, n, "green", { from: 1 });
      p.line(frequency, r, "red", { from: 1 });
    }).canvas, key(["red", "error"], ["green", "expected noise"]));
}

function sites(found) {
  return h("figure", {}, h("h3", {}, `Sites of the building; below: ${found.site}`),
    bars("z at each site", found.sites.map((one) => ({ name: one.name, value: one.z, strong: one.fails, good: !one.fails, text: z(one.z) })), { edge: 1 }));
}
