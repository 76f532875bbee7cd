"""The HTML report: one file that opens without a network, images included."""

from __future__ import annotations

import re
from collections import Counter
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bristle.version import __version__
from bristle.view import html

from .claims import NOT, REPRODUCED, UNDECIDABLE, Statement, Verdict
from .experiment import BEYOND, CONTROLLERS, KAPPA, LAWS, NONE, QUANTITIES, Comparison

if TYPE_CHECKING:
    import pandas as pd

    from .make import Report

CAPTIONS = {
    "fig5-stiction": "Base acceleration, ground shaken by a sine of 1.5 m/s² and 1.5 Hz: Bingham "
    "beside LuGre, constant voltages.",
    "fig9-passive-optimum": "Peak acceleration of floor 2 over constant voltage: El Centro, "
    "nominal 0.2, 0.4, 0.6 and 0.8 g.",
    "fig13-anti-windup": "{strong}: LPV with anti-windup rates of 0, 200 and 400 1/s; command, "
    "voltage and acceleration of floor 2.",
    "fig14-northridge-strong": "{strong}: clipped beside H-infinity; ground motion, voltage, "
    "acceleration of floor 2 and base drift.",
    "fig15-northridge-strong-lpv": "{strong}: 0 V beside LPV; acceleration of floor 2, base "
    "drift, voltage and parameter of LPV.",
    "fig16-northridge-weak": "{weak}: clipped beside LPV; voltage, acceleration of floor 2, base "
    "drift, parameter of LPV.",
    "fig17-el-centro": "El Centro, nominal 0.6 g: clipped beside LPV; voltage, acceleration of "
    "floor 2, base drift, parameter of LPV.",
    "summary": "Peak and RMS acceleration of floor 2 in all cases of Tables IV and V, per cent of "
    "those at 0 V: 4 V beside the three controllers.",
}
"""Motion, scale and what is compared of each figure; all motions are at 0.45 of the nominal."""
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
    motion = report.comparison.strong[0]
    listed = next(m for m in report.comparison.motions if m.name == motion).intensities
    strong, weak = (f"{motion}, nominal {g:g} g" for g in (max(listed), min(listed)))
    said = {n: c.format(strong=strong, weak=weak) for n, c in CAPTIONS.items()}
    figures = [
        html.figure(
            Path(report.folder, f"{name}.png").read_bytes(), number or said[name],
            f"{number}. {said[name]}" if number else said[name],
        )
        for name, number in sorted(report.figures.items(), key=lambda item: item[0] != "summary")
    ]  # fmt: skip
    return html.section(
        "Figures",
        html.paragraphs(
            "Figure numbers are the paper's. Its text says what each figure shows; the arrangement "
            "is this project's. Figures without a number are this project's own. Every ground "
            "motion is at 0.45 of its nominal peak, a factor that is reconstructed."
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


# Tables IV and V and the runs beyond the stroke, as HTML.


def table_html(name: str, table: pd.DataFrame) -> str:
    """Return Table IV or V, the lowest of the controllers bold, drifts beyond the stroke marked.

    Parameters
    ----------
    name : "table4" or "table5"
    table : as `tables.published_table` returns it
    """
    kind, title = TABLES[name]
    listed = columns(kind)
    header = ["Law", *(heading.replace("2]", "²]") for heading, _ in listed)]
    marked = f" {MARK}: beyond the damper's stroke." if kind == "peak" else ""
    window = "" if kind == "peak" else " RMS values are over the record as published."
    parts = [html.paragraphs(f"Bold: the lowest of the three controllers.{marked}{window}")]
    groups: Any = table.groupby(["motion", "intensity [g]"], sort=False)
    for (motion, g), group in groups:
        own = group.set_index("law")
        rows: list[list[str]] = []
        bold: dict[tuple[int, int], str] = {}
        for k, law in enumerate(own.index.astype(str)):
            rows.append([law, *(_cell(own, law, column) for _, column in listed)])
            lowest = [_is_lowest(own, law, column) for _, column in listed]
            bold |= {(k, 1 + i): "strong" for i, one in enumerate(lowest) if one}
        parts.append(f"<h3>{html.escape(motion)}, nominal {g:g} g</h3>")
        parts.append(html.table(header, rows, range(1, len(header)), kinds=bold))
    return html.section(title, *parts, name=name)


def _cell(own: Any, law: str, column: str) -> str:
    if law == NONE and ("force" in column or "voltage" in column):
        return "-"
    beyond = "base drift" in column and BEYOND in own and float(own.loc[law, BEYOND]) > 0.0
    return shown(float(own.loc[law, column]), column) + (MARK if beyond else "")


def _is_lowest(own: Any, law: str, column: str) -> bool:
    """Return whether a controller has the lowest value, as the numbers are shown."""
    value = {one: float(shown(float(own.loc[one, column]), column)) for one in CONTROLLERS}
    return law in value and all(value[law] < value[one] for one in value if one != law)


def stroke_html(comparison: Comparison) -> str:
    """Return a section on the runs that leave the damper's stroke; "" if there are none."""
    text = stroke_text(comparison)
    if not text:
        return ""
    return html.section(
        "Runs beyond the damper's stroke", html.paragraphs(text),
        html.items(stroke_lines(comparison)), name="stroke",
    )  # fmt: skip


# Tables IV and V of the comparison, and the runs in which the base leaves the damper's stroke.

TABLES = {
    "table4": ("peak", "Table IV: peaks of all motions"),
    "table5": ("rms", "Table V: RMS of all motions"),
}
"""File name to what is tabled of each quantity, and the title."""

DIGITS = {
    "peak": {"base drift": 1, "voltage": 1},
    "rms": {"damper force": 2, "voltage": 2, "base drift": 2},
}
_USUAL = {"peak": 2, "rms": 3}
MARK = "†"
"""Behind a drift that is larger than the damper's stroke."""


def published_table(comparison: Comparison, kind: str) -> pd.DataFrame:
    """Return Table IV or V of the comparison: a row per motion, intensity and law.

    Parameters
    ----------
    comparison : Comparison
    kind : {"peak", "rms"}
        "peak" gives Table IV, with a column `BEYOND`; "rms" gives Table V, over the record as
        published.

    Returns
    -------
    DataFrame
        Columns "motion", "intensity [g]", "law" and one per quantity, named as in
        `Comparison.table`.
    """
    part = comparison.table[comparison.table["law"].isin(LAWS)].copy()
    order = {law: i for i, law in enumerate(LAWS)}
    places = {motion.name: i for i, motion in enumerate(comparison.motions)}
    part["_place"], part["_law"] = part["motion"].map(places), part["law"].map(order)
    part = part.sort_values(["_place", "intensity [g]", "_law"])
    keep = [column for _, column in columns(kind)] + [BEYOND] * (kind == "peak")
    return part[["motion", "intensity [g]", "law", *keep]].reset_index(drop=True)


def columns(kind: str) -> list[tuple[str, str]]:
    """Return heading and column of each quantity of a table, kind "peak" or "rms"."""
    return [
        (f"{quantity} [{unit}]", f"{kind} {quantity} [{unit}]")
        for quantity, (_, unit, _) in QUANTITIES.items()
    ]


def shown(value: float, column: str) -> str:
    """Return a number of a table as text, with the digits that its column has.

    Parameters
    ----------
    value : in the unit of the column
    column : name of the column, such as "peak base drift [mm]"
    """
    kind, _, rest = column.partition(" ")
    digits = DIGITS[kind].get(rest.partition(" [")[0], _USUAL[kind])
    return f"{value:.{digits}f}"


def beyond_stroke(comparison: Comparison) -> pd.DataFrame:
    """Return the rows of all runs in which the base drifts beyond the damper's stroke."""
    return comparison.table[comparison.table[BEYOND] > 0.0]


def stroke_text(comparison: Comparison) -> str:
    """Return in one sentence how many runs leave the stroke, and what that means; "" if none."""
    rows = beyond_stroke(comparison)
    if rows.empty:
        return ""
    with_damper = int((comparison.table["law"] != NONE).sum())
    drift = rows["peak base drift [mm]"]
    stroke = float((drift - rows[BEYOND]).iloc[0])
    return (
        f"In {len(rows)} of {with_damper} runs with a damper the base drifts beyond the damper's "
        f"stroke of {stroke:.0f} mm, by up to {rows[BEYOND].max():.0f} mm. The model has no end "
        "stop there: a real damper of this stroke would hit its end, so these rows hold for a "
        "longer one."
    )


def stroke_lines(comparison: Comparison) -> list[str]:
    """Return a line per motion and intensity: the laws that leave the stroke, with the drift."""
    groups: dict[tuple[str, float], list[str]] = {}
    rows = beyond_stroke(comparison)[["motion", "intensity [g]", "law", "peak base drift [mm]"]]
    for motion, g, law, drift in rows.itertuples(index=False, name=None):
        groups.setdefault((motion, g), []).append(f"{law} {drift:.1f} mm")
    places = [motion.name for motion in comparison.motions]
    ordered = sorted(groups, key=lambda case: (places.index(case[0]), case[1]))
    return [f"{motion} {g:g} g: {'; '.join(groups[motion, g])}" for motion, g in ordered]
