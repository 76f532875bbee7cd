// Ground motions: how they are called, and files of one's own.

import { put } from "./api.mjs";
import { bytes, h, wrong } from "./dom.mjs";

const LARGEST = 64 * 1024 ** 2; // bytes of a ground motion, as its reader has it

/** Returns what a ground motion is called: its name, or that of the dropped file. */
export const named = (name) => (name.includes("/") ? `${name.split("/").pop()} (dropped)` : name);

/** Returns a button that chooses the file of a ground motion. */
export function picker(then) {
  const input = h("input", { type: "file", class: "unseen", id: "record-file", accept: ".at2,.csv,.txt,.dat", "aria-label": "Ground motion file", tabindex: "-1" });
  input.addEventListener("change", () => input.files.length && then([...input.files]));
  return h("span", {}, h("button", { type: "button", onclick: () => input.click() }, "Another record"), " ",
    h("span", { class: "soft small" }, "AT2 or CSV; or drop it here"), input);
}

/** Lets files be dropped onto a node. */
export function acceptDrops(node, then) {
  node.addEventListener("dragover", (event) => {
    event.preventDefault();
    node.classList.add("over");
  });
  node.addEventListener("dragleave", (event) => {
    if (!node.contains(event.relatedTarget)) node.classList.remove("over");
  });
  node.addEventListener("drop", (event) => {
    event.preventDefault();
    node.classList.remove("over");
    if (event.dataTransfer.files.length) then([...event.dataTransfer.files]);
  });
}

/** Sends a ground motion to the folder of the studies, and says its name there; the readers check it. */
export async function take(node, files, then) {
  node.querySelector(".state.wrong")?.remove();
  const [file] = files;
  const trouble = (text) => node.prepend(wrong("This ground motion cannot be used", text));
  if (files.length > 1) return trouble("Drop one file: it holds one ground motion.");
  if (file.size > LARGEST) return trouble(`${file.name}: ${bytes(file.size)}; a ground motion may have ${bytes(LARGEST)}. Cut it, or sample it more coarsely.`);
  try {
    const batch = `record-${new Date().toISOString().slice(0, 19).replace(/[T:]/g, "-")}`;
    await put(`uploads/${batch}/${encodeURIComponent(file.name)}`, file);
    await then(`uploads/${batch}/${file.name}`);
  } catch (error) {
    trouble(error.message);
  }
}
