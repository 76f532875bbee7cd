// View 7, Simulate: which building, damper, control and ground motion; then sliders.

import { packed, postPacked, put } from "../api.mjs";
import { bytes, h, say, wrong } from "../dom.mjs";
import { Simulation } from "../simulation.mjs";

const FIRST = "el_centro_lugre_passive";
const LARGEST = 64 * 1024 ** 2; // bytes of a ground motion, as its reader has it
const WORDS = {
  ConstantVoltage: "constant voltage", ClippedOptimal: "clipped-optimal", HinfInverse: "H-infinity with inverse",
  Lpv: "LPV, scheduled by velocity", LqgClipped: "clipped LQG", Skyhook: "skyhook",
};

export async function show(page) {
  const { scenarios, studies, records } = await packed("scenarios");
  page.setting ??= {};
  const what = { scenario: FIRST, control: "", record: "", ...page.setting, study: page.damper ?? "" };
  if (!records.includes(what.record)) what.record = "";
  const controls = h("select", { id: "control" }, h("option", { value: what.control }, WORDS[what.control] ?? "the scenario's"));
  const change = (key) => (value) => {
    page.setting[key] = value;
    if (key === "scenario") page.setting.control = "";
    page.again();
  };
  const dropped = (name) => (name.includes("/") ? `${name.split("/").pop()} (dropped)` : name);
  const whole = h("div", {}, h("p", { class: "loading", role: "status" },
    "Running the scenario; the first time all laws are compiled, which takes a minute …"));
  const node = h("div", { class: "dropped" },
    h("div", { class: "act" },
      field("scenario", "Scenario", scenarios.map((one) => [one, one]), what.scenario, change("scenario")),
      field("damper", "Damper", [["", "the scenario's"], ...studies.map((one) => [one, `that of ${one}`])], what.study, (value) => {
        page.damper = value;
        page.again();
      }),
      h("label", { class: "field", for: "control" }, "Control", controls),
      field("record", "Ground motion", [["", "the scenario's"], ...records.map((one) => [one, dropped(one)])], what.record, change("record")),
      picker(page, (files) => take(page, node, files))),
    whole);
  acceptDrops(node, (files) => take(page, node, files));
  controls.addEventListener("change", () => change("control")(controls.value));
  postPacked("simulate", { ...what, values: {}, about: true }).then(
    (first) => {
      const options = [["", "the scenario's"], ...first.controls.map((one) => [one, WORDS[one] ?? one])];
      controls.replaceChildren(...options.map(([value, text]) => h("option", { value, selected: value === what.control }, text)));
      controls.disabled = !first.controls.length;
      new Simulation(page, what, named(what), first, whole);
    },
    (error) => {
      whole.replaceChildren(page.failure(error), h("div", { class: "act" }, h("button", { type: "button", onclick: () => {
        page.setting = {};
        page.damper = "";
        page.again();
      } }, "Back to the first scenario")));
    },
  );
  return [h("h1", {}, "Simulate"), node];
}

function field(id, label, options, chosen, then) {
  const select = h("select", { id }, options.map(([value, text]) => h("option", { value, selected: value === chosen }, text)));
  select.addEventListener("change", () => then(select.value));
  return h("label", { class: "field", for: id }, label, select);
}

/** Returns how a setting is called before any slider has moved. */
function named(what) {
  const more = [what.control && (WORDS[what.control] ?? what.control), what.study && `damper of ${what.study}`, what.record && what.record.split("/").pop()];
  return [what.scenario, ...more.filter(Boolean)].join(", ");
}

function picker(page, then) {
  const input = h("input", { type: "file", class: "unseen", id: "record-file", accept: ".at2,.csv,.txt,.dat", "aria-label": "Ground motion file", tabindex: "-1" });
  input.addEventListener("change", () => input.files.length && then([...input.files]));
  return h("span", {}, h("button", { type: "button", onclick: () => input.click() }, "Another record"), " ",
    h("span", { class: "soft small" }, "AT2 or CSV; or drop it here"), input);
}

function acceptDrops(node, then) {
  node.addEventListener("dragover", (event) => {
    event.preventDefault();
    node.classList.add("over");
  });
  node.addEventListener("dragleave", (event) => {
    if (!node.contains(event.relatedTarget)) node.classList.remove("over");
  });
  node.addEventListener("drop", (event) => {
    event.preventDefault();
    node.classList.remove("over");
    if (event.dataTransfer.files.length) then([...event.dataTransfer.files]);
  });
}

/** Sends a ground motion to the folder of the studies, and runs with it; the readers check it. */
async function take(page, node, files) {
  node.querySelector(".state.wrong")?.remove();
  const [file] = files;
  const trouble = (text) => node.prepend(wrong("This ground motion cannot be used", text));
  if (files.length > 1) return trouble("Drop one file: a run has one ground motion.");
  if (file.size > LARGEST) return trouble(`${file.name}: ${bytes(file.size)}; a ground motion may have ${bytes(LARGEST)}. Cut it, or sample it more coarsely.`);
  try {
    const batch = `record-${new Date().toISOString().slice(0, 19).replace(/[T:]/g, "-")}`;
    await put(`uploads/${batch}/${encodeURIComponent(file.name)}`, file);
    page.setting.record = `uploads/${batch}/${file.name}`;
    say(`Running with ${file.name}.`);
    await page.again();
  } catch (error) {
    trouble(error.message);
  }
}
