// View 9, Compare controllers: what is compared, and who wins by how much, beside constant voltages.

import { download, packed } from "../api.mjs";
import { empty, h, number, say, seconds, table, wrong } from "../dom.mjs";
import { acceptDrops, named, picker, take } from "../records.mjs";
import { WORDS } from "./simulate.mjs";

export async function show(page) {
  return new Comparing(page, await packed(page.path("controllers"))).nodes();
}

class Comparing {
  constructor(page, found) {
    Object.assign(this, { page, found });
    if (page.comparing?.study !== page.study) page.comparing = this.begin();
    this.asked = page.comparing;
    this.shown = found.comparisons.find((one) => one.number === this.asked.shown) ?? found.comparisons.at(-1) ?? null;
    this.state = h("p", { class: "small level-error", role: "alert" });
    this.list = h("ul", { class: "plain" });
  }

  /** Returns what the form begins with. */
  begin() {
    const { page, found } = this;
    const own = found.buildings.find((one) => one.study === page.study);
    return {
      study: page.study, shown: null, motions: [0.2, 0.4].map((peak) => ({ record: found.records[0].name, peak })),
      chosen: new Set(["LqgClipped", "Skyhook"]), building: own?.file ?? "", damper: page.study, members: 5, limit: false,
    };
  }

  nodes() {
    const { page, shown } = this;
    page.same(...(shown ? [shown.command] : []));
    const node = h("div", { class: "dropped" }, this.form((files) => take(node, files, (name) => this.takeRecord(name))));
    acceptDrops(node, (files) => take(node, files, (name) => this.takeRecord(name)));
    return [
      h("h1", {}, "Compare controllers"),
      h("p", { class: "lead" }, "Each controller acts in the building under each ground motion, beside the damper at constant voltages. The best constant voltage is found with the motion known in advance, so it is hard to beat."),
      node,
      ...(shown ? this.answer() : [empty("Not compared yet", "Choose what is compared, then press Compare. Members are buildings, dampers and sensors that differ a little from those the controllers were designed for. The worst of them shows how sure a result is.")]),
    ];
  }

  form(takeFiles) {
    const { page, found, asked } = this;
    const compare = h("button", { type: "submit", class: "main" }, "Compare");
    page.onJobs(() => (compare.disabled = Boolean(page.working())));
    const members = h("input", { id: "members", type: "number", min: 0, max: found.most.members, step: 1, value: asked.members, required: true });
    members.addEventListener("input", () => this.change(() => (asked.members = Number(members.value))));
    this.rows();
    const form = h("form", { "aria-label": "What is compared" },
      h("div", { class: "grid" },
        h("section", { "aria-labelledby": "motions-title" }, h("h2", { id: "motions-title" }, "Ground motions"), this.list,
          h("div", { class: "act" }, h("button", { type: "button", onclick: () => this.addMotion(found.records[0].name) }, "Add a motion"), picker(takeFiles))),
        h("section", { "aria-labelledby": "chosen-title" }, h("h2", { id: "chosen-title" }, "Controllers"),
          h("ul", { class: "plain" }, [...found.controllers, ...found.designs].map((name) => h("li", {}, this.box(name)))),
          found.designs.length ? null : h("p", { class: "soft small" }, "What ", h("a", { href: page.link("design") }, "view 8"), " solves can be chosen here too.")),
        h("section", { "aria-labelledby": "place-title" }, h("h2", { id: "place-title" }, "Building and damper"),
          h("div", { class: "act" },
            this.select("building", "Building", [["", "the library's, two storeys"], ...found.buildings.map((one) => [one.file, `that of ${one.study}`])]),
            this.select("damper", "Damper", [[page.study, `that of ${page.study}`], ["", "the library's LuGre damper"]])),
          h("div", { class: "act" },
            h("label", { class: "field", for: "members" }, "Members for the worst case", members),
            h("label", { class: "check" }, this.check(asked.limit, (on) => (asked.limit = on)), "also find the least that any voltage could reach")),
          h("p", { class: "soft small" }, "0 members: no worst case. The least of any voltage takes up to a minute for each motion."))),
      h("div", { class: "act" }, compare), this.state);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.compare();
    });
    return form;
  }

  async compare() {
    const { page, found, asked } = this;
    const chosen = (names) => names.filter((name) => asked.chosen.has(name));
    const place = found.buildings.find((one) => one.file === asked.building);
    this.state.textContent = chosen([...found.controllers, ...found.designs]).length ? "" : "Choose a controller, or more.";
    if (this.state.textContent) return;
    page.editing = false;
    asked.shown = null;
    await page.run("controllers", {
      number: found.next, motions: asked.motions, controllers: chosen(found.controllers), designs: chosen(found.designs),
      building: place?.file ?? "", device: place?.device ?? "", damper: asked.damper, members: asked.members, limit: asked.limit,
    });
  }

  /** Keeps what is chosen here until it is compared or left. */
  change(how) {
    how();
    this.page.editing = true;
  }

  check(on, then) {
    const box = h("input", { type: "checkbox", checked: on });
    box.addEventListener("change", () => this.change(() => then(box.checked)));
    return box;
  }

  box(name) {
    const { chosen } = this.asked;
    const box = this.check(chosen.has(name), (on) => (on ? chosen.add(name) : chosen.delete(name)));
    const words = this.found.designs.includes(name) ? "designed in view 8" : WORDS[name];
    return h("label", { class: "check" }, box, !words || words === name.toLowerCase() ? name : `${name}, ${words}`);
  }

  select(key, label, options) {
    const select = h("select", { id: key }, options.map(([value, text]) => h("option", { value, selected: value === this.asked[key] }, text)));
    select.addEventListener("change", () => this.change(() => (this.asked[key] = select.value)));
    return h("label", { class: "field", for: key }, label, select);
  }

  rows() {
    this.list.replaceChildren(...this.asked.motions.map((motion, k) => this.row(motion, k)));
  }

  row(motion, k) {
    const { found, asked } = this;
    const record = h("select", { id: `motion-${k}` }, found.records.map((one) =>
      h("option", { value: one.name, selected: one.name === motion.record }, `${named(one.name)}${one.peak === null ? "" : `, ${number(one.peak, 2)} g`}`)));
    record.addEventListener("change", () => this.change(() => (motion.record = record.value)));
    const peak = h("input", { id: `peak-${k}`, type: "number", min: 0.001, max: found.most.peak, step: "any", value: motion.peak, placeholder: "as recorded" });
    peak.addEventListener("input", () => this.change(() => (motion.peak = peak.value === "" ? null : Number(peak.value))));
    const remove = h("button", { type: "button", class: "quiet", disabled: asked.motions.length === 1, "aria-label": `Remove motion ${k + 1}`, onclick: () => {
      this.change(() => asked.motions.splice(k, 1));
      this.rows();
    } }, "Remove");
    return h("li", { class: "act motion" },
      h("label", { class: "field", for: record.id }, "record, with its peak", record),
      h("label", { class: "field", for: peak.id, style: { width: "6.5rem" } }, "peak [g]", peak), remove);
  }

  addMotion(record) {
    const { asked, found } = this;
    if (asked.motions.length >= found.most.motions) {
      this.state.textContent = `A comparison may have ${found.most.motions} ground motions.`;
      return;
    }
    this.change(() => asked.motions.push({ record, peak: null }));
    this.rows();
  }

  /** Adds a record that was dropped. */
  takeRecord(name) {
    this.found.records.push({ name, peak: null });
    this.addMotion(name);
    say(`${named(name)} is added.`);
  }

  answer() {
    const { page, found, shown, asked } = this;
    const [first, ...others] = shown.verdict;
    const select = h("select", { id: "comparison" }, found.comparisons.toReversed().map((one) => h("option", { value: one.number, selected: one === shown }, String(one.number))));
    select.addEventListener("change", () => {
      asked.shown = Number(select.value);
      page.again();
    });
    const numbers = shown.header.map((_, k) => k).slice(1);
    return [
      h("section", {},
        h("div", { class: "verdict", style: { "--tone": "var(--blue)" } }, h("span", { class: "kind" }, "Verdict"),
          h("p", { class: "say" }, first), others.map((text) => h("p", {}, text))),
        shown.older ? h("p", { class: "level-warning" }, `The model of ${page.study} has changed since this comparison.`) : null,
        shown.notes.map((text) => h("p", { class: "soft small" }, text))),
      h("div", { class: "cases" }, shown.tables.map((one) => table(one.motion, ["controller", ...shown.header.slice(1)],
        one.rows.map(([name, ...cells], k) => [k === one.lowest ? h("strong", {}, name) : name, ...cells]), numbers))),
      shown.footnotes.map((text) => h("p", { class: "soft small" }, text)),
      this.files(select),
    ];
  }

  files(select) {
    const { page, shown } = this;
    const trouble = h("div", {});
    const buttons = shown.files.map((name) => {
      const short = name.split("/").pop();
      const report = short === "report.html";
      return h("button", { type: "button", class: report ? "main" : null, onclick: () => download(page.study, name).then(
        () => say(`${short} is downloaded.`),
        (error) => trouble.replaceChildren(wrong("The file cannot be had", error.message)),
      ) }, report ? "Download the report" : short);
    });
    return h("section", {},
      h("div", { class: "act" }, h("label", { class: "field", for: "comparison" }, "Comparison shown", select), buttons),
      h("p", { class: "soft small" }, `Computed in ${seconds(shown.seconds)}. Bold: the lowest of the controllers. The report shows the runs, every constant voltage and how to repeat a case.`), trouble);
  }
}
