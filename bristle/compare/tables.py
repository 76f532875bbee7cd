"""The tables of a comparison, as text in cells: for the terminal and for the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..data.labels import Label, label_text, varying
from ..physics.drive import DRIVES
from ..quantity import percent, plain, scale, short_z
from .labels import known_of
from .names import name_of, site_name
from .sentences import FAINT, begin

if TYPE_CHECKING:
    from .comparison import Comparison
    from .errors import RunError, SiteError
    from .patterns import ResidualPattern

Table = tuple[str, list[str], list[list[str]]]

EXCESS = "of what exceeds noise"
"""The column that a table has where the noise is known."""
_SHOWN = 6  # coordinates in a table


def comparison_tables(comparison: Comparison) -> list[Table]:
    """Return (title, header, rows) of the error per site, run, coordinate and frequency.

    There are sites of a building only.
    """
    sites = [site_table(comparison)] if comparison.sites else []
    labels = [label_table(comparison)] if comparison.labels else []
    rest = [pattern_table(comparison), band_table(comparison)]
    return [*sites, run_table(comparison), *labels, *rest]


def site_table(comparison: Comparison) -> Table:
    """Return the error at each site of a building, the worst first."""
    known = [one.total.signal for one in comparison.sites if one.total.samples]
    factor, unit = scale("N", max(known, default=0.0))
    header = ["site", "z", "95 %", f"error [{unit}]", "of RMS", f"noise [{unit}]", "depends on"]
    title = "Error at every site, each over its own noise (z); RMS at all frequencies"
    return title, header, [_site(one, factor) for one in comparison.sites]


def _site(one: SiteError, factor: float) -> list[str]:
    name = site_name(one.site).removeprefix("the ")
    if not one.total.samples:
        return [name, "-", one.why_not, "-", "-", "-", "-"]
    (low, high), total, pattern = one.z_interval, one.total, one.pattern
    worth = pattern is not None and pattern.share >= FAINT
    return [
        name, short_z(one.z), one.why_not or f"{short_z(low)} - {short_z(high)}",
        plain(factor * total.rms, 4), percent(total.share),
        "-" if one.why_not else plain(factor * total.noise),
        name_of(pattern.coordinate, one.site) if pattern is not None and worth else "-",
    ]  # fmt: skip


def run_table(comparison: Comparison) -> Table:
    """Return the error on each run and over all, with the numerical error beside it."""
    factor, unit = scale(comparison.unit, comparison.total.signal)
    known = known_of(comparison.predictions)
    names = varying(known)
    header = ["run", "z", f"error [{unit}]", "of RMS", "fit", "VAF"]
    header += [f"noise [{unit}]", "half step [z]", *names]
    own = [[_label(name, one[name]) for name in names] for one in known]
    rows = [[*_run(run, factor), *labels] for run, labels in zip(comparison.runs, own, strict=True)]
    if len(rows) > 1:
        rows.append([*_run(comparison.total, factor), *["" for _ in names]])
    title = "Error / noise (z), RMS at all frequencies, and the sensitivity to halving the step"
    if comparison.sites:
        title = f"{begin(site_name(comparison.site))}: {title[:1].lower()}{title[1:]}"
    return title, header, rows


def _label(name: str, value: Label) -> str:
    return label_text(name, value, DRIVES[name].unit if name in DRIVES else "")


def label_table(comparison: Comparison) -> Table:
    """Return the error by what is known of whole runs: one row per value of a label."""
    rows = [
        [name_of(one.name), one.text, short_z(one.z), str(one.runs)] for one in comparison.labels
    ]
    return "Error by what is known of whole runs", ["label", "value", "z", "runs"], rows


def _run(run: RunError, factor: float) -> list[str]:
    numerical = plain(run.numerical_z, 2) if run.numerical_z == run.numerical_z else "not tried"
    if run.z != run.z:
        numerical = short_z(None)
    return [
        run.name, short_z(run.z), plain(factor * run.rms, 4), percent(run.share), percent(run.fit),
        percent(run.accounted), plain(factor * run.noise), numerical,
    ]  # fmt: skip


def pattern_table(comparison: Comparison) -> Table:
    """Return the coordinates by how much of the error's power each carries."""
    header = ["coordinate", "of the error", EXCESS, "chance"]
    rows = [_pattern(one, comparison.site) for one in comparison.patterns[:_SHOWN]]
    title = "Where the error occurs: the share of its power along each coordinate"
    return title, *_as_known(comparison, header, rows)


def _pattern(pattern: ResidualPattern, site: str) -> list[str]:
    name = name_of(pattern.coordinate, site)
    name += ", with the direction of motion" if pattern.turned else ""
    excess = percent(pattern.of_excess, 0) if pattern.of_excess == pattern.of_excess else "-"
    chance = plain(pattern.p, 1) if pattern.p >= 0.001 else "< 0.001"
    return [name, percent(pattern.share), excess, chance]


def band_table(comparison: Comparison) -> Table:
    """Return the error in octaves against the noise in each."""
    factor, unit = scale(comparison.unit, comparison.total.signal)
    header = ["band [Hz]", "z", f"error [{unit}]", EXCESS, "coherence"]
    rows = [
        [
            f"{plain(band.low)} - {plain(band.high)}", short_z(band.z), plain(factor * band.rms, 2),
            percent(band.share, 0), f"{band.coherence:.2f}",
        ]
        for band in comparison.spectrum.bands
    ]  # fmt: skip
    title = "In frequency; coherence of the error with the prediction"
    return title, *_as_known(comparison, header, rows)


def _as_known(
    comparison: Comparison, header: list[str], rows: list[list[str]]
) -> tuple[list[str], list[list[str]]]:
    """Return a table without what only a known noise tells."""
    if comparison.noise_known:
        return header, rows
    kept = [k for k, name in enumerate(header) if name not in ("z", EXCESS)]
    return [header[k] for k in kept], [[row[k] for k in kept] for row in rows]
