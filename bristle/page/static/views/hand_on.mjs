// View 6, Export: report, FMU and scenario, SSP package, and all files of the study to download.

import { download, get } from "../api.mjs";
import { bytes, h, say, table, wrong } from "../dom.mjs";

const GROUPS = [
  ["reports/", "Reports"],
  ["export/", "FMU, scenario and package"],
  ["design/", "Controllers"],
  ["comparisons/", "Comparisons of controllers"],
  ["plan", "Next tests"],
  ["", "The study itself"],
];

export async function show(page) {
  const { files } = await get(page.path("files"));
  const trouble = h("div", {});
  const report = h("button", { type: "button", class: "main", onclick: () => page.run("report") }, "Write the report");
  const fmu = h("button", { type: "button", class: "main", onclick: () => page.run("export") }, "Export the damper as an FMU");
  const scenario = files.map((file) => /^export\/([^/]+\.toml)$/.exec(file.name)?.[1]).find(Boolean);
  page.same(`bristle report ${page.study}`, `bristle export ${page.study}`,
    ...(scenario ? [`bristle export-ssp ${page.study}/export/${scenario}`] : []));
  const ssp = h("button", { type: "button", class: scenario ? "main" : null, onclick: () => page.run("export_ssp", { scenario }) }, "Pack the scenario as SSP");
  page.onJobs(() => {
    report.disabled = fmu.disabled = Boolean(page.working());
    ssp.disabled = report.disabled || !scenario;
  });
  const take = async (name, button) => {
    button.disabled = true;
    try {
      await download(page.study, name);
      say(`${name} is downloaded.`);
      trouble.replaceChildren();
    } catch (error) {
      trouble.replaceChildren(wrong("The file cannot be had", error.message));
    }
    button.disabled = false;
  };
  const left = new Set(files);
  const groups = GROUPS.map(([prefix, title]) => {
    const own = files.filter((file) => left.has(file) && file.name.startsWith(prefix));
    own.forEach((file) => left.delete(file));
    return [title, own];
  });
  return [
    h("h1", {}, "Export"),
    h("ul", { class: "cards" },
      h("li", { class: "card" }, h("h2", {}, "Report"),
        h("p", {}, "One HTML file that opens offline, with verdict, evidence, loops, parameters and their intervals, and the commands that repeat the study."), report),
      h("li", { class: "card" }, h("h2", {}, "FMU and scenario"),
        h("p", {}, "The damper with the identified values, for any FMI tool, and a scenario that applies a measured motion to it."), fmu),
      h("li", { class: "card" }, h("h2", {}, "SSP package"),
        h("p", {}, scenario ? `The scenario ${scenario} with its FMUs in one file, for OMSimulator, libcosim and others. It states the coupling error to expect there.`
          : "The scenario with its FMUs in one file, for other tools. Export the FMU first: its scenario is packed."), ssp),
      h("li", { class: "card" }, h("h2", {}, "In a building"),
        h("p", {}, "The damper with these values in a building under an earthquake."), h("a", { href: page.link("simulate"), onclick: () => (page.damper = page.study) }, "Simulate it"))),
    trouble,
    h("div", { class: "files" }, groups.filter(([, own]) => own.length).map(([title, own]) => table(title, ["file", "size", "written", "download"], own.map((file) => {
      const button = h("button", { type: "button", class: "quiet", "aria-label": `Download ${file.name}` }, "Download");
      button.addEventListener("click", () => take(file.name, button));
      return [h("code", {}, file.name), bytes(file.bytes), when(file.written), button];
    }), [1]))),
  ];
}

/** Returns date and time of day of a moment [s]. */
function when(moment) {
  const at = new Date(1000 * moment);
  const two = (number) => String(number).padStart(2, "0");
  return `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())} ${two(at.getHours())}:${two(at.getMinutes())}`;
}
