"""An ensemble as data: what is run, what varies, what is kept of each run."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..version import __version__
from .distributions import Distribution, Value, share

if TYPE_CHECKING:
    from .identified import Identified

STATISTICS = ("peak", "rms", "max", "min", "mean", "last")


@dataclass(frozen=True)
class Varied:
    """One name that varies, e.g. "damper.sigma_a", and what it is drawn from.

    `place` says where the value goes: "parameter" of a component, "building" for a number of a
    building's data, "scenario" for what the scenario must be read anew for (records, steps, FMUs).
    """

    name: str
    distribution: Distribution
    place: str = "parameter"


@dataclass(frozen=True)
class Output:
    """One number that is kept of each run: a statistic of a column; "peak" is of its size."""

    column: str
    statistic: str
    unit: str = ""

    @property
    def name(self) -> str:
        """The output's name in tables: "peak damper.force"."""
        return f"{self.statistic} {self.column}"


@dataclass(frozen=True)
class Plan:
    """A checked ensemble.

    Attributes
    ----------
    file : Path
        The ensemble file.
    scenario : Path
        The base scenario.
    fixed : mapping
        Values in place of the scenario's, the same for all runs.
    engine : str
        "compiled" or "fmu".
    runs, seed : int
    varied, outputs : tuple
    content : str
        Digest of the base scenario and of the files that it reads.
    identified : Identified, optional
        A component whose parameters are drawn together.
    fmus : str
        "python" or "native": which FMUs the engine "fmu" steps.
    """

    file: Path
    title: str
    scenario: Path
    engine: str
    runs: int
    seed: int
    varied: tuple[Varied, ...]
    outputs: tuple[Output, ...]
    fixed: dict[str, Value] = field(default_factory=dict)
    content: str = ""
    identified: Identified | None = None
    fmus: str = "python"

    @property
    def left(self) -> bool:
        """Whether each run is made twice, the second time with an effect that is left open."""
        return self.identified is not None and bool(self.identified.left)

    @property
    def columns(self) -> list[str]:
        """The names of the numbers that are kept of each run."""
        own = [output.name for output in self.outputs]
        return [*own, *(f"{name} with it" for name in own)] if self.left else own

    def effect(self, run: int) -> tuple[str, float]:
        """Return the effect that joins a run, and its size over the limit."""
        assert self.identified is not None
        effect, part = self.identified.open_at(self.seed, run)
        return effect.label, part

    def values(self, run: int) -> dict[str, Value]:
        """Return what the varied names are in a run; it depends on seed, run and name alone."""
        cycled = [v for v in self.varied if v.distribution.kind == "each"]
        turn, chosen = run, {}
        for varied in reversed(cycled):
            turn, place = divmod(turn, len(varied.distribution.values))
            chosen[varied.name] = varied.distribution.values[place]
        joint = self.identified.draw(self.seed, run) if self.identified is not None else {}
        known = {**joint, **chosen}
        return {
            varied.name: known[varied.name]
            if varied.name in known
            else varied.distribution.draw(share(self.seed, run, varied.name))
            for varied in self.varied
        }

    @property
    def combinations(self) -> int:
        """How many combinations of the values of "each" there are; the runs go through them."""
        return prod(
            len(v.distribution.values) for v in self.varied if v.distribution.kind == "each"
        )

    def digest(self) -> str:
        """Return 16 hexadecimal digits that stand for all that decides a run's numbers.

        The number of runs and the title are no part of it: more runs continue an ensemble.
        """
        decides: dict[str, Any] = {
            "version": __version__,
            "content": self.content,
            "engine": self.engine,
            "seed": self.seed,
            "varied": [asdict(v) for v in self.varied],
            "outputs": [o.name for o in self.outputs],
        }
        if self.fmus != "python":
            decides["fmus"] = self.fmus
        if self.identified is not None:
            decides["identified"] = asdict(self.identified)
        return hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Outcome:
    """What became of a run: the kept numbers in the order of `Plan.outputs`, or why there are none.

    `reason` is "" for a run that is done. `lost` says of such a run why it could not be simulated
    with the effect that joins it.
    """

    run: int
    numbers: tuple[float, ...] = ()
    reason: str = ""
    lost: str = ""
