// The residual before and after an effect: over time, and its map, on the same scales.

import { Cells, MAP_KEY } from "./cells.mjs";
import { h, key, z } from "./dom.mjs";
import { Plot } from "./plot.mjs";

const SIDES = ["before", "after"];

/** Returns the pictures of what `residual` answers; nothing where no effect was found or added. */
export function beforeAfter(found) {
  if (!found.effects.length) return [];
  const name = found.effects.join(" and ");
  const titles = { before: `Without ${name}`, after: `With ${name}` };
  const also = { ambiguous: " Others explain the runs as well.", unknown: " It leaves the least, but does not explain the error." };
  const from = found.step === null
    ? `The present model, and the one that the diagnosis refitted with ${name}.${also[found.kind] ?? ""} It is not added yet.`
    : `The models before and after step ${found.step}, which added ${name}.`;
  const at = found.site ? ` Site: ${found.site}.` : "";
  return [
    h("h2", {}, `The residual before and after ${name}`),
    h("p", {}, `${from} Error / noise (z) on held-out runs: `, h("strong", {}, z(found.before)), " and ", h("strong", {}, z(found.after)), `.${at}`),
    overTime(found, titles),
    maps(found, titles),
    found.every > 1 ? h("p", { class: "soft small" }, `Every ${found.every}th sample is shown.`) : null,
  ];
}

function overTime(found, titles) {
  let run = found.runs.reduce((worst, one) => (one.before.z > worst.before.z ? one : worst));
  const plots = SIDES.map((side) => new Plot("middle", `residual over time, ${titles[side]}`, (p) => {
    const { residual, sigma } = run[side];
    const size = scaleOf(run);
    p.axes([run.time[0], run.time.at(-1)], [-size, size], side === "after" ? "time [s]" : null, `error [${found.unit}]`);
    p.between(run.time, (k) => -2 * sigma[k], (k) => 2 * sigma[k], "floor");
    p.trace(run.time, residual, "red", { width: 0.9 });
  }));
  const tags = SIDES.map(() => h("span", { class: "tag" }));
  const beyond = h("figcaption", {});
  const tell = () => {
    SIDES.forEach((side, k) => (tags[k].textContent = `z = ${z(run[side].z)}`));
    const size = scaleOf(run);
    const [a, b] = SIDES.map((side) => run[side].residual.reduce((sum, one) => sum + (Math.abs(one) > size), 0));
    beyond.textContent = a || b ? `Beyond the scale: ${a} samples without and ${b} with it, of ${run.time.length}.` : "";
  };
  tell();
  const select = h("select", { id: "residual-run" }, found.runs.map((one, k) =>
    h("option", { value: k, selected: one === run }, one.name)));
  select.addEventListener("change", () => {
    run = found.runs[Number(select.value)];
    tell();
    for (const plot of plots) plot.later();
  });
  return h("section", { "aria-label": "Residual over time" },
    h("div", { class: "act" }, h("label", { class: "field", for: "residual-run" }, "Run over time", select)),
    SIDES.map((side, k) => h("figure", {}, h("h3", {}, `${titles[side]} `, tags[k]), plots[k].canvas)),
    key(["red", `${found.quantity}, measured less predicted`], ["floor", "twice the expected noise", true]),
    beyond);
}

/** Returns the scale of both pictures; single samples where the velocity turns would flatten all others. */
function scaleOf(run) {
  const sizes = SIDES.flatMap((side) => Array.from(run[side].residual, Math.abs)).sort((a, b) => a - b);
  const wanted = Math.min(sizes.at(-1), 1.4 * sizes[Math.floor(0.99 * sizes.length)]) || 1;
  const power = 10 ** Math.floor(Math.log10(wanted));
  return power * [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((one) => one * power >= wanted);
}

/** The maps over all runs, in colours of one scale: that of the model without the effect. */
function maps(found, titles) {
  if (!found.runs.every((run) => run.displacement && run.velocity)) return null;
  const joined = (take) => Float32Array.from(found.runs.flatMap((run) => Array.from(take(run))));
  const cells = new Cells(joined((run) => run.displacement), joined((run) => run.velocity));
  const [before, after] = SIDES.map((side) => joined((run) => run[side].normalised));
  const limit = cells.limit(before);
  return h("div", { class: "grid", style: { "margin-top": "1.4rem" } }, [before, after].map((r, k) => {
    const picture = new Plot("high", `mean error over noise by displacement and velocity, ${titles[SIDES[k]]}`, (p) => cells.draw(p, r, limit));
    return h("figure", {}, h("h3", {}, `${titles[SIDES[k]]}: mean error / noise, all runs`), picture.canvas, k ? null : key(...MAP_KEY));
  }));
}
