"""The HTML report: one file that opens without a network, images included."""

from __future__ import annotations

import base64
import re
from collections import Counter
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ... import __version__
from .claims import Statement
from .experiment import KAPPA, LAWS
from .numbers import NOT, REPRODUCED, UNDECIDABLE, Verdict
from .page_tables import stroke_html, table_html
from .tables import TABLES, stroke_text

if TYPE_CHECKING:
    from .make import Report

CAPTIONS = {
    "fig5-stiction": "The structure shaken by a sine, damper at constant voltage.",
    "fig9-passive-optimum": "El Centro at four intensities, damper at constant voltage.",
    "fig13-anti-windup": "The strong Northridge case, LPV with three anti-windup rates.",
    "fig14-northridge-strong": "Ground motion, voltages and responses: clipped, H-infinity.",
    "fig15-northridge-strong-lpv": "The same motion: 0 V, LPV with its voltage and parameter.",
    "fig16-northridge-weak": "The weak Northridge case: clipped, LPV with its parameter.",
    "fig17-el-centro": "El Centro at 0.6 g: clipped, LPV with its parameter.",
    "summary": "All cases of Tables IV and V at a glance.",
    "accelerations-el-centro": "Acceleration of floor 2 over time, weak and strong.",
    "drift-el-centro": "Displacement of the base relative to the table.",
    "accelerations-northridge": "Acceleration of floor 2 over time, weak and strong.",
    "voltages": "Voltage and hysteresis loops of the three controllers.",
}
DOTS = 160
"""Dots per inch of the images."""

_CLASSES = {REPRODUCED: "yes", NOT: "no", UNDECIDABLE: "open"}

_STYLE = """
:root { --ink:#1f2328; --grey:#5c636b; --line:#e3e6ea; --pale:#f6f7f9;
        --yes:#00734f; --no:#b04a00; --open:#5b5f66; --blue:#0072B2; }
* { box-sizing: border-box; }
body { margin:0; color:var(--ink); background:#fff; line-height:1.5;
       font:15px/1.5 system-ui, -apple-system, "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
main { max-width:1080px; margin:0 auto; padding:40px 28px 64px; }
h1 { font-size:30px; line-height:1.2; margin:0 0 10px; letter-spacing:-.01em; }
h2 { font-size:20px; margin:48px 0 12px; padding-top:18px; border-top:1px solid var(--line); }
h3 { font-size:16px; margin:26px 0 8px; }
p { margin:0 0 12px; max-width:76ch; }
.lead { font-size:17px; color:var(--grey); }
nav { margin:18px 0 0; font-size:14px; } nav a { margin-right:18px; }
a { color:var(--blue); text-decoration:none; } a:hover { text-decoration:underline; }
.bar { display:flex; height:34px; margin:22px 0 6px; border-radius:5px; overflow:hidden; }
.bar span { color:#fff; font-weight:600; padding:6px 12px; white-space:nowrap; font-size:14px; }
.bar .yes { background:var(--yes); } .bar .no { background:var(--no); }
.bar .open { background:var(--open); }
.note { background:var(--pale); border-left:3px solid var(--blue); padding:10px 14px;
        margin:14px 0; max-width:none; }
.scroll { overflow-x:auto; }
table { border-collapse:collapse; width:100%; font-size:14px; }
th { text-align:left; font-weight:600; color:var(--grey); border-bottom:1px solid #b9bec5;
     padding:6px 8px; vertical-align:bottom; }
td { border-bottom:1px solid var(--line); padding:8px; vertical-align:top; }
.numbers td, .numbers th { text-align:right; padding:4px 8px; white-space:nowrap;
     font-variant-numeric:tabular-nums; }
.numbers td:first-child, .numbers th:first-child { text-align:left; }
.numbers .group td { background:var(--pale); font-weight:600; text-align:left; padding-top:8px; }
.numbers b { color:var(--ink); }
.ledger td:first-child { color:var(--grey); text-align:right; width:2.2em; }
.ledger .what { width:31%; } .ledger small { color:var(--grey); display:block; margin-top:3px; }
.badge { display:inline-block; padding:1px 9px; border-radius:10px; color:#fff; font-size:12.5px;
         font-weight:600; white-space:nowrap; }
.badge.yes { background:var(--yes); } .badge.no { background:var(--no); }
.badge.open { background:var(--open); }
figure { margin:30px 0; } figure img { width:100%; height:auto; border:1px solid var(--line);
         border-radius:4px; display:block; }
figcaption { color:var(--grey); font-size:14px; margin-top:8px; }
code { background:var(--pale); padding:1px 5px; border-radius:3px; font-size:13.5px; }
footer { margin-top:48px; border-top:1px solid var(--line); padding-top:14px; color:var(--grey);
         font-size:13.5px; }
@media print { main { max-width:none; padding:0; } figure, tr { break-inside:avoid; }
               nav { display:none; } }
"""


def page(report: Report) -> str:
    """Return the report as HTML text that needs no other file."""
    count = Counter(verdict.verdict for _, verdict in report.ledger)
    parts = [
        _head(report, count),
        _setting(report),
        _claims_table(report.ledger),
        *(table_html(name, table) for name, table in report.tables.items()),
        stroke_html(report.comparison),
        _figures(report),
        _designs(report),
        _foot(report),
    ]
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        "<title>The paper's comparison of controllers, repeated</title>\n"
        f"<style>{_STYLE}</style>\n</head>\n<body>\n<main>\n{''.join(parts)}</main>\n</body>\n"
        "</html>\n"
    )


def _head(report: Report, count: Counter[str]) -> str:
    total = sum(count.values())
    bar = "".join(
        f'<span class="{name}" style="flex:{count[verdict]}">{count[verdict]} {verdict}</span>'
        for verdict, name in _CLASSES.items()
        if count[verdict]
    )
    tables = "".join(
        f'<a href="#{name}">{escape(TABLES[name][1].partition(":")[0])}</a>'
        for name in report.tables
    )
    stroke = '<a href="#stroke">Stroke</a>' if stroke_text(report.comparison) else ""
    return f"""<header>
<h1>Semi-active control of a base-isolated structure: the paper's comparison, repeated</h1>
<p class="lead">Of {total} statements in the text of Shirazi, Mohammadpour, Grigoriadis and Song
(2012), {count[REPRODUCED]} are reproduced, {count[NOT]} are not, and {count[UNDECIDABLE]} cannot be
decided from the text.</p>
<div class="bar" role="img" aria-label="verdicts">{bar}</div>
<nav><a href="#ledger">Statements</a>{tables}{stroke}<a href="#figures">Figures</a>
<a href="#designs">Designs</a></nav>
</header>
"""


def _setting(report: Report) -> str:
    rows = "".join(
        f"<tr><td>{escape(m.name)}</td><td>{', '.join(f'{g:g}' for g in m.intensities)} g</td>"
        f"<td>{m.window:g} s</td><td>{m.paper_window:g} s</td></tr>"
        for m in report.comparison.motions
    )
    left_out = report.comparison.left_out
    note = f'<p class="note">Left out. {escape(left_out)}</p>' if left_out else ""
    laws = ", ".join(LAWS)
    return f"""<section>
<h2>What was run</h2>
<p>A two-storey model on a sliding base with springs, an MR damper with stiction (LuGre law) between
base and table, and {len(LAWS)} laws for its voltage: {escape(laws)}. Controllers sample at 500 Hz;
structure, damper and controller are solved as one system. "LPV" has the anti-windup rate
λ = 200 1/s.</p>
<p class="note"><b>What is not the paper's own.</b> Its tables and matrices are not available:
damper parameters, weights of the designs, and the factor {KAPPA:g} on the nominal peak of every
ground motion are reconstructed so that they agree with the text as far as possible. Orders and
shapes can be compared; values cannot.</p>
<table><thead><tr><th>Ground motion</th><th>Nominal peaks</th><th>RMS over the record of</th>
<th>The paper runs</th></tr></thead><tbody>{rows}</tbody></table>
{note}
</section>
"""


def _claims_table(claims: list[tuple[Statement, Verdict]]) -> str:
    rows = "".join(
        f"<tr><td>{s.number}</td>"
        f'<td class="what">{_text(s.text)}<small>Section {escape(s.section)}</small></td>'
        f'<td><span class="badge {_CLASSES[v.verdict]}">{v.verdict}</span></td>'
        f"<td>{_text(v.measured)}{_small(v.why)}<small><b>Decided by:</b> {_text(s.rule, False)}."
        "</small></td></tr>\n"
        for s, v in claims
    )
    return f"""<section>
<h2 id="ledger">The statements of the text</h2>
<p>Each statement of the text, rephrased, with the number found here. Verdicts are computed
from the tables below; "peak y" is the peak absolute acceleration of floor 2. Lists run from the
weakest to the strongest intensity.</p>
<div class="scroll"><table class="ledger"><thead><tr><th></th><th>Statement</th><th>Verdict</th>
<th>Found</th></tr></thead><tbody>
{rows}</tbody></table></div>
</section>
"""


def _small(text: str) -> str:
    return f"<small>{_text(text)}</small>" if text else ""


def _text(text: str, sentence: bool = True) -> str:
    """Return a text as HTML: numbers stay with their units, a sentence begins with a capital."""
    if sentence:
        text = text[:1].upper() + text[1:]
    kept = re.sub(r"(?<=\d) (?=[%VNgs]\b|%|m/s|N/m|1/m|cm|Hz)", "\u00a0", text)
    return escape(kept.replace("H-infinity", "H\u2011infinity"))


def _figures(report: Report) -> str:
    figures = "".join(
        f'<figure style="max-width:{_width(report, name)}px">'
        f'<img alt="{escape(number or CAPTIONS[name])}" src="{_embedded(report, name)}">'
        f"<figcaption>{f'<b>{escape(number)}.</b> ' if number else ''}{escape(CAPTIONS[name])}"
        "</figcaption></figure>\n"
        for name, number in sorted(report.figures.items(), key=lambda item: item[0] != "summary")
    )
    return f"""<section>
<h2 id="figures">Figures</h2>
<p>Figure numbers are the paper's. Its text says what each figure shows; the arrangement is this
project's. Figures without a number are this project's own.</p>
{figures}</section>
"""


def _width(report: Report, name: str) -> int:
    """Return the width of an image on the page [px]: letters have one size in all of them."""
    pixels = int.from_bytes(Path(report.folder, f"{name}.png").read_bytes()[16:20], "big")
    return round(pixels / DOTS * 104)


def _embedded(report: Report, name: str) -> str:
    image = Path(report.folder, f"{name}.png").read_bytes()
    return "data:image/png;base64," + base64.b64encode(image).decode("ascii")


def _designs(report: Report) -> str:
    rows = []
    for kind, words in (("hinf", "H-infinity"), ("lpv", "LPV, X and Y constant")):
        f = report.numbers.facts["designs"][kind]
        norm = f["norm"] if "norm" in f else max(f["norms"])
        slowest = f.get("largest_real_part")
        if slowest is None:
            slowest = max(real for real, _ in f["poles"])
        rows.append(
            f"<tr><td>{words}</td><td>{f['gamma']:.4f}</td><td>{norm:.4f}</td>"
            f"<td>{slowest:.3g}</td><td>{f['sampled_loop_modulus']:.6f}</td></tr>"
        )
    return f"""<section>
<h2 id="designs">The designs</h2>
<p>Made for this report, verified after the solver, and written to the same folder:
<code>hinf.json</code> is for the clipped-optimal law and the inverses, <code>lpv.json</code> for
the LPV law.</p>
<div class="scroll"><table class="numbers"><thead><tr><th>Design</th><th>gamma</th>
<th>closed-loop norm, recomputed</th><th>largest real part of its poles [1/s]</th>
<th>largest pole of the sampled loop</th></tr></thead><tbody>{"".join(rows)}</tbody></table></div>
</section>
"""


def _foot(report: Report) -> str:
    given = any("Newhall" in m.name for m in report.comparison.motions)
    command = "bristle controllers" + (" --newhall FILE.AT2" if given else "")
    return f"""<footer>
<p>bristle {__version__}; <code>{command}</code>; {len(report.comparison.table)} runs of the
comparison and those behind Figs 5 and 9 in {report.seconds:.0f} s, designs included. Every number
is in the CSV files of this folder.</p>
<p>F. A. Shirazi, J. Mohammadpour, K. M. Grigoriadis, G. Song: Identification and Control of an MR
Damper With Stiction Effect and its Application in Structural Vibration Mitigation. IEEE
Transactions on Control Systems Technology 20(5), 2012.</p>
</footer>
"""
