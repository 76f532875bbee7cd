// View 7, Simulate: which building, damper, control and ground motion; then sliders.

import { packed, postPacked } from "../api.mjs";
import { h, say } from "../dom.mjs";
import { acceptDrops, named as recordNamed, picker, take } from "../records.mjs";
import { Simulation } from "../simulation.mjs";

const FIRST = "el_centro_lugre_passive";
export const WORDS = {
  ConstantVoltage: "constant voltage", ClippedOptimal: "clipped-optimal", HinfInverse: "H-infinity with inverse",
  Lpv: "LPV, scheduled by velocity", LqgClipped: "clipped LQG", Skyhook: "skyhook", TrainedPolicy: "trained policy",
};

export async function show(page) {
  const { scenarios, studies, records } = await packed("scenarios");
  page.setting ??= {};
  const what = { scenario: FIRST, control: "", record: "", ...page.setting, study: page.damper ?? "" };
  if (!records.includes(what.record)) what.record = "";
  const controls = h("select", { id: "control" }, h("option", { value: what.control }, WORDS[what.control] ?? "as in the scenario"));
  const change = (key) => (value) => {
    page.setting[key] = value;
    if (key === "scenario") page.setting.control = "";
    page.again();
  };
  const takeFiles = (files) => take(node, files, (name) => {
    say(`Running with ${recordNamed(name)}.`);
    change("record")(name);
  });
  const whole = h("div", {}, h("p", { class: "loading", role: "status" },
    "Running the scenario; the first time all laws are compiled, which takes a minute …"));
  const node = h("div", { class: "dropped" },
    h("div", { class: "act" },
      field("scenario", "Scenario", scenarios.map((one) => [one, one]), what.scenario, change("scenario")),
      field("damper", "Damper", [["", "as in the scenario"], ...studies.map((one) => [one, `that of ${one}`])], what.study, (value) => {
        page.damper = value;
        page.again();
      }),
      h("label", { class: "field", for: "control" }, "Control", controls),
      field("record", "Ground motion", [["", "as in the scenario"], ...records.map((one) => [one, recordNamed(one)])], what.record, change("record")),
      picker(takeFiles)),
    whole);
  acceptDrops(node, takeFiles);
  controls.addEventListener("change", () => change("control")(controls.value));
  postPacked("simulate", { ...what, values: {}, about: true }).then(
    (first) => {
      const options = [["", "as in the scenario"], ...first.controls.map((one) => [one, WORDS[one] ?? one])];
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
