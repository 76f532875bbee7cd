// Fits while they are at work: loops measured and modelled, errors, parameters, the laws side by side.

import { bars, h, key, number, percent, shown, z } from "./dom.mjs";
import { Plot, extent } from "./plot.mjs";

const SAID = 5000; // ms between two sentences for who listens to the page
const ENDED = ["cancelled", "failed"];
const FITS = ["identify", "auto"]; // which begin with a fit; others are shown once they tell of one

/** The last snapshot of each series of fits, by job. */
export class Fits {
  constructor() {
    this.last = 0; // number of the newest
    this.jobs = new Map();
  }

  /** Takes what the server has that is newer, and forgets what is done. @returns {object[]} the jobs */
  take(jobs) {
    for (const job of jobs) {
      if (job.state === "done") this.jobs.delete(job.number);
      else for (const one of job.fits) this.of(job).set(one.series, one);
      this.last = Math.max(this.last, ...job.fits.map((one) => one.number));
    }
    return jobs;
  }

  /** @returns {Map<string, object>} the snapshots of a job by their series */
  of(job) {
    if (!this.jobs.has(job.number)) this.jobs.set(job.number, new Map());
    return this.jobs.get(job.number);
  }
}

/** Returns the job whose fits are shown: the one at work, or the last fit that was broken off. */
export function fitting(page) {
  const job = page.working() ?? page.jobs.findLast((one) => one.study === page.study);
  if (!job || job.state === "done" || job.number === page.dismissed) return null;
  return FITS.includes(job.what) || (atWork(job) && page.fits.of(job).size) ? job : null;
}

/** Returns whether a job has not ended. */
export const atWork = (job) => Boolean(job) && !ENDED.includes(job.state);

/** Returns a section that shows the fits of the study while they are at work. */
export function fitsAtWork(page) {
  const heading = h("h2", {});
  const now = h("p", { class: "soft" });
  const said = h("p", { class: "unseen", role: "status", "aria-live": "polite" });
  const models = h("div", {});
  const laws = new Laws();
  const whole = h("section", { class: "fits", "aria-label": "The fit at work" }, heading, now, models, laws.whole, said);
  const drawn = new Map();
  let last = 0;
  page.onJobs(() => {
    const job = fitting(page);
    whole.hidden = !job;
    if (!job) return;
    const found = [...page.fits.of(job).values()];
    [heading.textContent, now.textContent] = told(job, found);
    whole.classList.toggle("ended", !atWork(job));
    for (const one of found.filter((fit) => fit.kind === "model")) {
      if (!drawn.has(one.series)) {
        drawn.set(one.series, new ModelFit(one));
        models.append(drawn.get(one.series).whole);
      }
      drawn.get(one.series).show(one);
    }
    laws.show(found.filter((fit) => fit.kind === "law"));
    if (found.length && atWork(job) && Date.now() - last > SAID) {
      last = Date.now();
      said.textContent = sentence(found.reduce((one, other) => (other.number > one.number ? other : one)));
    }
  });
  return whole;
}

/** Returns what stands above the fits of a job: a heading and a sentence. */
function told(job, found) {
  const far = found.length ? " Below is how far the fit came." : "";
  if (job.state === "cancelled") {
    const left = job.what === "identify" ? "The model of the study is as it was before." : "What was finished before is in the study.";
    return ["The fit was cancelled", `${left}${far}`];
  }
  if (job.state === "failed") return ["The fit failed", `${job.error.split("\n")[0]}${far}`];
  if (job.state === "cancelling") return ["The fit is being cancelled", "It ends after its present step."];
  return [found.length ? "The fit at work" : "The fit begins", `${job.now || "Starting"} …`];
}

const nameOf = (fit) => [fit.kind === "law" ? fit.name : fit.law, ...fit.effects].join(" + ");

/** Returns what is said of a fit: its law, search, step and error. */
const sentence = (fit) => `${nameOf(fit)}: search ${fit.search}, step ${fit.step}, RMS error ${percent(fit.share)} of the force${fit.z === null ? "" : `, z = ${z(fit.z)}`}`;

/** The fit of a model, or of what it has at one site of a building. */
class ModelFit {
  constructor(fit) {
    this.fit = fit;
    this.title = h("h3", {});
    this.numbers = h("p", { class: "count" });
    this.parameters = h("p", { class: "soft small count" });
    this.plots = [
      new Plot("", "", (p) => loops(p, this.fit, "velocity")),
      new Plot("", "", (p) => loops(p, this.fit, "displacement")),
      new Plot("", "error / noise (z) at each step of the searches", (p) => errors(p, this.fit)),
    ];
    const levels = fit.loops.map((one) => `${one.run} at ${number(one.level, 2)} ${one.unit}`).join("; ");
    this.whole = h("div", {}, this.title, this.numbers,
      h("div", { class: "grid" }, this.plots.map((plot) => h("figure", {}, plot.canvas))),
      key(["mark", "measured"], ["blue", "model, and the error of the present search"], ["pale", "searches before"]),
      h("p", { class: "soft small" }, `Cycles of the training runs: ${levels}.`), this.parameters);
  }

  show(fit) {
    if (fit === this.shown) return;
    this.fit = this.shown = fit;
    this.title.textContent = `${nameOf(fit)}${fit.name ? `, ${fit.name}` : ""}`;
    this.numbers.textContent = sentence(fit).slice(nameOf(fit).length + 2);
    this.parameters.textContent = fit.parameters.map(([name, value, unit]) => `${name} = ${number(value, 4)}${unit === "1" ? "" : ` ${unit}`}`).join(", ");
    for (const [plot, over] of [[this.plots[0], "velocity"], [this.plots[1], "displacement"]]) {
      plot.canvas.setAttribute("aria-label", `force over ${over}, measured and as the model has it now; RMS error ${percent(fit.share)}`);
    }
    for (const plot of this.plots) plot.later();
  }
}

/** The laws side by side: the least error of each so far, and its loop. */
class Laws {
  constructor() {
    this.bars = h("div", {});
    this.grid = h("div", { class: "grid small" });
    this.whole = h("div", { hidden: true }, h("h3", {}, "The laws side by side"), this.bars,
      h("p", { class: "soft small" }, "Least RMS error of the force so far, over its RMS, on the training runs. Blue: at work. The loops are those of the present step of each law."),
      this.grid);
    this.drawn = new Map();
  }

  show(fits) {
    this.whole.hidden = !fits.length;
    if (!fits.length || fits.every((fit) => this.drawn.get(fit.series)?.fit === fit)) return;
    const newest = Math.max(...fits.map((fit) => fit.number));
    for (const fit of fits) {
      if (!this.drawn.has(fit.series)) this.drawn.set(fit.series, this.add(fit.name));
      const own = this.drawn.get(fit.series);
      if (own.fit === fit) continue;
      const same = own.fit && (own.fit.z === null) === (fit.z === null); // else fitted anew, to another error
      own.fit = fit;
      own.least = Math.min(same ? own.least : Infinity, fit.share);
      own.tag.textContent = percent(fit.share);
      own.plot.canvas.setAttribute("aria-label", `force over velocity, measured and by the law ${fit.name}; RMS error ${percent(fit.share)}`);
      own.plot.later();
    }
    this.bars.replaceChildren(bars("least RMS error of each law so far", fits.map((fit) => {
      const { least } = this.drawn.get(fit.series);
      return { name: fit.name, value: least, strong: fit.number === newest, text: percent(least) };
    })));
  }

  add(name) {
    const own = { fit: null, least: Infinity, tag: h("span", { class: "tag" }) };
    own.plot = new Plot("middle", "", (p) => loops(p, own.fit, "velocity"));
    this.grid.append(h("figure", {}, h("h4", {}, name, " ", own.tag), own.plot.canvas));
    return own;
  }
}

/** Draws the cycles of a fit; the axes are those of what was measured, so that they stand still. */
function loops(p, fit, over) {
  const [factor, unit] = shown(over === "velocity" ? "m/s" : "m");
  const xs = extent(fit.loops.map((one) => one[over]), 0.04, factor);
  p.axes(xs, extent(fit.loops.map((one) => one.measured), 0.15), `${over} [${unit}]`, "force [N]");
  for (const one of fit.loops) p.dots(one[over], one.measured, "mark", { fx: factor, size: 2.6 });
  for (const one of fit.loops) {
    p.line(one[over], one.model, "blue", { fx: factor, width: 1.4, breaks: (k) => one.model[k] === null });
  }
}

/** Draws the errors of the searches over their steps; of those that fall far as powers of ten. */
function errors(p, fit) {
  const all = fit.errors.flat();
  const far = Math.max(...all) > 20 * Math.min(...all) && Math.min(...all) > 0;
  const y = (value) => (far ? Math.log10(value) : value);
  const steps = Math.max(4, ...fit.errors.map((one) => one.length - 1));
  p.axes([0, steps], far ? extent([all.map(y)], 0.06) : [0, 1.1 * Math.max(...all)], "step", "error / noise (z)", { logY: far });
  fit.errors.forEach((one, k) => {
    const name = k === fit.errors.length - 1 ? "blue" : "pale";
    const places = one.map((_, step) => step);
    p.line(places, one.map(y), name, { width: 1.8 });
    p.dots(places, one.map(y), name, { size: 5 });
  });
}
