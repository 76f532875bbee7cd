// A column of a file: its trace, and the menus for the channel that it is, its unit and its sign.

import { h } from "./dom.mjs";
import { Plot, extent } from "./plot.mjs";

/**
 * Returns the row of a column as it is taken now.
 * @param {object} column as `columns_view.py` tells it
 * @param {object[]} known the channels that it may be, with their units
 * @param {string} said below the trace
 */
export function columnRow(column, known, said) {
  const id = `column-${column.text.replace(/\W+/g, "-")}`;
  const options = [h("option", { value: "" }, "not used"),
    ...known.map((one) => h("option", { value: one.name, selected: one.name === column.channel }, one.name.replaceAll("_", " ")))];
  if (column.channel && !known.some((one) => one.name === column.channel)) {
    options.push(h("option", { value: column.channel, selected: true }, column.channel));
  }
  const channel = h("select", { id }, options);
  const units = h("datalist", { id: `${id}-units` });
  const unit = h("input", { type: "text", value: column.guessed_unit || column.unit, maxlength: "12", list: `${id}-units`, "aria-label": `unit of ${column.text}` });
  const turned = h("input", { type: "checkbox", checked: column.sign < 0 });
  const plot = column.values
    ? new Plot("low", `${column.text} over the rows of the file`, (p) => {
        p.axes([0, column.values.length - 1], extent([column.values]), null, "");
        p.line(Float32Array.from(column.values, (_, k) => k), column.values, "blue");
      }).canvas
    : h("p", { class: "soft" }, "no numbers");
  const offer = () => {
    const fitting = known.find((one) => one.name === channel.value)?.units ?? [];
    units.replaceChildren(...fitting.map((one) => h("option", { value: one })));
  };
  channel.addEventListener("change", offer);
  offer();
  const node = h("figure", {},
    h("h3", {}, column.text), plot,
    h("div", { class: "act" },
      h("label", { class: "field", for: id }, "is", channel),
      h("label", { class: "field", style: { width: "6rem" } }, "unit", unit, units),
      h("label", { class: "check" }, turned, "turn the sign")),
    said ? h("figcaption", {}, said) : null);
  const same = () => channel.value === column.channel && unit.value === (column.guessed_unit || column.unit) && turned.checked === column.sign < 0;
  return {
    node,
    channel: () => channel.value,
    /** Takes the channel away from this column. */
    release() {
      channel.value = "";
      offer();
    },
    /** Returns CHANNEL=COLUMN@UNIT where the user has another mind than what stands there. */
    changed() {
      if (same() || !channel.value) return null;
      return `${channel.value}=${turned.checked ? "-" : ""}${column.text}${unit.value.trim() ? `@${unit.value.trim()}` : ""}`;
    },
  };
}
