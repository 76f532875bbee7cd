"""The HTML report: one file that opens without a network, images included."""

from __future__ import annotations

import re
from collections import Counter
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from bristle.version import __version__
from bristle.view import html

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

_KINDS = {REPRODUCED: "good", NOT: "bad", UNDECIDABLE: "open"}


def page(report: Report) -> str:
    """Return the report as HTML text that needs no other file."""
    count = Counter(verdict.verdict for _, verdict in report.ledger)
    body = [
        _head(report, count),
        _setting(report),
        _claims_table(report.ledger),
        *(table_html(name, table) for name, table in report.tables.items()),
        stroke_html(report.comparison),
        _figures(report),
        _designs(report),
    ]
    return html.page(
        "The paper's comparison of controllers, repeated", [part for part in body if part],
        _foot(report),
    )  # fmt: skip


def _head(report: Report, count: Counter[str]) -> str:
    total = sum(count.values())
    links = {"ledger": "Statements"}
    links |= {name: TABLES[name][1].partition(":")[0] for name in report.tables}
    if stroke_text(report.comparison):
        links["stroke"] = "Stroke"
    links |= {"figures": "Figures", "designs": "Designs"}
    return "\n".join([
        "<h1>Semi-active control of a base-isolated structure: the paper's comparison, "
        "repeated</h1>",
        html.paragraphs(
            f"Of {total} statements in the text of Shirazi, Mohammadpour, Grigoriadis and Song "
            f"(2012), {count[REPRODUCED]} are reproduced, {count[NOT]} are not, and "
            f"{count[UNDECIDABLE]} cannot be decided from the text.", kind="lead",
        ),
        html.tiles((str(count[verdict]), verdict) for verdict in _KINDS),
        "<nav>"
        + "".join(f'<a href="#{name}">{escape(text)}</a>' for name, text in links.items())
        + "</nav>",
    ])  # fmt: skip


def _setting(report: Report) -> str:
    rows = [
        [
            m.name, f"{', '.join(f'{g:g}' for g in m.intensities)} g", f"{m.window:g} s",
            f"{m.paper_window:g} s",
        ]
        for m in report.comparison.motions
    ]  # fmt: skip
    left_out = report.comparison.left_out
    return html.section(
        "What was run",
        html.paragraphs(
            "A two-storey model on a sliding base with springs, an MR damper with stiction (LuGre "
            f"law) between base and table, and {len(LAWS)} laws for its voltage: "
            f"{', '.join(LAWS)}. Controllers sample at 500 Hz. Structure, damper and controller "
            'are solved as one system. "LPV" has the anti-windup rate λ = 200 1/s.'
        ),
        html.paragraphs(
            "Not the paper's own: its tables and matrices are not available. Damper parameters, "
            f"weights of the designs, and the factor {KAPPA:g} on the nominal peak of every ground "
            "motion are reconstructed so that they agree with the text as far as possible. Orders "
            "and shapes can be compared; values cannot.",
            f"Left out. {left_out}" if left_out else "", kind="notes",
        ),
        html.table(
            ["Ground motion", "Nominal peaks", "RMS over the record of", "The paper runs"], rows
        ),
    )  # fmt: skip


def _claims_table(claims: list[tuple[Statement, Verdict]]) -> str:
    rows = [
        [
            f"{s.number}. {_text(s.text)} (Section {s.section})", v.verdict,
            _found(v), f"{_text(s.rule, False)}.",
        ]
        for s, v in claims
    ]  # fmt: skip
    kinds = {(k, 1): _KINDS[verdict.verdict] for k, (_, verdict) in enumerate(claims)}
    return html.section(
        "The statements of the text",
        html.paragraphs(
            "Each statement of the text, rephrased, with the number found here. Verdicts are "
            'computed from the tables below; "peak y" is the peak absolute acceleration of floor '
            "2. Lists run from the weakest to the strongest intensity."
        ),
        html.table(["Statement", "Verdict", "Found", "Decided by"], rows, kinds=kinds),
        name="ledger",
    )


def _found(verdict: Verdict) -> str:
    """Return what was measured, and what there is to say of it."""
    measured, why = _text(verdict.measured), _text(verdict.why)
    return f"{measured.rstrip('.')}. {why}" if why else measured


def _text(text: str, sentence: bool = True) -> str:
    """Return a text: numbers stay with their units, a sentence begins with a capital."""
    if sentence:
        text = text[:1].upper() + text[1:]
    kept = re.sub(r"(?<=\d) (?=[%VNgs]\b|%|m/s|N/m|1/m|cm|Hz)", "\u00a0", text)
    return kept.replace("H-infinity", "H\u2011infinity")


def _figures(report: Report) -> str:
    figures = [
        html.figure(
            Path(report.folder, f"{name}.png").read_bytes(), number or CAPTIONS[name],
            f"{number}. {CAPTIONS[name]}" if number else CAPTIONS[name],
        )
        for name, number in sorted(report.figures.items(), key=lambda item: item[0] != "summary")
    ]  # fmt: skip
    return html.section(
        "Figures",
        html.paragraphs(
            "Figure numbers are the paper's. Its text says what each figure shows; the arrangement "
            "is this project's. Figures without a number are this project's own."
        ),
        *figures,
        name="figures",
    )


def _designs(report: Report) -> str:
    rows = []
    for kind, words in (("hinf", "H-infinity"), ("lpv", "LPV, X and Y constant")):
        f = report.numbers.facts["designs"][kind]
        norm = f["norm"] if "norm" in f else max(f["norms"])
        slowest = f.get("largest_real_part")
        if slowest is None:
            slowest = max(real for real, _ in f["poles"])
        rows.append([
            words, f"{f['gamma']:.4f}", f"{norm:.4f}", f"{slowest:.3g}",
            f"{f['sampled_loop_modulus']:.6f}",
        ])  # fmt: skip
    header = [
        "Design", "gamma", "closed-loop norm, recomputed",
        "largest real part of its poles [1/s]", "largest pole of the sampled loop",
    ]  # fmt: skip
    return html.section(
        "The designs",
        html.paragraphs(
            "Made for this report, verified after the solver, and written to the same folder: "
            "hinf.json is for the clipped-optimal law and the inverses, lpv.json for the LPV law."
        ),
        html.table(header, rows, range(1, 5)),
        name="designs",
    )


def _foot(report: Report) -> str:
    given = any("Newhall" in m.name for m in report.comparison.motions)
    command = "python -m benchmarks paper controllers" + (" --newhall FILE.AT2" if given else "")
    seconds = f"{report.seconds:.0f} s"
    return f"""<p>bristle {__version__}; <code>{command}</code>; {len(report.comparison.table)} runs
of the comparison and those behind Figs 5 and 9 in {seconds}, designs included. Every number is in
the CSV files of this folder.</p>
<p>F. A. Shirazi, J. Mohammadpour, K. M. Grigoriadis, G. Song: Identification and Control of an MR
Damper With Stiction Effect and its Application in Structural Vibration Mitigation. IEEE
Transactions on Control Systems Technology 20(5), 2012.</p>"""
