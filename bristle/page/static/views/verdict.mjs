// View 4, What is missing: verdict, evidence, limits of each effect, the next tests.

import { packed } from "../api.mjs";
import { bars, blocks, empty, h, key, number, shown, wrong, z } from "../dom.mjs";
import { Plot, extent } from "../plot.mjs";
import { beforeAfter } from "../residual.mjs";

export async function show(page) {
  const found = await packed(page.path("verdict"));
  page.same(`bristle diagnose ${page.study}`, `bristle plan ${page.study}`);
  const verdict = found.verdict;
  return [
    h("h1", {}, "What is missing"),
    trials(page),
    verdict ? badge(verdict) : null,
    orders(page, verdict),
    residuals(page),
    verdict ? evidence(verdict) : empty("Not diagnosed",
      "Diagnose adds one effect after the other to the model, fits all parameters again, and compares the result with the held-out runs. It names the missing effect, a few that the data cannot distinguish, or none."),
    learned(found.learned),
    plans(page, found, verdict),
  ];
}

/** The residual without and with the effect that was found, or that was added last. */
function residuals(page) {
  const whole = h("section", { "aria-label": "Residual before and after" },
    h("p", { class: "loading" }, "Predicting the held-out runs without and with the effect …"));
  packed(page.path("residual")).then(
    (found) => whole.replaceChildren(...beforeAfter(found).filter(Boolean)),
    (error) => whole.replaceChildren(page.failure(error)),
  );
  return whole;
}

function badge(verdict) {
  return h("section", { class: `verdict ${verdict.kind}`, "aria-label": "Verdict" },
    h("div", { class: "kind" }, verdict.title), blocks(verdict.answer));
}

function orders(page, verdict) {
  const go = h("button", { type: "button", class: verdict ? null : "main", onclick: () => page.run("diagnose") },
    verdict ? "Diagnose again" : "Diagnose");
  const learn = verdict?.kind === "unknown"
    ? h("button", { type: "button", onclick: () => page.run("learn") }, "Learn it as a curve") : null;
  page.onJobs(() => {
    go.disabled = Boolean(page.working());
    if (learn) learn.disabled = go.disabled;
  });
  return h("div", { class: "act" }, go, learn,
    verdict ? h("a", { href: page.link("history") }, verdict.effects.length ? `Next: add ${verdict.effects.join(", ")}` : "Next: the history") : null);
}

/** While a diagnosis works: a bar for each effect that was tried, which falls as it explains more. */
function trials(page) {
  const whole = h("section", { "aria-live": "off" });
  page.onJobs(() => {
    const job = page.working();
    if (!job || !["diagnose", "auto"].includes(job.what)) {
      whole.replaceChildren();
      return;
    }
    const tried = tell(page.lines.get(job.number) ?? []);
    if (!tried.last) {
      whole.replaceChildren(h("p", { class: "loading" }, `${job.now || "Beginning"} …`));
      return;
    }
    const { last, rest, held } = tried;
    const names = [...rest.keys()].sort((one, other) => rest.get(one) - rest.get(other));
    whole.replaceChildren(
      h("h2", {}, last.kind === "law" ? "Laws are tried" : "Effects are tried"),
      bars("progress", [{ name: `${last.kind}, ${last.at} of ${last.of}`, value: Number(last.at), strong: true, text: last.name }], { most: Number(last.of) }),
      names.length ? h("h3", {}, "What remains of the cost on the training runs with each effect") : null,
      names.length ? bars("cost that remains with each effect", names.map((name, k) => ({
        name, value: rest.get(name), strong: k === 0, text: held.has(name) ? `${rest.get(name)} % · z = ${held.get(name)} held out` : `${rest.get(name)} %`,
      })), { most: 100, edge: 100 }) : null,
      names.length ? h("p", { class: "soft small" }, "Green line: the model as it is. Blue: the best so far. Held-out runs decide.") : null);
  });
  return whole;
}

/** Returns what the lines of a diagnosis tell of the present search: cost that remains, z held out. */
function tell(lines) {
  const [rest, held] = [new Map(), new Map()];
  let last = null;
  for (const line of lines) {
    const found = /^(effect|law|refining effect) (\d+) of (\d+), ([\w.]+)(?:; ([\d.e+-]+) % of the cost)?(?:; z ([\d.e+-]+))?/.exec(line);
    if (!found) continue;
    const [, kind, at, of, name, share, z] = found;
    if (kind === "effect" && at === "1") for (const map of [rest, held]) map.clear(); // another search begins
    if (share !== undefined) rest.set(name, Number(share));
    if (z !== undefined) held.set(name, z);
    last = { kind, at, of, name };
  }
  return { last, rest, held };
}

/** The curves that were learned: values with their 95 % interval, and the nearest closed form. */
function learned(found) {
  if (!found.length) return null;
  return h("section", {}, h("h2", {}, "What was learned"), found.map((one) => {
    if (one.rows) return surface(one);
    if (!one.knots) return h("div", {}, h("h3", {}, one.name), one.sentences.map((text) => h("p", {}, text)));
    const [[fx, ux], [fy, uy]] = [shown(one.along_unit), shown(one.unit)];
    const low = one.values.map((value, k) => value - one.half[k]);
    const high = one.values.map((value, k) => value + one.half[k]);
    const picture = new Plot("", `${one.name}: the learned curve over ${one.along}, with its 95 % interval and the nearest closed form`, (p) => {
      p.axes(extent([one.knots], 0.02, fx), extent([low, high], 0.06, fy), `${one.along}${ux ? ` [${ux}]` : ""}`, uy);
      p.between(one.knots, (k) => low[k], (k) => high[k], "floor", { fx, fy });
      p.line(one.knots, one.values, "blue", { fx, fy, width: 1.8 });
      p.dots(one.knots, one.values, "blue", { fx, fy, size: 4 });
      if (one.nearest.along) p.line(one.nearest.along, one.nearest.values, "red", { fx, fy, width: 1.4, dash: [6, 4] });
    });
    return h("figure", {}, h("h3", {}, one.name), picture.canvas,
      key(["blue", "learned"], ["floor", "95 % interval", true], ["red", `nearest form: ${one.form}`]),
      one.sentences.map((text) => h("p", {}, text)));
  }));
}

/** A surface over two signals: a curve along the first one for each level of the second. */
function surface(one) {
  const [[fx, ux], [fy, uy], [fz, uz]] = [shown(one.along_unit), shown(one.unit), shown(one.across_unit)];
  const last = one.rows.length - 1;
  const name = (k) => (k === 0 ? "blue" : k === last ? "red" : "pale");
  const at = (k) => `${one.across} ${number(fz * one.levels[k], 3)}${uz ? ` ${uz}` : ""}`;
  const picture = new Plot("", `${one.name}: the learned surface over ${one.along}, a curve for each level of ${one.across}`, (p) => {
    p.axes(extent([one.knots], 0.02, fx), extent(one.rows, 0.06, fy), `${one.along}${ux ? ` [${ux}]` : ""}`, uy);
    for (const k of [...one.rows.keys()].sort((a, b) => (name(b) === "pale") - (name(a) === "pale"))) {
      p.line(one.knots, one.rows[k], name(k), { fx, fy, width: name(k) === "pale" ? 1.2 : 2 });
      p.dots(one.knots, one.rows[k], name(k), { fx, fy, size: 3 });
    }
  });
  return h("figure", {}, h("h3", {}, one.name), picture.canvas,
    key(["blue", at(0)], ["pale", "levels between"], ["red", at(last)]),
    one.sentences.map((text) => h("p", {}, text)));
}

function evidence(verdict) {
  const rows = verdict.ranking.filter((row) => Number.isFinite(row.z_holdout));
  const before = verdict.before ?? Math.max(...rows.map((row) => row.z_holdout), 1);
  const log = (value) => Math.log10(Math.max(value, 1) * 1.02);
  return [h("h2", {}, "What each effect leaves"),
    rows.length ? bars("z with each effect", rows.slice(0, 20).map((row) => ({
      name: row.site && row.site !== "damper" ? `${row.name} (${row.site})` : row.name, value: log(row.z_holdout),
      strong: verdict.effects.includes(row.effect), good: row.z_holdout <= 1.1 && row.gain > 0.02,
      text: z(row.z_holdout), title: row.refined ? "fitted to the end" : "a first fit gained too little to go on",
    })), { edge: log(before), most: log(Math.max(before, 2)) }) : null,
    rows.length ? h("p", { class: "soft small" }, "Error / noise (z) on held-out runs, logarithmic, from z = 1 on the left. Green line: the model as it is. Green bar: down to the noise floor. Blue bar: named by the verdict, above the noise floor.") : null,
    blocks(verdict.details)];
}

const LIMITS = [
  ["stroke", "Stroke", "20 mm"],
  ["speed", "Speed", "200 mm/s"],
  ["force", "Force", "2 kN"],
  ["duration", "Duration", "12 s"],
];

function plans(page, found, verdict) {
  const inputs = LIMITS.map(([name, title, hint]) => h("label", { class: "field", style: { width: "8rem" } }, title,
    h("input", { type: "text", name, placeholder: hint, maxlength: "20" })));
  const go = h("button", { type: "submit" }, "Plan the next tests");
  const form = h("form", { class: "act" }, inputs, go);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const options = Object.fromEntries([...new FormData(form)].filter(([, text]) => text.trim()));
    page.run("plan", options);
  });
  page.onJobs(() => (go.disabled = Boolean(page.working()) || !verdict));
  return [
    h("h2", {}, "The next tests"),
    h("p", { class: "soft" }, "Motions and commands that decide what is still open, within the limits of your rig. Without limits, the range of the past runs is used."),
    form,
    found.plans.toReversed().map((plan) => plan.error ? wrong(plan.name, plan.error) : drawn(page, plan)),
  ];
}

function drawn(page, plan) {
  return h("section", {}, h("h3", {}, plan.name),
    h("p", {}, "The files are under ", h("a", { href: page.link("hand_on") }, "Export"), "."),
    h("div", { class: "grid" }, plan.runs.map((run) => {
      const [[name, motion], ...rest] = Object.entries(run.channels);
      const [factor, unit] = shown(name === "displacement" ? "m" : "m/s2");
      return h("figure", {}, h("h3", {}, `${run.name} (${run.role === "holdout" ? "held out" : "training"})`),
        new Plot("low", `${name} of ${run.name} over time`, (p) => {
          p.axes([run.time[0], run.time.at(-1)], extent([motion], 0.05, factor), rest.length ? null : "time [s]", unit);
          p.line(run.time, motion, "blue", { fy: factor });
        }).canvas,
        rest.map(([drive, values]) => new Plot("low", `${drive} of ${run.name} over time`, (p) => {
          p.axes([run.time[0], run.time.at(-1)], extent([values]), "time [s]", drive === "current" ? "A" : "V");
          p.line(run.time, values, "purple");
        }).canvas),
        h("figcaption", {}, run.about));
    })), key(["blue", "motion"], ["purple", "command"]));
}

