// View 8, Design: weights on the singular values, gamma and margins of each solve.

import { packed, post, postPacked } from "../api.mjs";
import { empty, h, key, number, percent, table, wrong } from "../dom.mjs";
import { Plot, extent } from "../plot.mjs";

const KINDS = { hinf: "H-infinity, commands a force", lpv: "LPV, commands the voltage" };
const REST = 120; // ms that sliders rest until their weights are drawn

export async function show(page) {
  const found = await packed(page.path("design"));
  return new Design(page, found).nodes();
}

class Design {
  constructor(page, found) {
    Object.assign(this, { page, found });
    const own = page.design?.study === page.study ? page.design : null;
    this.solve = found.solves.find((one) => one.name === own?.name) ?? found.solves.at(-1) ?? null;
    page.design = { study: page.study, name: this.solve?.name };
    this.kind = own?.kind ?? this.solve?.kind ?? found.kinds[0];
    const begin = Object.fromEntries(found.fields.map((field) => [field.name, field.value]));
    this.values = { ...begin, ...this.solve?.values, ...own?.values };
    this.weights = null;
    this.state = h("p", { class: "soft small", role: "status" });
    this.plots = [
      this.plot("top floor's acceleration per ground acceleration", "acceleration", ""),
      this.plot("command per ground acceleration", "command", ""),
    ];
    this.askWeights();
  }

  nodes() {
    const { page, found, solve } = this;
    this.commands = solve ? [`bristle design ${solve.kind} ${page.study}/design/${solve.name}.toml --out=${page.study}/design/${solve.name}.json`] : [];
    page.same(...this.commands);
    return [
      h("h1", {}, solve ? `Gamma is ${number(solve.gamma, 4)}` : "Design a controller"),
      h("p", { class: "lead" }, "The controller keeps the top floor's acceleration small with little command. The weights say how much each counts. The solver finds the least gamma: each closed-loop response stays below gamma divided by its weight."),
      found.refused ? wrong("No design for this study", found.refused) : null,
      h("div", { class: "bench" }, this.form(), h("section", {}, h("h2", {}, "Responses over frequency"),
        h("div", { class: "grid" }, this.plots.map(({ title, plot }) => h("figure", {}, h("h3", {}, title), plot.canvas))),
        key(["mark", "without control"], ["blue", "closed loop"], ["soft", "dotted: gamma / weight"], ["purple", "dashed: the same with the sliders' weights"]))),
      solve ? this.solves() : empty("Not solved yet", `Solve designs a controller for the damper of this study (law ${found.law}), verifies it, and shows gamma and margins.`),
    ];
  }

  form() {
    const { page, found } = this;
    const kind = h("select", { id: "kind" }, found.kinds.map((one) => h("option", { value: one, selected: one === this.kind }, KINDS[one] ?? one)));
    kind.addEventListener("change", () => {
      this.kind = kind.value;
      this.moved();
    });
    const sliders = found.fields.map((field) => this.slider(field));
    const solve = h("button", { type: "submit", class: "main" }, "Solve");
    const back = h("button", { type: "button", onclick: () => {
      for (const { field, put } of sliders) put((this.values[field.name] = field.value));
      this.moved();
    } }, "Default values");
    page.onJobs(() => (solve.disabled = Boolean(page.working() || found.refused)));
    const form = h("form", { "aria-label": "Weights" }, h("label", { class: "field", for: "kind", style: { "margin-bottom": "1rem" } }, "Controller", kind),
      sliders.map(({ node }) => node), h("div", { class: "act" }, solve, back), this.state);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      try {
        const { name } = await post(page.path("design"), { kind: this.kind, values: this.values });
        page.design = { study: page.study, name, kind: this.kind, values: { ...this.values } };
        page.editing = false;
        await page.run("design", { name });
      } catch (error) {
        this.state.textContent = error.message;
      }
    });
    return form;
  }

  slider(field) {
    const id = `weight-${field.name}`;
    const [low, high] = [Math.log(field.low), Math.log(field.high)];
    const output = h("output", {});
    const input = h("input", { id, type: "range", min: 0, max: 1000, step: "any" });
    const tell = (value) => {
      output.textContent = `${number(value, 3)} ${field.unit.replace("s2", "s²")}`;
      input.setAttribute("aria-valuetext", output.textContent);
    };
    const put = (value) => {
      input.value = String((1000 * (Math.log(value) - low)) / (high - low));
      tell(value);
    };
    put(this.values[field.name]);
    input.addEventListener("input", () => {
      const value = Number(Math.exp(low + (Number(input.value) / 1000) * (high - low)).toPrecision(3));
      this.values[field.name] = Math.min(Math.max(value, field.low), field.high);
      tell(this.values[field.name]);
      this.moved();
    });
    return { field, put, node: h("label", { class: "slider", for: id }, h("span", {}, field.name), output, h("small", {}, field.text), input) };
  }

  moved() {
    this.page.editing = true; // what is chosen here stays until it is solved or left
    Object.assign(this.page.design, { kind: this.kind, values: { ...this.values } });
    clearTimeout(this.later);
    this.later = setTimeout(() => this.askWeights(), REST);
  }

  /** Asks what the weights of the sliders are over frequency, and what looks unmeant in them. */
  async askWeights() {
    const asked = JSON.stringify([this.kind, this.values]);
    try {
      const found = await postPacked(this.page.path("weights"), { kind: this.kind, values: this.values });
      if (asked !== JSON.stringify([this.kind, this.values])) return;
      this.weights = found;
      this.state.textContent = found.warnings.join(" ");
    } catch (error) {
      this.weights = null;
      this.state.textContent = error.message;
    }
    for (const { plot } of this.plots) plot.later();
  }

  plot(title, what, unit) {
    const plot = new Plot("high", `${title}, over frequency, with what the weights allow`, (p) => this.draw(p, what, unit));
    return { title: title[0].toUpperCase() + title.slice(1), plot };
  }

  draw(p, what, unit) {
    const log = (values) => Float64Array.from(values, (one) => Math.log10(Math.max(one, 1e-30)));
    const { solve, weights } = this;
    const curves = [];
    const f = solve?.frequency ?? weights?.frequency;
    if (!f) return;
    for (const speed of solve?.speeds ?? []) {
      if (what === "acceleration") curves.push([f, speed.acceleration_open, "mark", { width: 1 }]);
      curves.push([f, speed[what === "acceleration" ? "acceleration_closed" : "command"], "blue", { width: solve.speeds.length > 1 ? 1 : 1.7 }]);
    }
    if (solve) curves.push([f, solve.speeds[0][`${what}_bound`], "soft", { width: 1.4, dash: [1.5, 3] }]);
    else if (what === "acceleration") curves.push([weights.frequency, weights.acceleration_open, "mark", { width: 1 }]);
    const changed = !solve || this.kind !== solve.kind || Object.entries(solve.values).some(([name, value]) => Math.abs(value / this.values[name] - 1) > 1e-6);
    if (weights && changed) {
      const bound = weights[`${what}_weight`].map((one) => (solve?.gamma ?? 1) / one);
      curves.push([weights.frequency, bound, "purple", { width: 1.4, dash: [6, 4] }]);
    }
    const drawn = curves.map(([x, y, ...more]) => [log(x), log(y), ...more]);
    const [low, high] = extent(drawn.map(([, y]) => y));
    p.axes([drawn[0][0][0], drawn[0][0].at(-1)], [Math.max(low, high - 4.5), high], "frequency [Hz]", unit, { logX: true, logY: true });
    for (const [x, y, colour, how] of drawn) p.line(x, y, colour, how);
  }

  solves() {
    const { page, found, solve } = this;
    const any = (value, text) => (value === null ? text : number(value, 3));
    const select = h("select", { id: "solve" }, found.solves.toReversed().map((one) => h("option", { value: one.name, selected: one === solve }, one.name)));
    select.addEventListener("change", () => {
      page.design = { study: page.study, name: select.value };
      page.again();
    });
    return h("section", {},
      table("Designed controllers", ["controller", "gamma", "closed-loop norm", "modulus margin", "gain margin", "phase margin [deg]", "states"],
        found.solves.toReversed().map((one) => [
          `${one.name}${one === solve ? " (shown)" : ""}${one.older ? ", for an older model" : ""}`, number(one.gamma, 4), number(one.norm, 4), number(one.margins.modulus, 3),
          any(one.margins.gain_up, "any larger"), any(one.margins.phase, "any"), String(one.states),
        ]), [1, 2, 3, 4, 5, 6]),
      h("div", { class: "act" }, h("label", { class: "field", for: "solve" }, "Controller shown", select), h("a", { href: page.link("hand_on") }, "Download the controller file"),
        h("a", { href: page.link("controllers") }, "Compare it under ground motions")),
      h("p", { class: "soft small" }, "Margins are those of the loop at the measured acceleration. Modulus margin: the distance from −1. Gain margin: a factor. Of an LPV controller they are the least over its speeds, each held constant",
        solve.proved === null ? "." : `; its bound is proved at ${percent(solve.proved, 0)} of the table's speeds.`));
  }
}
