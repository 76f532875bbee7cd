// View 1, Data: traces with what the check found, channels, roles, excitation map.

import { packed } from "../api.mjs";
import { channels } from "../channels.mjs";
import { h, key, number, shown, unitText } from "../dom.mjs";
import { Plot, extent } from "../plot.mjs";

const ROLES = [
  ["train", "Training", "models are fitted to these"],
  ["holdout", "Held out", "these judge; no fit sees them"],
  ["test", "Test", "neither fit nor verdict sees them"],
  ["exclude", "Left out", "nothing reads them"],
];

const FIRST = ["ground_acceleration", "displacement", "velocity", "voltage", "current", "force"];
const SHOWN = 6; // channels that are drawn at once

export async function show(page) {
  const data = await packed(page.path("data"));
  page.same(`bristle study check ${page.study}`);
  const names = data.channels.map((one) => one.name);
  const state = { run: data.runs[0]?.name };
  const lead = h("p", { class: "lead", role: "status" }, `${runsOf(data)}. Checking the data …`);
  const found = h("div", {}, h("p", { class: "loading" }, "Checking the data …"));
  const drawn = traces(data, names, state);
  packed(page.path("check")).then(
    (check) => {
      const errors = check.findings.filter((one) => one.level === "error").length;
      lead.textContent = check.ok
        ? `${runsOf(data)}, nothing that must be corrected first.`
        : `${errors} error${errors === 1 ? "" : "s"} in the data. Correct them before you fit a model.`;
      found.replaceChildren(findings(page, check));
      mark(data, check);
      drawn.again();
    },
    (error) => {
      lead.textContent = `${runsOf(data)}.`;
      found.replaceChildren(page.failure(error));
    },
  );
  return [
    h("h1", {}, data.title),
    data.notes ? h("p", { class: "soft pre" }, data.notes) : null,
    lead,
    h("div", { class: "act" }, h("a", { href: page.link("fit") }, "Next: fit the model")),
    drawn.node,
    h("h2", {}, "What the check found"),
    found,
    h("h2", {}, "What the runs are for"),
    roles(page, data),
    excitation(data),
    channels(page, data),
  ];
}

const runsOf = (data) => `${data.runs.length} run${data.runs.length === 1 ? "" : "s"}`;

/** Puts what is cut off beside the traces; a run that is split in time has the name of its file. */
function mark(data, check) {
  for (const { run, channel, spans } of check.clipped) {
    const one = data.runs.find((other) => run === other.name || run.startsWith(`${other.name} (`) || run.startsWith(`${other.name}, `));
    if (one) ((one.clipped ??= {})[channel] ??= []).push(...spans);
  }
}

function traces(data, names, state) {
  const run = () => data.runs.find((one) => one.name === state.run);
  const select = h("select", { id: "run" }, data.runs.map((one) => h("option", { value: one.name }, one.name)));
  const rank = (name) => FIRST.findIndex((end) => name.endsWith(end));
  const kinds = data.channels.map((one) => [rank(one.name), one]).sort(([a], [b]) => (a < 0 ? 9 : a) - (b < 0 ? 9 : b)).map(([, one]) => one);
  const plots = kinds.map((channel) => new Plot("low", `${channel.name} over time`, (p) => {
    const one = run();
    const values = one.channels[channel.name];
    if (!values) return;
    p.axes([one.time[0], one.time[one.time.length - 1]], extent([values], 0.06, channel.factor),
      channel === kinds[Math.min(SHOWN, kinds.length) - 1] || channel === kinds.at(-1) ? "time [s]" : null, "");
    for (const [a, b] of one.gaps) p.band(a, b, "line");
    for (const [a, b] of one.clipped?.[channel.name] ?? []) p.band(a, b, "shade");
    p.line(one.time, values, "blue", { fy: channel.factor, width: 1 });
  }));
  select.addEventListener("change", () => {
    state.run = select.value;
    plots.forEach((plot) => plot.later());
  });
  const drawn = plots.map((plot, k) => h("figure", {}, h("h3", { class: "small" },
    kinds[k].name.replaceAll("_", " "), unitText(kinds[k].unit)), plot.canvas));
  const keys = h("div", {});
  const again = () => {
    const marked = data.runs.some((one) => one.gaps.length || one.clipped);
    keys.replaceChildren(...(marked ? [key(["shade", "cut off at the end of its range", true], ["line", "not measured", true])] : []));
    plots.forEach((plot) => plot.later());
  };
  again();
  const node = h("section", {}, h("h2", {}, "Traces"),
    h("div", { class: "act" }, h("label", { class: "field", for: "run" }, "Run", select)),
    drawn.slice(0, SHOWN),
    drawn.length > SHOWN ? h("details", {}, h("summary", {}, `${drawn.length - SHOWN} more channels`), drawn.slice(SHOWN)) : null,
    keys);
  return { node, again };
}

function findings(page, data) {
  const can = data.findings.some((one) => one.can_correct);
  const rows = data.findings.filter((one) => one.kind !== "noise" || one.level !== "note");
  const word = { error: "Error", warning: "Warning", note: "Note" };
  const correct = h("button", { type: "button", onclick: () => page.run("check", { correct: true }) }, "Correct what can be corrected");
  const spikes = data.findings.some((one) => one.kind === "spikes");
  const mask = h("button", { type: "button", onclick: () => page.run("check", { mask: true }) }, "Mask isolated spikes");
  page.onJobs(() => (correct.disabled = mask.disabled = Boolean(page.working())));
  if (!rows.length) return h("p", { class: "soft" }, "Nothing.");
  return h("div", {},
    h("ul", { class: "findings" }, rows.map((one) => h("li", {},
      h("span", { class: `level-${one.level}` }, `${word[one.level]}: `), one.text,
      one.do ? h("div", { class: "soft" }, one.do) : null))),
    can || spikes ? h("div", { class: "act" }, can ? correct : null, spikes ? mask : null) : null);
}

/** The roles of runs: dragged between columns, or chosen from a menu. */
function roles(page, data) {
  const wanted = new Map(data.files.map((file) => [file.name, file.role]));
  const whole = h("div", { class: "roles" });
  const apply = h("button", { type: "button", class: "main" }, "Write these roles into the study");
  const back = h("button", { type: "button" }, "Reset the roles");
  const row = h("div", { class: "act", hidden: true }, apply, back);
  const moved = () => data.files.filter((file) => wanted.get(file.name) !== file.role);
  apply.addEventListener("click", () => {
    const options = {};
    for (const file of moved()) (options[wanted.get(file.name)] ??= []).push(file.name);
    page.run("roles", options);
  });
  back.addEventListener("click", () => {
    for (const file of data.files) wanted.set(file.name, file.role);
    draw();
  });
  page.onJobs(() => (apply.disabled = Boolean(page.working())));

  function put(name, role) {
    wanted.set(name, role);
    draw();
  }

  function item(file) {
    const role = wanted.get(file.name);
    const select = h("select", { "aria-label": `role of ${file.name}` },
      ROLES.map(([value, text]) => h("option", { value, selected: value === role }, text)));
    select.addEventListener("change", () => put(file.name, select.value));
    return h("li", { draggable: "true", class: role === file.role ? null : "moved",
      ondragstart: (event) => event.dataTransfer.setData("text/plain", file.name) },
      h("span", { title: file.name }, file.name.replace(/^data\//, "")), select);
  }

  function draw() {
    whole.replaceChildren(...ROLES.map(([role, title, text]) => {
      const box = h("section", { class: "role", "aria-label": title },
        h("h3", {}, title), h("p", { class: "soft small" }, text),
        h("ul", {}, data.files.filter((file) => wanted.get(file.name) === role).map(item)));
      box.addEventListener("dragover", (event) => {
        event.preventDefault();
        box.classList.add("over");
      });
      box.addEventListener("dragleave", () => box.classList.remove("over"));
      box.addEventListener("drop", (event) => {
        event.preventDefault();
        const name = event.dataTransfer.getData("text/plain");
        if (wanted.has(name)) put(name, role);
      });
      return box;
    }));
    row.hidden = moved().length === 0;
  }
  draw();
  return h("div", {}, whole, row);
}

/** Where in displacement and velocity the runs have been, coloured by the command. */
function excitation(data) {
  const runs = data.runs.filter((run) => run.excitation);
  if (!runs.length) return null;
  const of = (name) => runs.map((run) => run.excitation[name]);
  const [fx, ux] = shown("m");
  const [fv, uv] = shown("m/s");
  const levels = of("level").filter(Boolean);
  const most = levels.length ? Math.max(...levels.map((one) => one.reduce((a, b) => Math.max(a, Math.abs(b)), 0))) : 0;
  const held = (run) => run.role === "holdout" || run.role === "test";
  const draw = (which) => (p) => {
    p.axes(extent(of("x"), 0.05, fx), extent(of("v"), 0.05, fv), `displacement [${ux}]`, `velocity [${uv}]`);
    for (const run of runs.filter(which)) {
      const { x, v, level } = run.excitation;
      for (const [low, high, name] of [[-1, 1 / 3, "pale"], [1 / 3, 2 / 3, "mark"], [2 / 3, 9, "blue"]]) {
        const chosen = level && most ? (k) => Math.abs(level[k]) / most > low && Math.abs(level[k]) / most <= high : null;
        p.dots(x, v, chosen ? name : "blue", { fx, fy: fv, chosen, size: 2 });
        if (!chosen) break;
      }
    }
  };
  const drive = runs[0].excitation.drive;
  const unit = drive === "current" ? "A" : "V";
  const at = (share) => number(share * most, 2);
  return h("section", {},
    h("h2", {}, "What the runs cover"),
    h("div", { class: "grid" },
      h("figure", {}, h("h3", {}, "Training"), new Plot("high", "displacement and velocity of the training runs", draw((run) => !held(run))).canvas),
      h("figure", {}, h("h3", {}, "Held out"), new Plot("high", "displacement and velocity of the held-out runs", draw(held)).canvas)),
    most ? key(["pale", `up to ${at(1 / 3)} ${unit}`], ["mark", `to ${at(2 / 3)} ${unit}`], ["blue", `to ${at(1)} ${unit}`]) : null,
    h("p", { class: "soft small" }, "Held-out runs judge a model best where training runs cover the same motions."));
}
