// The channels of a study, corrected: menus for column, unit and sign, and what they would change.

import { packed, postPacked } from "./api.mjs";
import { columnRow } from "./columns.mjs";
import { h, number, table, unitText, wrong } from "./dom.mjs";
import { Plot, extent } from "./plot.mjs";

const PAUSE = 350; // ms after the last change, before the server is asked

/** Returns the channels of a study, and what corrects them. */
export function channels(page, data) {
  const whole = h("div");
  const begin = () => {
    page.editing = false;
    const open = h("button", { type: "button", onclick: () => edit(page, whole, begin) }, "Correct a column, a unit or a sign");
    page.onJobs(() => (open.disabled = Boolean(page.working())));
    whole.replaceChildren(listed(data), h("div", { class: "act" }, open));
  };
  begin();
  return whole;
}

function listed(data) {
  return table("Channels",
    ["channel", "column", "in the file", "lowest", "highest", "noise", "unit"],
    data.channels.map((one) => [
      one.name.replaceAll("_", " "),
      one.column ? `${one.column}${one.turned ? " (sign turned)" : ""}` : "–", one.in_file,
      number(one.low, 4), number(one.high, 4), number(one.noise, 2), one.unit === "1" ? "" : one.unit,
    ]), [3, 4, 5]);
}

async function edit(page, whole, begin) {
  page.editing = true; // what is chosen here stays until it is written or left
  whole.append(h("p", { class: "loading", role: "status" }, "Reading the columns …"));
  let found;
  try {
    found = await packed(page.path("channels"));
  } catch (error) {
    begin();
    whole.append(page.failure(error));
    return;
  }
  const before = new Set(found.columns.map((column) => column.channel).filter(Boolean));
  const rows = found.columns.map((column) => columnRow(column, found.known, about(column, found.extra)));
  const shown = h("div", { role: "status" });
  const apply = h("button", { type: "button", class: "main", disabled: true }, "Write these channels into the study");
  const leave = h("button", { type: "button", onclick: begin }, "As they are");
  let [asked, timer, right] = [0, 0, false];

  const wanted = () => {
    const chosen = new Set(rows.map((row) => row.channel()));
    return { channels: rows.map((row) => row.changed()).filter(Boolean), without: [...before].filter((name) => !chosen.has(name)) };
  };
  const allow = () => (apply.disabled = !right || Boolean(page.working()));

  async function look() {
    const [turn, options] = [++asked, wanted()];
    right = false;
    allow();
    if (!options.channels.length && !options.without.length) return shown.replaceChildren();
    let content;
    try {
      const told = await postPacked(page.path("preview"), options);
      if (turn === asked) right = told.changes.length > 0;
      content = preview(told);
    } catch (error) {
      content = [wrong("The study cannot be read so", error.message)];
    }
    if (turn !== asked) return; // something else was chosen meanwhile
    shown.replaceChildren(...content);
    allow();
  }

  const later = () => {
    asked++; // what is on its way is of the choice before
    right = false;
    allow();
    clearTimeout(timer);
    timer = setTimeout(look, PAUSE);
  };
  for (const row of rows) {
    row.node.addEventListener("input", later);
    row.node.addEventListener("change", () => {
      const own = row.channel();
      for (const other of rows) if (other !== row && own && other.channel() === own) other.release();
      later();
    });
  }
  apply.addEventListener("click", () => {
    page.ended = (job) => {
      if (job.what === "channels" && job.state === "done") page.editing = false;
    };
    page.run("channels", wanted());
  });
  page.onJobs(allow);
  whole.replaceChildren(
    h("h2", {}, "Correct a column, a unit or a sign"),
    h("p", {}, `The columns of ${found.first}, and how study.toml reads them. Every run is read so.`),
    h("div", { class: "grid" }, rows.map((row) => row.node)),
    shown, h("div", { class: "act" }, apply, leave));
}

/** Returns what is said of a column as it stands. */
function about(column, extra) {
  if (extra[column.text]) return `An extra channel, ${extra[column.text]}: an error may depend on it.`;
  if (!column.channel) return "";
  return column.reason ? `As guessed by ${column.reason}.${column.doubt ? ` Doubtful: ${column.doubt}.` : ""}` : "Given by hand, or not as bristle would guess it.";
}

/** Returns what would change: each channel before and after, and what is no longer of the data. */
function preview(told) {
  if (!told.changes.length) return [h("p", { class: "soft" }, "The channels are so already.")];
  return [
    h("h3", {}, "What changes"),
    ...told.changes.map((one) => h("section", { "aria-label": `${one.channel} before and after` },
      h("p", {}, h("strong", {}, one.channel.replaceAll("_", " ")), `: ${one.before} → ${one.after}`),
      h("div", { class: "grid" }, one.traces.map((trace, k) => traceOf(one.channel, trace, k ? "after" : "before"))))),
    told.notes.length ? h("ul", {}, told.notes.map((note) => h("li", {}, `${note[0].toUpperCase()}${note.slice(1)}.`))) : null,
    told.results.length
      ? h("div", {}, h("p", {}, "These steps are of the channels as they are now. They stay in the history, and the model begins anew:"),
          h("ul", {}, told.results.map((text) => h("li", {}, text))))
      : null,
  ].filter(Boolean);
}

function traceOf(channel, trace, when) {
  const title = `${channel.replaceAll("_", " ")} ${when}`;
  if (!trace) return h("figure", {}, h("h3", { class: "small" }, title), h("p", { class: "soft" }, "not read as a trace"));
  const { time, values, factor, unit, low, high } = trace;
  return h("figure", {}, h("h3", { class: "small" }, title, unitText(unit), `, from ${number(low)} to ${number(high)}`),
    new Plot("middle", `${title} over time`, (p) => {
      p.axes([time[0], time[time.length - 1]], extent([values], 0.06, factor), "time [s]", "");
      p.line(time, values, when === "after" ? "blue" : "mark", { fy: factor, width: 1 });
    }).canvas);
}
