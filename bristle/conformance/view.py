"""The judgement of an FMU: whether it conforms, what falls short, then every probe."""

from __future__ import annotations

from ..view.blocks import Table, View, view_of
from .report import RULES, Report


@view_of(Report)
def report_view(report: Report) -> View:
    """Return the view of a judgement."""
    tables = [
        Table(("probe", "seen"), [[row.probe, row.seen] for row in rows], (), heading)
        for rule, heading in RULES.items()
        if (rows := report.failures(rule))
    ]
    header = ("probe", "verdict", "tried", "seen", "standard")
    cells = [[row.probe, row.verdict, row.tried, row.seen, row.standard] for row in report.rows]
    return View(report.summary(), tuple(tables), (Table(header, cells, (), "Every probe"),))
