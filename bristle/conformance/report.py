"""What a judgement consists of, and its plain form, JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from ..view import Viewable
from ..view.blocks import Table, View, view_of

VERDICTS = {"pass": "pass", "error": "fail", "note": "note"}
"""What a report calls the level of a finding."""
RULES = {
    "standard": "Violations of the standard",
    "bristle": "Violations of bristle's rules for its own FMUs",
    "robustness": "Lack of robustness, where the standard forbids the call or does not define it",
}
"""What a failure breaks, and the heading under which it is repeated at the end."""


@dataclass(frozen=True)
class Row:
    """One probe: what was tried, what was seen, what the standard says, and the verdict.

    `rule` is what a failure would break: the "standard", "robustness" or a rule of "bristle".
    """

    probe: str
    tried: str
    seen: str
    standard: str
    verdict: str
    rule: str


@dataclass(frozen=True, repr=False)
class Report(Viewable):
    """All rows of one FMU, in the order in which they were tried."""

    fmu: str
    rows: Sequence[Row]

    @property
    def ok(self) -> bool:
        """Whether nothing falls short; notes are allowed."""
        return all(row.verdict != "fail" for row in self.rows)

    @property
    def conforms(self) -> bool:
        """Whether no rule of the standard is broken, nor one of bristle's for its own FMUs."""
        return not self.failures("standard", "bristle")

    def failures(self, *rules: str) -> list[Row]:
        """Return the rows that fail, of certain rules or of all."""
        return [r for r in self.rows if r.verdict == "fail" and (not rules or r.rule in rules)]

    def row(self, probe: str) -> Row:
        """Return the row of one probe; KeyError if it was not tried."""
        for row in self.rows:
            if row.probe == probe:
                return row
        raise KeyError(probe)

    def counts(self) -> dict[str, int]:
        """Return how many rows have each verdict."""
        found = Counter(row.verdict for row in self.rows)
        return {verdict: found[verdict] for verdict in VERDICTS.values()}

    def to_json(self) -> str:
        """Return the report as JSON text: schema, fmu, conforms, ok, counts, failures, rows."""
        return json.dumps(
            {
                "schema": 1,
                "fmu": self.fmu,
                "conforms": self.conforms,
                "ok": self.ok,
                "counts": self.counts(),
                "failures": {rule: [row.probe for row in self.failures(rule)] for rule in RULES},
                "rows": [asdict(row) for row in self.rows],
            },
            indent=2,
        )

    def summary(self) -> str:
        """Return in one sentence whether the FMU conforms, with the counts."""
        counts = self.counts()
        verdict = "conforms to the standard" if self.conforms else "does not conform"
        weak = len(self.failures("robustness"))
        robust = f", {weak} of them in robustness" if weak else ""
        return (
            f"{self.fmu} {verdict}: {counts['pass']} passed, {counts['fail']} failed{robust}, "
            f"{counts['note']} noted."
        )


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
