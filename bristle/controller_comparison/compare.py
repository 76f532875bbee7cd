"""Controllers compared: one's own building, motions, damper and controllers."""

from __future__ import annotations

import tempfile
import time as clock
from collections.abc import Sequence
from contextlib import nullcontext
from math import ceil, inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..campaign.campaign import Statistic
from ..campaign.ensemble import cores
from ..core.progress import Stages, tell
from ..core.text import unknown
from ..errors import ScenarioError
from .candidates import Maker
from .result import ControllerComparison, Setting, of_designs, of_engines
from .runs import CaseRunner, Reached, best_level, flat, limit_of, refuse_limit
from .setting import (
    BEST,
    DAMPER,
    DEFAULT,
    OFF,
    ON,
    ComparedController,
    ComparedMotion,
    Folder,
    Given,
    constant,
    damper_from,
    motions_of,
    site_from,
)
from .worst_case import Spread, tied, unvaried, varied, worst_of

if TYPE_CHECKING:
    import pandas as pd

STEP = 0.002
"""Rows of a run [s] where no controller samples faster."""
GRID = 17
STATISTICS = ("peak", "rms")


def compare_controllers(
    motions: Sequence[str | Path],
    controllers: Given,
    *,
    building: str | Path | None = None,
    damper: str | Path = DEFAULT,
    device: str = "",
    output: str = "",
    statistic: str = "peak",
    grid: int = GRID,
    limit: bool = False,
    spread: Spread | None = None,
    step: float | None = None,
    engine: str = "compiled",
    fmus: str = "python",
    workers: int | None = None,
    out: str | Path | None = None,
) -> ControllerComparison:
    """Run controllers under ground motions, beside constant voltages, and compare them.

    Each controller and each motion is a scenario. Beside the controllers stand the damper at 0 V,
    at its largest voltage, and at the constant voltage that is best for the motion.

    Parameters
    ----------
    motions : sequence of str
        `RECORD,peak=0.6g,factor=0.45,stop=30` each: a name of `bristle list records` or its
        beginning, or a file; peak in m/s2 or g, none for the record as it is; stop in s, else the
        record's end.
    controllers : str, sequence or mapping
        `WHAT,NAME=VALUE,...` each, or by the names that tables shall have: a stock controller; a
        file of `bristle design`, or a design file, which is then designed; a component of one's own
        (.py); an FMU.
    building : path, optional
        A building file; else the library's own building.
    damper : str
        `WHAT,NAME=VALUE,...`: a component, a law or its file, the folder of a study or a
        model.toml, an FMU.
    device : str
        Where the damper is: the name of a device of the building; "" on the first level.
    output : str
        The column of the runs that is judged; else the top level's absolute acceleration.
    statistic : str
        By which it is judged: "peak" (of its size) or "rms".
    grid : int
        How many constant voltages are tried.
    limit : bool
        Whether to compute, for each motion, how far any voltage could go (see
        `bristle.optimal_control`): up to a minute each, kept in the cache.
    spread : Spread, optional
        Of `bristle.controller_comparison`: how far building, damper and sensors may lie from what a
        controller was told; each case is then run with as many members, for its worst case.
    step : float, optional
        Rows of the runs, and step of FMUs [s]; else 0.002 s, or a share of a sample period.
    engine : str
        "compiled" where all parts are built in; "fmu" steps FMUs throughout, as it does with
        components of others.
    fmus : str
        "python" or "native": which FMUs of built-in components are stepped.
    workers : int, optional
        Processes for many runs; else as many as there are cores.
    out : path, optional
        Folder for scenarios, ensembles and the files that they read: every case can be run again.
        Without it nothing is kept.

    Returns
    -------
    ControllerComparison
        `table`, `worst`, `verdict`, `plot()`.

    Raises
    ------
    ScenarioError, RecordError, PhysicsError, DesignError, FmuError, BuildError, StudyError
        If an input is wrong; nothing was compared.
    RunError
        If a run fails, or the folder cannot be written.

    Examples
    --------
    >>> import bristle
    >>> found = bristle.compare_controllers(
    ...     ["el_centro_1940_ns,peak=0.4g,factor=0.45,stop=6"], ["Skyhook"], grid=3
    ... )
    >>> list(found.table["controller"])
    ['passive off', 'passive on', 'best constant', 'Skyhook']
    """
    began = clock.monotonic()
    _refuse(statistic, grid, engine, workers, step)
    with tempfile.TemporaryDirectory() if out is None else nullcontext(str(out)) as path:
        folder = Folder(Path(path))
        site = site_from(building, device, folder)
        one = damper_from(damper, folder)
        tell("designing")
        candidates = Maker(site, one, folder).candidates(controllers)
        rows = _step(candidates) if step is None else step
        bench = CaseRunner(site, one, folder, rows, engine, fmus, workers or cores())
        judged = _judged(bench, output, statistic)
        chosen = motions_of(motions, folder, rows)
        if limit:
            refuse_limit(bench, chosen[0], judged)
        run = _Run(bench, judged, candidates, grid, limit, spread)
        run.motions(chosen)
        folder.finish()
        setting = Setting(
            site, one, candidates, chosen, judged, spread, None if out is None else Path(path),
            "" if spread is None else varied(bench, candidates, spread),
        )  # fmt: skip
        notes = [*site.notes, *one.notes, *of_designs(candidates), *of_engines(bench, candidates)]
        if spread is not None:
            notes += unvaried(bench, candidates, spread)
        notes += [*run.notes, *bench.remarks]
    return ControllerComparison(
        setting, bench.outputs, run.table(), run.worst(), run.levels, run.limits, run.frames,
        tuple(dict.fromkeys(notes)), clock.monotonic() - began,
    )  # fmt: skip


CONSTANTS = 3
"""Constant voltages beside the controllers: none, the largest, the best."""


class _Run:
    """The runs of a comparison, motion by motion."""

    def __init__(
        self, bench: CaseRunner, judged: Statistic, candidates: list[ComparedController],
        grid: int, limit: bool, spread: Spread | None,
    ) -> None:  # fmt: skip
        self.bench, self.judged, self.candidates = bench, judged, candidates
        self.grid, self.limit, self.spread = grid, limit, spread
        self.rows: list[dict[str, Any]] = []
        self.worsts: list[dict[str, Any]] = []
        self.levels: dict[str, pd.DataFrame] = {}
        self.limits: dict[str, Reached] = {}
        self.frames: dict[tuple[str, str], pd.DataFrame] = {}
        self.notes: list[str] = []

    def motions(self, chosen: list[ComparedMotion]) -> None:
        """Run everything under all ground motions."""
        n, worst = len(chosen), len(self.candidates) + CONSTANTS
        kinds = {"run": worst + self.limit, "levels": 1, "limit": int(self.limit)}
        kinds["worst"] = worst * (self.spread is not None)
        self.stages = Stages("case", {kind: n * each for kind, each in kinds.items()})
        for motion in chosen:
            self._motion(motion)

    def _motion(self, motion: ComparedMotion) -> None:
        """Run everything under one ground motion."""
        # What has a clock goes first: the loop that it is compiled to serves all the others.
        clocked = sorted(self.candidates, key=lambda one: one.period is None)
        for candidate in clocked:
            self._frame(motion, candidate)
        constants = self._constants(motion)
        for candidate in [*constants, *self.candidates]:
            self._row(motion, candidate)
        if self.limit:
            self.stages.begins("limit", f"{motion.name}: the limit")
            candidate, self.limits[motion.name] = limit_of(self.bench, motion, self.judged)
            self._row(motion, candidate)
        if self.spread is not None:
            for candidate in [*constants, *self.candidates]:
                self._worst(motion, candidate, self.spread)

    def _constants(self, motion: ComparedMotion) -> list[ComparedController]:
        """Return the constant voltages of a motion: none, the largest, the best."""
        self.stages.begins("levels", f"{motion.name}: {self.grid} constant voltages")
        levels = self.bench.levels(motion, self.grid)
        if flat(levels["rms damper.force"]):
            raise ScenarioError(
                f"--damper {self.bench.damper.name}: its command changes nothing: the force is the "
                f"same at 0 and {self.bench.damper.most:g} V. Controllers have nothing to compare."
            )
        self.levels[motion.name] = levels
        best = best_level(levels, self.judged.name)
        most = self.bench.damper.most
        return [
            constant(OFF, 0.0, "the damper at 0 V"),
            constant(ON, most, f"the damper at its largest voltage, {most:g} V"),
            constant(BEST, best, "the constant voltage that is best for the motion"),
        ]

    def _frame(self, motion: ComparedMotion, candidate: ComparedController) -> pd.DataFrame:
        key = motion.name, candidate.name
        if key not in self.frames:
            self.stages.begins("run", f"{motion.name}: {candidate.name}")
            self.frames[key] = self.bench.run(motion, candidate)
        return self.frames[key]

    def _row(self, motion: ComparedMotion, candidate: ComparedController) -> None:
        frame = self._frame(motion, candidate)
        level = candidate.part.parameters.get("level") if not candidate.wires else None
        ratio = f"{DAMPER}.stroke_ratio"
        self.rows.append(
            {
                "motion": motion.name, "controller": candidate.name,
                "engine": self.bench.engine_of(candidate),
                "level": float("nan") if level is None else float(level),
                "stroke": float(frame[ratio].max()) if ratio in frame else float("nan"),
                **self.bench.measured(frame),
            }
        )  # fmt: skip

    def _worst(self, motion: ComparedMotion, candidate: ComparedController, spread: Spread) -> None:
        self.stages.begins("worst", f"{motion.name}: {candidate.name}, {spread.members} members")
        nominal = self.frames[motion.name, candidate.name]
        whole = not tied(self.bench, self.candidates)
        most, failed = worst_of(self.bench, motion, candidate, nominal, spread, whole)
        self.worsts.append(
            {"motion": motion.name, "controller": candidate.name, "failed": failed, **most}
        )
        if failed:
            self.notes.append(
                f"{motion.name}, {candidate.name}: {failed} of {spread.members} members failed; "
                "the worst case is that of the others."
            )

    def table(self) -> pd.DataFrame:
        """Return a row per case."""
        import pandas as pd

        return pd.DataFrame(self.rows)

    def worst(self) -> pd.DataFrame | None:
        """Return the worst of each case, None without members."""
        import pandas as pd

        return pd.DataFrame(self.worsts) if self.worsts else None


def _refuse(
    statistic: str, grid: int, engine: str, workers: int | None, step: float | None
) -> None:  # fmt: skip
    if statistic not in STATISTICS:
        raise ScenarioError(unknown("statistic", str(statistic), STATISTICS))
    if isinstance(grid, bool) or not isinstance(grid, int) or not 3 <= grid <= 1000:
        raise ScenarioError(f"a grid of {grid} voltages; 3 to 1000 are right.")
    if engine not in ("compiled", "fmu"):
        raise ScenarioError(f'engine "{engine}"; compiled or fmu is right.')
    if workers is not None and workers < 1:
        raise ScenarioError(f"--workers {workers}: 1 or more is right.")
    if step is not None and not 0.0 < step < inf:
        raise ScenarioError(f"--step {step:g}: a time above 0 s is right.")


def _step(candidates: list[ComparedController]) -> float:
    """Return rows that fall on the controllers' instants, where they can."""
    periods = [one.period for one in candidates if one.period is not None]
    return min([STEP, *(period / ceil(period / STEP - 1e-9) for period in periods)])


def _judged(bench: CaseRunner, output: str, statistic: str) -> Statistic:
    column = output or bench.site.top
    for one in bench.outputs:
        if (one.column, one.statistic) == (column, statistic):
            return one
    known = list(dict.fromkeys(one.column for one in bench.outputs))
    raise ScenarioError(unknown("output", column, known))
