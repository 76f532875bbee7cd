"""The runs of a comparison: scenarios for each motion and controller, and for its limit."""

from __future__ import annotations

import hashlib
import json
import logging
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..campaign.campaign import Statistic
from ..campaign.ensemble import run_left
from ..campaign.ensemble_file import EnsemblePlan, read_ensemble
from ..campaign.table import RunsTable
from ..core.files import cache_folder
from ..core.progress import Count, listening
from ..core.toml_lines import toml_text
from ..engine import Engine
from ..engine.cosimulation import Cosimulation, ignore
from ..engine.coupled import Coupled
from ..errors import EnsembleError, RunError, ScenarioError
from ..optimal_control import limit
from ..optimal_control.case import case_of, voltage_signal
from ..system.scenario import load_scenario
from ..system.toml import signal_file, tables_text
from ..version import __version__
from .setting import (
    ABOVE,
    CONTROLLER,
    DAMPER,
    ENSEMBLES,
    FILES,
    GROUND,
    LIMIT,
    LIMITS,
    ON,
    SCENARIOS,
    STRUCTURE,
    CommandedDamper,
    ComparedController,
    ComparedMotion,
    ComponentTable,
    DamperPlace,
    Folder,
    constant,
    plain_name,
)

if TYPE_CHECKING:
    import pandas as pd

SENSORS = "sensors"
SEED = 1
"""Of every ensemble: its members are the same for all controllers."""


@dataclass(frozen=True)
class CaseRunner:
    """What all runs of a comparison share.

    Attributes
    ----------
    site, damper, folder
        Building, damper, and the folder of the comparison.
    step : float
        Of the runs' rows, and of FMUs [s].
    engine : str
        "compiled", where all parts are built in, or "fmu" for all.
    fmus : str
        "python" or "native": what the engine "fmu" steps.
    workers : int
        Processes for many runs.
    remarks : list of str
        Warnings of the scenarios' checks, as they come.
    """

    site: DamperPlace
    damper: CommandedDamper
    folder: Folder
    step: float
    engine: str
    fmus: str
    workers: int
    remarks: list[str] = field(default_factory=list)

    @property
    def outputs(self) -> tuple[Statistic, ...]:
        """What is kept of every run."""
        return self.site.outputs(self.command)

    @property
    def command(self) -> str:
        """Column that has the command; controllers differ in what they call theirs."""
        return f"{CONTROLLER}.voltage"

    def engine_of(self, candidate: ComparedController) -> str:
        """Return the engine that runs a controller."""
        foreign = str(self.damper.part.source.get("fmu", "")).endswith(".fmu")
        return "fmu" if foreign or not candidate.built_in else self.engine

    def columns(self, candidate: ComparedController) -> dict[str, str]:
        """Return the column of a run for each column of the comparison."""
        own = f"{CONTROLLER}.{candidate.output}"
        return {o.column: own if o.column == self.command else o.column for o in self.outputs}

    def text(
        self,
        motion: ComparedMotion,
        candidate: ComparedController,
        sensors: ComponentTable | None = None,
    ) -> str:
        """Return the text of a scenario.

        Parameters
        ----------
        motion, candidate : the case
        sensors : instruments between the structure and the controller, if any
        """
        ports = self.site.ports
        parts = {GROUND: motion.part, STRUCTURE: self.site.part, DAMPER: self.damper.part}
        command: Any = f"{CONTROLLER}.{candidate.output}"
        if self.damper.drive.name != "voltage":
            command = {"from": command, "factor": 1.0}
        wires: dict[str, Any] = {
            f"{STRUCTURE}.ground_acceleration": f"{GROUND}.ground_acceleration",
            f"{STRUCTURE}.{ports.force}": f"{DAMPER}.force",
            f"{DAMPER}.displacement": f"{STRUCTURE}.{ports.displacement}",
            f"{DAMPER}.velocity": f"{STRUCTURE}.{ports.velocity}",
            f"{DAMPER}.{self.damper.drive.name}": command,
        }
        if sensors is not None:
            parts[SENSORS] = sensors
            wires |= {f"{SENSORS}.{name}": column for name, column in self.site.measured.items()}
        for name, column in candidate.wires.items():
            sensed = sensors is not None and name in self.site.measured
            wires[f"{CONTROLLER}.{name}"] = f"{SENSORS}.{name}_measured" if sensed else column
        parts[CONTROLLER] = candidate.part
        title = f"{motion.name}, {self.site.building.name}, {self.damper.name}: {candidate.name}"
        run = {"stop": motion.stop, "step": self.step, "algorithm": "midpoint"}
        return tables_text(title, run, {name: one.table for name, one in parts.items()}, wires)

    def write(self, motion: ComparedMotion, candidate: ComparedController) -> Path:
        """Write the scenario of a case; return its file."""
        file = self.folder.at(SCENARIOS, motion.name, f"{plain_name(candidate.name)}.toml")
        return self.folder.write(file, self.text(motion, candidate))

    def run(self, motion: ComparedMotion, candidate: ComparedController) -> pd.DataFrame:
        """Return a case's run: the comparison's columns, and what figures show, by time [s].

        Raises
        ------
        ScenarioError, FmuError
            If the scenario is wrong.
        RunError
            If the run fails; the text says which.
        """
        import pandas as pd

        scenario = load_scenario(self.write(motion, candidate))
        self.remarks.extend(one.text for one in scenario.findings if one.level == "warning")
        try:
            engine: Engine = Coupled()
            if self.engine_of(candidate) != engine.name:
                engine = Cosimulation(self.fmus, ignore, listening())
            table = engine.run(scenario)
        except RunError as error:
            raise RunError(f"{motion.name}, {candidate.name}: {error}") from error
        columns = self.columns(candidate)
        extra = [
            f"{DAMPER}.velocity",
            f"{DAMPER}.stroke_ratio",
            f"{STRUCTURE}.{self.site.ports.velocity}",
        ]
        names = {**{name: name for name in extra if name in table.values}, **columns}
        data = {name: np.asarray(table[own], dtype=np.float64) for name, own in names.items()}
        return pd.DataFrame(data, index=pd.Index(table.time, name="time"))

    def measured(self, frame: pd.DataFrame) -> dict[str, float]:
        """Return what is kept of a run, by the names of `outputs`."""
        return {o.name: o.of(frame[o.column].to_numpy()) for o in self.outputs}

    def many(
        self, file: Path, candidate: ComparedController, scenario: Path, runs: int,
        tables: Mapping[str, Mapping[str, Any]],
    ) -> tuple[pd.DataFrame, int]:  # fmt: skip
        """Write an ensemble and run it; return what is kept of its runs, and how many failed.

        Parameters
        ----------
        file : of the ensemble
        candidate : its controller
        scenario : its base
        runs : how many
        tables : `vary`, and others
        """
        import pandas as pd

        columns = self.columns(candidate)
        kept: dict[str, list[str]] = {}
        for one in self.outputs:
            kept.setdefault(columns[one.column], []).append(one.statistic)
        content: dict[str, Any] = {
            "title": file.stem, "scenario": _relative(scenario, file.parent),
            "engine": self.engine_of(candidate), "runs": runs, "seed": SEED,
        }  # fmt: skip
        if content["engine"] == "fmu" and self.fmus != "python":
            content["fmus"] = self.fmus
        self.folder.write(file, toml_text({"schema": 1, **content, **tables, "outputs": kept}))
        plan = read_ensemble(file)
        runs_file = file.with_suffix(".csv")
        with quiet(), _continued(plan, runs_file, self.folder.goes_on) as table:
            count = Count(f"{file.parent.name}, {file.stem}: run", len(table.left))
            run_left(plan, table, self.workers, count.done)
        outcomes = [table.outcomes[run] for run in range(plan.runs)]
        rows = {one.run: one.numbers for one in outcomes if not one.reason}
        failed = len(outcomes) - len(rows)
        names = {f"{o.statistic} {columns[o.column]}": o.name for o in self.outputs}
        titles = [names[one.name] for one in plan.outputs]
        frame = pd.DataFrame([rows[k] for k in sorted(rows)], index=sorted(rows), columns=titles)
        return frame, failed

    def levels(self, motion: ComparedMotion, count: int) -> pd.DataFrame:
        """Return what is kept of a motion's runs at constant voltages, by the voltage [V].

        Parameters
        ----------
        motion : the ground motion
        count : how many voltages, from 0 to the damper's largest

        Raises
        ------
        RunError
            If one fails.
        """
        candidate = constant("constant", 0.0, "")
        volts = np.linspace(0.0, self.damper.most, count).tolist()
        base = self.write(motion, candidate)
        file = self.folder.at(ENSEMBLES, motion.name, "constant.toml")
        vary = {"vary": {f"{CONTROLLER}.level": {"each": volts}}}
        found, failed = self.many(file, candidate, base, count, vary)
        if failed:
            raise RunError(
                f"{motion.name}: {failed} of {count} runs at constant voltages fail; bristle "
                f"ensemble {file} says why."
            )
        found.index = volts
        return found


@contextmanager
def _continued(plan: EnsemblePlan, path: Path, goes_on: bool) -> Iterator[RunsTable]:
    """Yield the table of an ensemble's runs, with those of before where it `goes_on`."""
    try:
        table = RunsTable(plan, path, fresh=not goes_on)
        table.forget_failures()
    except EnsembleError:  # of other files or numbers, or damaged
        table = RunsTable(plan, path, fresh=True)
    try:
        yield table
    finally:
        table.close(complete=len(table.outcomes) >= plan.runs)


@contextmanager
def quiet() -> Iterator[None]:
    """Keep the runs' own warnings back: the tables tell where a run leaves the stroke."""
    logger = logging.getLogger("bristle")
    before = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(before)


def _relative(file: Path, folder: Path) -> str:
    """Return a file's path from a folder two levels below the comparison's."""
    return "/".join(["..", "..", *file.relative_to(folder.parent.parent).parts])


def best_level(levels: pd.DataFrame, judged: str) -> float:
    """Return the constant voltage [V] with the least judged value among those that were run."""
    volts = levels.index.to_numpy()
    return float(volts[int(np.argmin(levels[judged].to_numpy()))])


def flat(values: Iterable[float]) -> bool:
    """Return whether values are all the same."""
    found = np.array(list(values))
    return bool(np.ptp(found) <= 1e-12 * np.abs(found).max())


# The limit of each motion: computed once, kept in the cache, played as one more controller.


class Reached(NamedTuple):
    """What a search for the limit of a motion found.

    `value` of the judged output; `bound` below which no force can bring it, None where none is
    known; `agreeing` of `starts` searches found it within 2 %, `sure` whether two did and the
    coupled engine confirms it. `kept` tells whether the cache had it.
    """

    value: float
    bound: float | None
    agreeing: int
    starts: int
    sure: bool
    kept: bool


def refuse_limit(bench: CaseRunner, motion: ComparedMotion, judged: Statistic) -> None:
    """Refuse a case that has no limit, before the work for it is done.

    Raises
    ------
    ScenarioError
        Saying why.
    """
    candidate = constant(ON, bench.damper.most, "")
    if bench.engine_of(candidate) != "compiled":
        raise ScenarioError(
            "--limit needs a damper of the library and the engine compiled: the law in an FMU is "
            "not known."
        )
    case_of(load_scenario(bench.write(motion, candidate)), judged.column)


def limit_of(
    bench: CaseRunner, motion: ComparedMotion, judged: Statistic, starts: int = 3
) -> tuple[ComparedController, Reached]:
    """Return the voltage that reaches a motion's limit as a controller, and what is known of it.

    Parameters
    ----------
    bench, motion : the case
    judged : the output that is to be lowest, and its statistic
    starts : of the search

    Raises
    ------
    ScenarioError
        If the case does not suit.
    RunError
        If a run fails.
    """
    text = bench.text(motion, constant(ON, bench.damper.most, ""))
    file = cache_folder() / LIMITS / f"{_limit_digest(bench, text, judged, starts)}.json"
    found, kept = _read_limit(file), True
    if found is None:
        kept = False
        scenario = load_scenario(bench.write(motion, constant(ON, bench.damper.most, "")))
        with quiet():
            one = limit(
                scenario, output=judged.column, statistic=judged.statistic, previews=(),
                starts=starts,
            )  # fmt: skip
        found = {
            "value": one.value, "bound": one.bound, "agreeing": one.agreeing,
            "starts": len(one.starts), "sure": bool(one.sure), "time": one.time.tolist(),
            "voltage": one.voltage.tolist(),
        }  # fmt: skip
        bench.folder.write(file, json.dumps(found))
    path = bench.folder.at(LIMITS, motion.name, "voltage.csv")
    bench.folder.write(path, "")
    signal_file(voltage_signal(found["time"], found["voltage"]), path)
    said = f"{ABOVE}/{LIMITS}/{plain_name(motion.name)}/{path.name}"
    part = ComponentTable({"fmu": "SignalSource"}, {"kind": "csv", "file": said})
    about = "the voltage that reaches the limit, the ground motion known in advance"
    reached = Reached(
        found["value"], found["bound"], found["agreeing"], found["starts"], found["sure"], kept
    )
    return ComparedController(LIMIT, part, {}, "value", True, None, about), reached


def _limit_digest(bench: CaseRunner, text: str, judged: Statistic, starts: int) -> str:
    """Return what stands for all that decides a limit: scenario, files that it reads, goal."""
    content = hashlib.sha256(f"{__version__}/{judged.name}/{starts}/".encode())
    content.update(re.sub(r"^title = .*$", "", text, flags=re.MULTILINE).encode())
    for name in re.findall(rf'{re.escape(ABOVE)}/{FILES}/([^"]+)', text):
        content.update((bench.folder.path / FILES / name).read_bytes())
    return content.hexdigest()[:24]


def _read_limit(file: Path) -> dict[str, Any] | None:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None  # not there, or cut short: it is computed anew
    return found if isinstance(found, dict) else None
