// Talks to the server: the token, JSON, and answers with many numbers.

const KEY = "bristle-token";

/** The token stands in the address behind #, and is kept for this address alone (port included). */
function tokenOf() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) {
    localStorage.setItem(KEY, given);
    history.replaceState(null, "", `${location.pathname}#/`);
  }
  return localStorage.getItem(KEY) ?? "";
}

const token = tokenOf();

/** What the server says is wrong: a sentence, and `kind`, `file`, `text` where it tells them. */
export class ServerError extends Error {
  /** @param {number} status @param {{error: string, kind?: string, file?: string, text?: string}} told */
  constructor(status, told) {
    super(told.error);
    this.status = status;
    this.told = told;
  }
}

/**
 * @param {string} method
 * @param {string} path
 * @param {BodyInit=} body
 * @returns {Promise<Response>}
 */
async function ask(method, path, body) {
  let answer;
  try {
    answer = await fetch(`/api/${path}`, {
      method,
      body,
      headers: { Authorization: `Bearer ${token}` },
    });
  } catch {
    throw new ServerError(0, {
      error: "The page's server does not answer. Start it again: bristle page",
      kind: "gone",
    });
  }
  if (answer.ok) return answer;
  let told = { error: `The server answered ${answer.status}.` };
  try {
    told = await answer.json();
  } catch {
    // the status is all there is
  }
  throw new ServerError(answer.status, told);
}

/** @param {string} path @returns {Promise<any>} */
export const get = async (path) => (await ask("GET", path)).json();

/** @param {string} path @param {object} content @returns {Promise<any>} */
export const post = async (path, content) =>
  (await ask("POST", path, JSON.stringify(content))).json();

/** @param {string} path @param {File} file @returns {Promise<any>} */
export const put = async (path, file) => (await ask("PUT", path, file)).json();

/** Returns an answer with arrays as Float32Array: see page_data.py. */
export const packed = async (path) => unpack(await (await ask("GET", path)).arrayBuffer());

/** @param {string} path @param {object} content @returns {Promise<any>} */
export const postPacked = async (path, content) =>
  unpack(await (await ask("POST", path, JSON.stringify(content))).arrayBuffer());

/** @param {ArrayBuffer} data @returns {any} */
export function unpack(data) {
  const length = new DataView(data).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(data, 4, length));
  return JSON.parse(text, (_, value) =>
    value !== null && typeof value === "object" && Array.isArray(value.array)
      ? new Float32Array(data, 4 + length + 4 * value.array[0], value.array[1])
      : value,
  );
}

/** Saves a file of a study, as a click on a link would. */
export async function download(study, name) {
  const path = `studies/${encodeURIComponent(study)}/file?name=${encodeURIComponent(name)}`;
  const content = await (await ask("GET", path)).blob();
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name.split("/").pop();
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
