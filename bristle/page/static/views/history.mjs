// View 5, Add and watch the error fall: the staircase, and any two steps side by side.

import { packed } from "../api.mjs";
import { bars, commandLine, empty, h, number, percent, table, z } from "../dom.mjs";

export async function show(page) {
  const found = await packed(page.path("history"));
  page.same(`bristle study auto ${page.study}`, `bristle report ${page.study}`);
  return [
    h("h1", {}, headline(found)),
    orders(page, found),
    staircase(found),
    compare(page, found),
    found.commands.length
      ? h("details", {}, h("summary", {}, "The commands that repeat this study"), found.commands.map((text) => commandLine(text)))
      : null,
  ];
}

function headline(found) {
  const known = found.steps.filter((step) => step.z !== null);
  if (!known.length) return "No error yet: identify the model first";
  const [first, last] = [known[0], known.at(-1)];
  if (known.length === 1) return `Error / noise (z) on held-out runs: ${z(first.z)}`;
  return `Error / noise (z) ${last.z < first.z ? "fell" : "went"} from ${z(first.z)} to ${z(last.z)}`;
}

function orders(page, found) {
  const buttons = [];
  if (found.kind === "effect") {
    buttons.push(h("button", { type: "button", class: "main", onclick: () => page.run("add", { effects: found.named }) },
      `Add ${found.named.join(" and ")}`));
  } else {
    for (const name of found.named) {
      buttons.push(h("button", { type: "button", onclick: () => page.run("add", { effects: [name] }) }, `Add ${name}`));
    }
  }
  const other = h("select", { id: "other" }, h("option", { value: "" }, "choose …"),
    found.can_add.map((one) => h("option", { value: one.name, title: one.about }, one.name)));
  const add = h("button", { type: "button", onclick: () => other.value && page.run("add", { effects: [other.value] }) }, "Add it");
  const undo = h("button", { type: "button", onclick: () => page.run("undo") }, "Undo the last step");
  const auto = h("button", { type: "button", onclick: () => page.run("auto") }, "Go on until nothing is missing");
  page.onJobs(() => {
    const busy = Boolean(page.working());
    for (const one of [...buttons, auto]) one.disabled = busy;
    add.disabled = busy || !found.can_add.length;
    undo.disabled = busy || found.steps.length < 2;
  });
  const added = found.steps.some((step) => step.what.startsWith("add "));
  return h("div", { class: "act" }, buttons,
    h("label", { class: "field", for: "other" }, "Another effect", other), add, undo, auto,
    added ? h("a", { href: page.link("verdict") }, "The residual before and after") : null);
}

/** The error of each model on held-out runs: over the noise, on a logarithmic scale from the noise
 *  floor; in per cent of the force where the noise is not known. */
function staircase(found) {
  const noise = found.steps.some((step) => step.z !== null);
  const of = (step) => (noise ? step.z : step.share);
  const known = found.steps.filter((step) => of(step) !== null);
  if (!known.length) return empty("The history holds the first model alone", "Identify fits it and gives its first error.", null);
  const height = (value) => (noise ? Math.log10(Math.max(value, 1) * 1.03) : value);
  const text = (step) => [noise ? z(step.z) : percent(step.share), step.rms === null ? "" : `${number(step.rms, 4)} N`];
  return h("section", {},
    h("h2", {}, "How the error fell"),
    bars(`${noise ? "error / noise (z)" : "error"} of each step on held-out runs`, known.map((step) => ({
      name: `${step.number} ${step.what}`, value: height(of(step)), strong: true,
      good: noise && step.z <= found.close, text: text(step).filter(Boolean).join(" · "),
    })), { most: height(Math.max(...known.map(of), noise ? 2 : 0)), edge: noise ? height(1) : null }),
    h("p", { class: "soft small" }, noise
      ? "Error / noise (z) on held-out runs, logarithmic, and the RMS error. Green line: the noise floor, z = 1. Green bar: a model that reaches it."
      : "Error on held-out runs in per cent of the force, and the RMS error. How much of it is noise is not known."));
}

function compare(page, found) {
  const steps = found.steps;
  if (steps.length < 2) return null;
  const chosen = page.compared?.study === page.study && page.compared.b < steps.length
    ? page.compared : { study: page.study, a: steps.length - 2, b: steps.length - 1 };
  const target = h("div", {});
  const menu = (side, text) => {
    const select = h("select", { id: `step-${side}` }, steps.map((step, k) =>
      h("option", { value: k, selected: k === chosen[side] }, `${step.number} ${step.what}`)));
    select.addEventListener("change", () => {
      chosen[side] = Number(select.value);
      page.compared = chosen;
      draw();
    });
    return [h("label", { class: "field", for: `step-${side}` }, text, select), select];
  };
  const [[labelA, selectA], [labelB, selectB]] = [menu("a", "Step"), menu("b", "compared with")];
  const move = (way) => {
    const [a, b] = [chosen.a + way, chosen.b + way];
    if (a < 0 || b < 0 || a >= steps.length || b >= steps.length) return;
    Object.assign(chosen, { a, b });
    selectA.value = a;
    selectB.value = b;
    page.compared = chosen;
    draw();
  };
  const back = h("button", { type: "button", onclick: () => move(-1) }, "Earlier");
  const on = h("button", { type: "button", onclick: () => move(1) }, "Later");

  function draw() {
    const [a, b] = [steps[chosen.a], steps[chosen.b]];
    const names = [...new Set([...a.parameters, ...b.parameters].map((row) => row.name))];
    const of = (step, name) => step.parameters.find((row) => row.name === name);
    const cell = (row) => (row ? `${row.shown[0]}${row.half === null ? "" : ` ${row.shown[1]}`}` : "");
    back.disabled = Math.min(chosen.a, chosen.b) === 0;
    on.disabled = Math.max(chosen.a, chosen.b) === steps.length - 1;
    target.replaceChildren(
      table("Errors", ["error", a.what, b.what], [
        ["z, held-out runs", z(a.z), z(b.z)],
        ["z, training runs", z(a.train), z(b.train)],
        ["error, held-out runs [N]", ...[a, b].map((step) => `${number(step.rms, 4)}`)],
        ["error over the RMS of the force", ...[a, b].map((step) => (step.share === null ? "–" : `${percent(step.share)}`))],
      ], [1, 2]),
      table("Parameters", ["parameter", a.what, b.what, "unit"], names.map((name) => [
        h("code", {}, name), cell(of(a, name)), cell(of(b, name)), (of(a, name) ?? of(b, name)).unit.replace(/^1$/, ""),
      ]), [1, 2]));
  }
  draw();
  return h("section", {},
    h("h2", {}, "Two steps side by side"),
    h("ol", { class: "timeline", tabindex: "0", "aria-label": "the steps of the history" }, steps.map((step, k) => h("li", { class: k === steps.length - 1 ? "present" : null },
      h("b", {}, step.what), h("span", { class: "soft small" }, step.z !== null ? `z = ${z(step.z)}` : step.share !== null ? percent(step.share) : "not fitted"),
      h("span", { class: "soft small why" }, step.why)))),
    h("div", { class: "act" }, labelA, labelB, back, on),
    target);
}
