"""The linked pictures of the page as a section of a report: one file, no server, no network."""

from __future__ import annotations

import base64
import re
from pathlib import Path

from ..comparison.result import Comparison
from ..view import html
from ..view.html import pack
from .study_views import linked

STATIC = Path(__file__).with_name("static")
MODULES = ("dom.mjs", "scale.mjs", "plot.mjs", "brush.mjs", "cells.mjs", "linked.mjs")
"""What draws the pictures, in the order in which they take from each other."""
MOST = 60_000
"""Samples of all runs in a report: some 3 MB."""

_SCRIPT = """
{
  const text = atob(document.getElementById("linked-data").textContent);
  const packed = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const length = new DataView(packed.buffer).getUint32(0, true);
  const floats = new Float32Array(packed.buffer, 4 + length);
  const whole = (_, value) =>
    value?.array ? floats.subarray(value.array[0], value.array[0] + value.array[1]) : value;
  const head = new TextDecoder().decode(packed.subarray(4, 4 + length));
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const theme = () => {
    document.documentElement.dataset.theme = dark.matches ? "dark" : "light";
    newColours();
    redraw();
  };
  document.querySelector(".linked").hidden = false;
  dark.addEventListener("change", theme);
  theme();
  document.getElementById("linked").append(new Linked(JSON.parse(head, whole)).nodes());
}
"""
_STYLE = """
.linked canvas { width: 100%; display: block; height: 15rem; touch-action: pan-y; }
.linked canvas.middle { height: 11rem; } .linked canvas.high { height: 20rem; }
.linked canvas.brush { cursor: crosshair; }
.linked .grid { display: grid; gap: 1.4rem 1.8rem;
  grid-template-columns: repeat(auto-fit, minmax(min(22rem, 100%), 1fr)); }
.linked .grid > * { min-width: 0; }
.linked .act { display: flex; flex-wrap: wrap; align-items: end; gap: .7rem 1rem; margin: 1rem 0; }
.linked .field { display: grid; gap: .15rem; font-size: .88rem; color: var(--soft); }
.linked select, .linked button { font: inherit; font-size: .92rem; color: var(--ink);
  background: var(--paper); border: 1px solid var(--line); border-radius: 4px;
  padding: .3rem .6rem; }
.linked .key { display: flex; flex-wrap: wrap; gap: .2rem 1.1rem; font-size: .88rem;
  color: var(--soft); margin: .3rem 0 0; padding: 0; list-style: none; max-width: none; }
.linked .key i { display: inline-block; width: 1.2rem; height: .22rem; vertical-align: middle;
  margin-right: .4rem; background: currentColor; }
.linked .key i.box { height: .8rem; width: .8rem; }
.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
@media print { .linked { display: none; } }
"""


def linked_section(found: Comparison, most: int = MOST) -> str:
    """Return the section of a report whose pictures a reader can choose samples in.

    On paper it is left out.

    Parameters
    ----------
    found : what is compared
    most : samples of all runs at the most; of more every second, third ... is shown
    """
    data = base64.b64encode(pack(linked(found, most))).decode("ascii")
    runs = "test runs" if found.role == "test" else "held-out runs"
    text = (
        f"All samples of the {runs}. Choose a stretch of time, a part of a loop or a part of the "
        "map, with the pointer or the arrow keys: the other pictures show the same samples."
    )
    return "\n".join([
        '<section class="linked" hidden>',  # until the script runs: some readers let none run
        "<h2>Look closer</h2>",
        html.paragraphs(text),
        f"<style>{_STYLE}</style>",
        '<div id="linked"></div>',
        '<p id="said" class="unseen" role="status"></p>',
        f'<script type="text/plain" id="linked-data">{data}</script>',
        f'<script type="module">\n{script()}\n</script>',
        "</section>",
    ])  # fmt: skip


def script() -> str:
    """Return the modules of the pictures as one script, and what begins them."""
    parts = [(STATIC / name).read_text(encoding="utf-8") for name in MODULES]
    joined = "\n".join([*parts, _SCRIPT])
    joined = re.sub(r"^(import |export \{).*\n", "", joined, flags=re.MULTILINE)
    return re.sub(r"^export ", "", joined, flags=re.MULTILINE)
