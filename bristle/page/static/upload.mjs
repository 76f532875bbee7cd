// Files that are dropped: sent to the folder of the studies, looked at, and made a study.

import { packed, put } from "./api.mjs";
import { columnRow } from "./columns.mjs";
import { bytes, h, say, wrong } from "./dom.mjs";

const LARGEST = 256 * 1024 ** 2;

/** Returns the place where measurement files are dropped, and what follows. */
export function uploader(page) {
  const whole = h("div", {});
  begin(page, whole);
  return whole;
}

function begin(page, whole) {
  page.editing = false;
  const input = h("input", { type: "file", multiple: true, class: "unseen", id: "files", "aria-label": "Measurement files" });
  const choose = h("button", { type: "button", onclick: () => input.click() }, "Choose files");
  const drop = h("div", { class: "drop" },
    h("p", {}, "Drop measurement files here: CSV, text, MAT, Excel, TDMS, HDF5, Parquet."),
    h("p", { class: "soft small" }, "One file per run. For a study of a building, add the file of the building (tower.toml)."),
    h("div", { class: "act", style: { "justify-content": "center" } }, choose), input);
  const take = (files) => files.length && send(page, whole, [...files]);
  input.addEventListener("change", () => take(input.files));
  drop.addEventListener("dragover", (event) => {
    event.preventDefault();
    drop.classList.add("over");
  });
  drop.addEventListener("dragleave", () => drop.classList.remove("over"));
  drop.addEventListener("drop", (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    take(event.dataTransfer.files);
  });
  whole.replaceChildren(drop);
}

async function send(page, whole, files) {
  const batch = new Date().toISOString().slice(0, 19).replace(/[T:]/g, "-").toLowerCase();
  const large = files.find((file) => file.size > LARGEST);
  if (large) return trouble(page, whole, `${large.name}: ${bytes(large.size)}; a measurement may have ${bytes(LARGEST)}. Cut it, or sample it more coarsely.`);
  let building = "";
  try {
    for (const [k, file] of files.entries()) {
      whole.replaceChildren(h("p", { class: "loading", role: "status" }, `Reading ${file.name}, ${k + 1} of ${files.length} …`));
      const isBuilding = file.name.toLowerCase().endsWith(".toml");
      if (isBuilding) building = file.name;
      await put(`uploads/${batch}/${isBuilding ? "building/" : ""}${encodeURIComponent(file.name)}`, file);
    }
    const query = building ? `?building=${encodeURIComponent(building)}` : "";
    const found = await packed(`uploads/${batch}/columns${query}`);
    whole.replaceChildren(...preview(page, whole, batch, building, found));
    say("The columns are read. Check them, then make the study.");
  } catch (error) {
    trouble(page, whole, error.message);
  }
}

function trouble(page, whole, text) {
  begin(page, whole);
  whole.append(wrong("These files cannot be read", text));
}

/** Returns the columns as they were guessed, each with menus to correct it. */
function preview(page, whole, batch, building, found) {
  const name = h("input", { type: "text", id: "new-name", value: "my_rig", maxlength: "60", pattern: "\\w[\\w .+\\-]*", required: true });
  const rows = found.columns.map((column) => columnRow(column, found.known,
    column.reason ? `Guessed by ${column.reason}.${column.doubt ? ` Doubtful: ${column.doubt}.` : ""}` : ""));
  const said = h("p", { role: "alert" });
  const make = h("button", { type: "submit", class: "main" }, "Make the study");
  page.editing = true; // what is chosen here stays until it is made or left
  const form = h("form", { class: "act" },
    h("label", { class: "field" }, "Name of the study", name), make,
    h("button", { type: "button", onclick: () => begin(page, whole) }, "Other files"));
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (!name.reportValidity()) return;
    const channels = rows.map((row) => row.changed()).filter(Boolean);
    make.disabled = true;
    page.ended = (job) => {
      if (job.what !== "new") return;
      make.disabled = false;
      if (job.state === "done") location.hash = page.link("data", job.study);
      else said.textContent = "The study was not made. What is wrong stands above.";
    };
    if (!(await page.run("new", { batch, building, channels }, name.value.trim()))) make.disabled = false;
  });
  const bad = found.files.filter((file) => file.error);
  return [
    h("p", {}, `${found.files.length - bad.length} file${found.files.length - bad.length === 1 ? "" : "s"} can be read. `,
      `The columns of ${found.first}, and what they are taken for:`),
    bad.length ? wrong("Some files cannot be read", bad.map((file) => file.error).join("\n")) : null,
    h("div", { class: "grid" }, rows.map((row) => row.node)),
    form, said,
  ].filter(Boolean);
}
