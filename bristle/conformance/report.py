"""What a judgement consists of, and its two plain forms: JSON and text."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass

VERDICTS = ("pass", "fail", "note")


@dataclass(frozen=True)
class Row:
    """One probe: what was tried, what was seen, what the standard says, and the verdict."""

    probe: str
    tried: str
    seen: str
    standard: str
    verdict: str


@dataclass(frozen=True)
class Report:
    """All rows of one FMU, in the order in which they were tried."""

    fmu: str
    rows: Sequence[Row]

    @property
    def ok(self) -> bool:
        """Whether nothing falls short; notes are allowed."""
        return all(row.verdict != "fail" for row in self.rows)

    def row(self, probe: str) -> Row:
        """Return the row of one probe; KeyError if it was not tried."""
        for row in self.rows:
            if row.probe == probe:
                return row
        raise KeyError(probe)

    def counts(self) -> dict[str, int]:
        """Return how many rows have each verdict."""
        found = Counter(row.verdict for row in self.rows)
        return {verdict: found[verdict] for verdict in VERDICTS}

    def to_json(self) -> str:
        """Return the report as JSON text: schema, fmu, ok, counts, rows."""
        return json.dumps(
            {
                "schema": 1,
                "fmu": self.fmu,
                "ok": self.ok,
                "counts": self.counts(),
                "rows": [asdict(row) for row in self.rows],
            },
            indent=2,
        )

    def summary(self) -> str:
        """Return one line: passed, failed, noted."""
        counts = self.counts()
        words = "falls short" if not self.ok else "conforms"
        return (
            f"{self.fmu} {words}: {counts['pass']} passed, {counts['fail']} failed, "
            f"{counts['note']} noted"
        )

    def to_text(self) -> str:
        """Return the table as plain text, one block per probe, for pipes and logs."""
        blocks = [
            f"{row.verdict:<5} {row.probe}\n"
            f"      tried     {row.tried}\n"
            f"      seen      {row.seen}\n"
            f"      standard  {row.standard}"
            for row in self.rows
        ]
        return "\n".join([*blocks, "", self.summary()])
