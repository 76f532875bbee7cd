"""What a verdict says of laws: which one the runs prefer, how the others do, what is as good."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..physics.forms import LINEAR_FORM, split_form
from .law_choice import Pair
from .law_trials import LawTrial


@dataclass(frozen=True)
class LawVerdict:
    """The law of a verdict, where laws and effects were sought together.

    `row` is the law chosen; `before` the law that the model had, "" where nobody chose one; `rows`
    all laws tried, the best first; `pairs` those whose effects were searched; `equivalents` what
    explains the runs as well: law, effects, z on held-out runs; `left_out` the laws whose force is
    not a number on these runs.
    """

    row: LawTrial
    before: str
    rows: tuple[LawTrial, ...]
    pairs: tuple[Pair, ...]
    equivalents: tuple[tuple[str, tuple[str, ...], float], ...] = ()
    left_out: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The law's name, with its variant and form."""
        return self.row.law

    def as_dict(self) -> dict[str, Any]:
        """Return what verdict.json holds of laws."""
        plain, form, _ = split_form(self.name)
        return {
            "law": plain, "command": form or LINEAR_FORM, "law_before": self.before,
            "laws": rows_of(self.rows, self.pairs),
            "equivalent": [
                {**_named(law), "effects": list(effects), "z_holdout": round(z, 4)}
                for law, effects, z in self.equivalents
            ],
            **({"laws_left_out": list(self.left_out)} if self.left_out else {}),
        }  # fmt: skip


def rows_of(rows: tuple[LawTrial, ...], pairs: tuple[Pair, ...] = ()) -> list[dict[str, Any]]:
    """Return laws tried as json can hold them, with what each lacks where that was searched."""
    searched = {pair.row.law: pair for pair in pairs}
    out = []
    for row in rows:
        shown = row.as_dict(rows[0])
        if pair := searched.get(row.law):
            shown |= {
                "kind": pair.finding.kind, "effects": list(pair.finding.effects),
                "z_with_effects": round(pair.after.z, 4), "fitted_with_effects": pair.fitted,
            }  # fmt: skip
        out.append(shown)
    return out


def _named(law: str) -> dict[str, str]:
    plain, form, _ = split_form(law)
    return {"law": plain, "command": form or LINEAR_FORM}
