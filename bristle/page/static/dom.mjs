// Elements, and numbers as people read them.

/**
 * Returns an element. Names that begin with "on" are listeners; others are attributes, left out
 * where they are null or false. Texts become text and never markup.
 * @param {string} tag
 * @param {Object<string, any>=} properties
 * @param {...(Node|string|null|undefined|false|Array)} children
 */
export function h(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "style") for (const [key, one] of Object.entries(value)) made.style.setProperty(key, one);
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children.flat(Infinity).filter((one) => one !== null && one !== undefined && one !== false));
  return made;
}

/** Returns a number with some significant digits. */
export function number(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) return value.toExponential(digits - 1);
  return String(Number(value.toPrecision(digits))).replace("-", "\u2212");
}

/** Returns error / noise (z) as the commands show it. */
export function z(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return value < 100 ? value.toFixed(2) : value.toPrecision(3);
}

const SCALES = { m: [1e3, "mm"], "m/s": [1e3, "mm/s"], "m/s2": [1, "m/s²"] };

/** Returns the factor from SI and the unit in which an engineer reads a signal. */
export const shown = (unit) => SCALES[unit] ?? [1, unit === "1" ? "" : unit];

export const unitText = (unit) => (unit && unit !== "1" ? ` [${unit}]` : "");

export const percent = (share, digits = 1) => `${(100 * share).toFixed(digits)} %`;

export function seconds(value) {
  if (value < 60) return `${value.toFixed(value < 10 ? 1 : 0)} s`;
  return `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`;
}

export function bytes(count) {
  if (count < 1e3) return `${count} B`;
  return count < 1e6 ? `${(count / 1e3).toFixed(0)} kB` : `${(count / 1e6).toFixed(1)} MB`;
}

/** Says a text to whoever listens to the page. */
export function say(text) {
  document.getElementById("said").textContent = text;
}

const NARROW = 3; // columns up to which a table fits on the screen of a telephone

/**
 * Returns a table; `numbers` are the columns that are set right, the first column heads its row. On a
 * narrow screen the cells of a wide table stand below each other, each with the title of its column.
 */
export function table(caption, header, rows, numbers = []) {
  const kind = (k) => (numbers.includes(k) ? "n" : null);
  const wide = header.length > NARROW;
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": caption },
    h("table", { class: wide ? "wide" : null },
      h("caption", {}, caption),
      h("thead", {}, h("tr", {}, header.map((text, k) => h("th", { scope: "col", class: kind(k) }, text)))),
      h("tbody", {}, rows.map((row) => h("tr", {}, row.map((cell, k) =>
        k === 0 ? h("th", { scope: "row" }, cell) : h("td", { class: kind(k), "data-of": wide ? header[k] : null }, cell)))))));
}

/** Returns the words and tables of a result: blocks of view/html.py. */
export const blocks = (list) => list.map((one) => one.rows
  ? [table(one.title, one.header, one.rows, one.numbers), one.note ? h("p", { class: "soft small" }, one.note) : null]
  : h("p", { class: { say: "say", note: "soft small", soft: "soft small" }[one.kind] }, one.text));

/** Returns a command with a button that copies it. */
export function commandLine(text, note = "") {
  const button = h("button", { type: "button", class: "quiet", "aria-label": `Copy: ${text}` }, "Copy");
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
      say("Copied.");
    } catch {
      const range = document.createRange();
      range.selectNodeContents(button.parentElement.querySelector("code"));
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      button.textContent = "Selected";
    }
    setTimeout(() => (button.textContent = "Copy"), 1500);
  });
  return h("div", { class: "did" }, h("code", {}, text), note && h("span", { class: "state-word" }, note), button);
}

/** Returns what stands where there is nothing yet: a heading, a sentence, and what to do. */
export function empty(title, text, ...actions) {
  return h("div", { class: "state" }, h("h2", {}, title), h("p", {}, text),
    actions.length ? h("div", { class: "act" }, actions) : null);
}

/** Returns what is shown in place of a view that cannot be shown. */
export function wrong(title, text, ...more) {
  return h("div", { class: "state wrong", role: "alert" }, h("h2", {}, title), h("p", { class: "pre" }, text), more);
}

/** Returns the key of a picture: [colour's name, text]. */
export function key(...entries) {
  return h("ul", { class: "key" }, entries.map(([colour, text, box]) =>
    h("li", {}, h("i", { class: box ? "box" : null, style: { color: `var(--${colour})` } }), text)));
}

/**
 * Returns bars side by side: {name, value, text, strong, good, title}; `edge` is a line across all.
 * @param {string} label
 */
export function bars(label, rows, { edge = null, most = null } = {}) {
  const top = most ?? Math.max(...rows.map((row) => row.value ?? 0), edge ?? 0, 1e-9);
  const width = (value) => `${Math.min(100, Math.max(0.4, (100 * value) / top)).toFixed(2)}%`;
  return h("ul", { class: "bars", "aria-label": label }, rows.map((row) =>
    h("li", { title: row.title },
      h("span", { class: "name" }, row.name),
      h("span", { class: "track", "aria-hidden": "true" },
        row.value === null ? null : h("span", {
          class: `fill${row.strong ? " strong" : ""}${row.good ? " good" : ""}`, style: { width: width(row.value) },
        }),
        edge === null ? null : h("span", { class: "edge", style: { left: width(edge) } })),
      h("span", { class: "num" }, row.text))));
}
