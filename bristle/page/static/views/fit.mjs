// View 2, Fit: identify, parameters with intervals, loops measured and predicted, laws side by side.

import { packed } from "../api.mjs";
import { consentPanel } from "../consent.mjs";
import { bars, empty, h, key, number, shown, table, z } from "../dom.mjs";
import { Plot, extent } from "../plot.mjs";

export async function show(page) {
  const fit = await packed(page.path("fit"));
  page.same(`bristle identify ${page.study}`, `bristle compare ${page.study} --role train`);
  const name = [fit.law, ...fit.effects].join(" + ");
  const loops = h("section", {});
  if (fit.identified && !fit.waiting.length) {
    loops.append(h("p", { class: "loading" }, "Comparing the model with its training runs …"));
    packed(page.path("errors?role=train")).then(
      (found) => loops.replaceChildren(...smallLoops(found)),
      (error) => loops.replaceChildren(page.failure(error)),
    );
  }
  const before = fit.identified ? loops : empty("No fit yet",
    "Identify finds the parameters of the law on the training runs, with intervals, and says what the data do not identify.");
  return [
    h("h1", {}, fit.identified ? `The model: ${name}` : `Not identified yet: ${name}`),
    fit.waiting.length ? consentPanel(page, { error: "" }) : null,
    fit.other_data ? h("ul", { class: "findings" }, h("li", {}, h("span", { class: "level-warning" }, "Warning: "), fit.other_data)) : null,
    orders(page, fit),
    before,
    parameters(fit),
    h("div", {}, laws(fit)),
    h("h2", {}, "Equations of the model"),
    fit.about.map((one) => h("div", {}, h("h3", {}, `${one.kind === "law" ? "Law" : "Effect"}: ${one.name}`),
      h("pre", { tabindex: "0" }, one.text), h("p", { class: "soft small" }, one.source))),
  ];
}

function orders(page, fit) {
  const law = h("select", { id: "law" }, h("option", { value: "" }, `${fit.law} (the model's)`),
    h("option", { value: "all" }, "compare all laws"),
    fit.laws.filter((one) => one !== fit.law).map((one) => h("option", { value: one }, one)));
  const button = h("button", { type: "button", class: fit.identified ? null : "main",
    onclick: () => page.run("identify", { law: law.value }) }, fit.identified ? "Identify again" : "Identify");
  const auto = h("button", { type: "button", onclick: () => page.run("auto") }, "Do all steps");
  page.onJobs(() => {
    button.disabled = auto.disabled = Boolean(page.working());
  });
  return h("div", {},
    h("div", { class: "act" }, h("label", { class: "field", for: "law" }, "Law", law), button, auto,
      fit.identified ? h("a", { href: page.link("errors") }, "Next: where it fails") : null),
    h("p", { class: "soft small" }, "“Do all steps” repeats identify, diagnose and add until no further effect is found."));
}

/** Loops of each run, measured and predicted, side by side. */
function smallLoops(found) {
  const fx = shown("m");
  const fv = shown("m/s");
  const over = found.runs.every((run) => run.velocity) ? "velocity" : "displacement";
  const [factor, unit] = over === "velocity" ? fv : fx;
  const runs = found.runs.filter((run) => run[over]);
  const xs = extent(runs.map((run) => run[over]), 0.03, factor);
  const ys = extent(runs.map((run) => run.measured), 0.03);
  return [
    h("h2", {}, `Loops: force over ${over} on the training runs`),
    h("div", { class: "grid" }, runs.map((run) => h("figure", {},
      h("h3", {}, run.name, " ", h("span", { class: "tag" }, `z = ${z(run.z)}`)),
      new Plot("", `force of ${run.name} over ${over}, measured and predicted; z = ${z(run.z)}`, (p) => {
        p.axes(xs, ys, `${over} [${unit}]`, `${found.quantity} [${found.unit}]`);
        p.dots(run[over], run.measured, "mark", { fx: factor, size: 1.8 });
        p.line(run[over], run.predicted, "blue", { fx: factor, width: 0.8 });
      }).canvas))),
    key(["mark", "measured"], ["blue", "model"]),
  ];
}

function parameters(fit) {
  const rows = fit.parameters.filter((row) => !(row.how === "held" && /(exponent|mass|which)$/.test(row.name)));
  return table("Parameters", ["parameter", "value", "95 % interval", "unit", "what it is"],
    rows.map((row) => [
      h("code", {}, row.name), row.shown[0],
      row.half !== null
        ? `${row.shown[1]}${row.value ? ` (${number(Math.abs(100 * row.half / row.value), 2)} %)` : ""}`
        : row.how,
      row.unit === "1" ? "" : row.unit, row.about,
    ]), [1, 2]);
}

function laws(fit) {
  const answer = fit.answer;
  if (!answer) return null;
  const parts = [];
  if (answer.unidentified.length) {
    parts.push(h("p", {}, "The data do not identify: ", answer.unidentified.join(", "), "."));
  }
  const judged = (answer.laws ?? []).filter((row) => row.error_holdout).map((row) => ({ ...row, error: row.error_holdout.rms }));
  if (judged.length) {
    const best = Math.min(...judged.map((row) => row.error));
    parts.push(h("h2", {}, "The laws side by side"),
      bars("RMS error of each law", judged.map((row) => ({
        name: row.law, value: row.error, strong: row.law === fit.law, good: false,
        text: `${number(row.error, 4)} N${row.error === best ? " (least)" : ""}`,
      }))),
      h("p", { class: "soft small" }, "RMS error of the force on held-out runs, each law fitted with those effects of the model that can join it. Blue: the model's."));
  }
  for (const note of answer.notes) parts.push(h("p", { class: "soft" }, note));
  return parts;
}
