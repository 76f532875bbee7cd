"""Benches that hide nothing: how many of the 95 % intervals of `identify` hold the true value.

    python -m benchmarks honest intervals --clean 200

makes what is missing of these cases and prints the figure; without a number it prints what is
there. The cases are those of the blind benchmark that hide nothing: both laws, two sizes of rig, 1
or 3 % noise, which the package is not told. The law is given.
"""

from __future__ import annotations

from collections import Counter

from bristle.identification.rig import DAMPER, bench_rig
from bristle.identification.rig_fit import fit_site
from bristle.model.model import Model

from ._answers import Answer, asked
from ._blind import cases, score
from ._blind.forms import LIMITS
from ._blind.plan import make_plan
from ._blind.subject import halves
from ._rows import Row

SEED = 4117
"""Of the plan of the cases."""
TOGETHER = 100
"""Cases that share a process: a law is all that is compiled."""
LOW, HIGH = 0.93, 0.97
"""Shares of the intervals between which they are right."""


def answered(_kind: str, number: int) -> Answer:
    """Return of each parameter of a case how far it is off in standard deviations, by name.

    Left out are those whose true value is zero or at a limit, as in the blind benchmark.
    """
    case = cases.load(make_plan(SEED, number + 1, "none")[number])
    train, held = halves(case)
    law = Model(case.task.law)
    sites = bench_rig(train, held).sites(law)
    found = fit_site(law, sites[DAMPER], sites, 4, {})
    true = {n: v for n, v in case.truth["base"].items() if v != 0.0 and n not in LIMITS}
    off = {n: (found.model.value(n) - true[n]) / std for n, std in found.std.items() if n in true}
    told = {"law": case.task.law, "noise": case.task.noise, "off": off}
    return {**told, "unidentified": list(found.unidentified)}


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return the share of intervals that hold the truth, and by parameter beside it."""
    every, held = Counter[str](), Counter[str]()
    for one in done.values():
        for name, off in one["off"].items():
            if name not in one["unidentified"]:
                every[name] += 1
                held[name] += abs(off) <= score.AT_95
    if not every:
        return []
    whole = score.Count(held.total(), every.total())
    low, high = whole.interval
    return [
        Row(
            f"95 % intervals on {len(done)} clean benches hold the truth",
            f"{whole.share:.1%} ({whole.good} of {whole.of}; {low:.1%} to {high:.1%})",
            f"{LOW:.0%} to {HIGH:.0%}", max(LOW / max(whole.share, 1e-9), whole.share / HIGH),
            ", ".join(f"{name} {held[name]} of {n}" for name, n in sorted(every.items())),
        )
    ]  # fmt: skip


run, main = asked("intervals", __doc__, ("clean",), answered, rows, together=TOGETHER)
