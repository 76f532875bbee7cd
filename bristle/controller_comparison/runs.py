"""The runs of a comparison: scenarios for each motion and controller, and for its limit."""

from __future__ import annotations

import hashlib
import json
import logging
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..campaign.campaign import Statistic
from ..campaign.ensemble import run_left
from ..campaign.ensemble_file import Distribution, EnsemblePlan, read_ensemble, share
from ..campaign.table import RunsTable
from ..core.files import cache_folder
from ..core.progress import Count, listening
from ..core.text import joined, percent
from ..core.toml_lines import toml_table, toml_text
from ..engine import Engine
from ..engine.cosimulation import Cosimulation, ignore
from ..engine.coupled import Coupled
from ..errors import EnsembleError, RunError, ScenarioError
from ..fmu.controller import SAMPLE_PERIOD
from ..optimal_control import limit
from ..optimal_control.case import case_of, voltage_signal
from ..physics.laws import LAWS
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


STARTS = 3
"""Of a search for a limit."""


def limit_of(
    bench: CaseRunner, motion: ComparedMotion, judged: Statistic
) -> tuple[ComparedController, Reached]:
    """Return the voltage that reaches a motion's limit as a controller, and what is known of it.

    Parameters
    ----------
    bench, motion : the case
    judged : the output that is to be lowest, and its statistic

    Raises
    ------
    ScenarioError
        If the case does not suit.
    RunError
        If a run fails.
    """
    text = bench.text(motion, constant(ON, bench.damper.most, ""))
    file = cache_folder() / LIMITS / f"{_limit_digest(bench, text, judged)}.json"
    found, kept = _read_limit(file), True
    if found is None:
        kept = False
        scenario = load_scenario(bench.write(motion, constant(ON, bench.damper.most, "")))
        with quiet():
            one = limit(
                scenario, output=judged.column, statistic=judged.statistic, previews=(),
                starts=STARTS,
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


def _limit_digest(bench: CaseRunner, text: str, judged: Statistic) -> str:
    """Return what stands for all that decides a limit: scenario, files that it reads, goal."""
    content = hashlib.sha256(f"{__version__}/{judged.name}/{STARTS}/".encode())
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


# The worst case: each controller with building, damper and sensors other than it was told.

_BUILDING = f"{STRUCTURE}.building"


@dataclass(frozen=True)
class Spread:
    """How far reality may lie from what a controller was told.

    Attributes
    ----------
    members : int
        How many buildings, dampers and sensors are drawn, the same for all controllers.
    share : float
        Each mass, each stiffness and each parameter of the damper's law lies within this share of
        its value to either side, evenly.
    noise : float
        RMS of the noise of each measured signal, as a share of the signal's RMS.
    delay : float
        Each measured signal lags by up to this time [s], evenly.

    Raises
    ------
    ScenarioError
        If a number is out of place.
    """

    members: int = 20
    share: float = 0.1
    noise: float = 0.01
    delay: float = 0.004

    def __post_init__(self) -> None:
        if isinstance(self.members, bool) or not isinstance(self.members, int) or self.members < 2:
            raise ScenarioError(f"--ensemble {self.members}: 2 or more members are right.")
        for name, value, most in (("spread", self.share, 0.9), ("noise", self.noise, 1.0),
                                  ("delay", self.delay, 1.0)):  # fmt: skip
            if not (isfinite(value) and 0.0 <= value <= most):
                raise ScenarioError(f"--{name} {value:g}: 0 to {most:g} is right.")
        if not (self.share or self.noise or self.delay):
            raise ScenarioError("--spread, --noise and --delay are 0: nothing varies.")

    def text(self, building: bool = True, damper: bool = True) -> str:
        """Return in words what varies, where the building and the damper's law do or do not."""
        parts = []
        what = [*(["masses", "stiffnesses"] * building), *(["damper parameters"] * damper)]
        if self.share and what:
            parts.append(f"{joined(what)} within {percent(self.share, 0)}")
        if self.noise:
            parts.append(f"sensor noise of {percent(self.noise, 0)} of each signal")
        if self.delay:
            parts.append(f"sensor delays up to {1e3 * self.delay:g} ms")
        return ", ".join(parts)


def worst_of(
    bench: CaseRunner,
    motion: ComparedMotion,
    candidate: ComparedController,
    nominal: pd.DataFrame,
    spread: Spread,
    building: bool = True,
) -> tuple[dict[str, float], int]:
    """Return the largest of what is kept over a case and its members; how many members failed.

    Parameters
    ----------
    bench, motion, candidate : the case
    nominal : its run
    spread : what varies
    building : whether the building does
    """
    most = bench.measured(nominal)
    sensors = _sensors(bench, candidate, nominal, spread)
    vary = _varied(bench, candidate, motion, spread, building)
    if sensors is not None:
        vary[f"{SENSORS}.seed"] = {"integers": [1, 10**6]}
        if spread.delay:
            for name in candidate.wires:
                if name in bench.site.measured:
                    vary[f"{SENSORS}.{name}.delay"] = {"uniform": [0.0, spread.delay]}
    if not vary:
        return most, 0
    folder = bench.folder
    base = folder.at(ENSEMBLES, motion.name, f"{plain_name(candidate.name)}_scenario.toml")
    folder.write(base, bench.text(motion, candidate, sensors))
    file = folder.at(ENSEMBLES, motion.name, f"{plain_name(candidate.name)}.toml")
    found, failed = bench.many(file, candidate, base, spread.members, {"vary": vary})
    for name in most:
        if len(found):
            most[name] = max(most[name], float(found[name].max()))
    return most, failed


def tied(bench: CaseRunner, candidates: list[ComparedController]) -> list[str]:
    """Return the controllers with which no other building can be run: FMUs refuse it."""
    return [one.name for one in candidates if one.carries and bench.engine_of(one) == "fmu"]


def varied(bench: CaseRunner, candidates: list[ComparedController], spread: Spread) -> str:
    """Return in words what varies in a comparison."""
    building = "masses" in bench.site.data and not tied(bench, candidates)
    return spread.text(building, bool(bench.damper.law))


def unvaried(bench: CaseRunner, candidates: list[ComparedController], spread: Spread) -> list[str]:
    """Return what is not varied, a sentence each."""
    names = tied(bench, candidates)
    if not spread.share:
        return []
    if "masses" not in bench.site.data:
        return ["The building is given as matrices, which are not varied."]
    if not names:
        return []
    return [
        f"{', '.join(names)}: the design belongs to the building, and FMUs refuse another one. So "
        "masses and stiffnesses are not varied for any controller. With the engine compiled and "
        "the controller's file in place of its FMU they are."
    ]


def _sensors(
    bench: CaseRunner, candidate: ComparedController, nominal: pd.DataFrame, spread: Spread
) -> ComponentTable | None:
    """Return the instruments of a controller, None where it measures nothing."""
    sensed = [name for name in candidate.wires if name in bench.site.measured]
    if not sensed or not (spread.noise or spread.delay):
        return None
    period = candidate.period or SAMPLE_PERIOD
    parameters: dict[str, Any] = {"sample_period": period, "seed": 1}
    for name in sensed:
        column = bench.site.measured[name]
        values = nominal[column].to_numpy()
        deviation = spread.noise * float(np.sqrt(np.mean(np.square(values))))
        parameters[f"{name}.noise_density"] = float(f"{deviation * sqrt(2.0 * period):.6g}")
    return ComponentTable({"fmu": "Sensors"}, parameters)


def _varied(
    bench: CaseRunner,
    candidate: ComparedController,
    motion: ComparedMotion,
    spread: Spread,
    building: bool,
) -> dict[str, Any]:
    """Return what varies of building and damper, as an ensemble file has it."""
    found: dict[str, Any] = {}
    if not spread.share:
        return found
    values = _numbers(bench.site.data) if building else {}
    if bench.engine_of(candidate) == "compiled":
        found = {f"{_BUILDING}.{name}": _around(value, spread) for name, value in values.items()}
    elif values:
        found[_BUILDING] = {"each": _written(bench, motion, values, candidate, spread)}
    if not bench.damper.law:
        return found
    declared = LAWS[bench.damper.law].parameters
    for name, value in bench.damper.values.items():
        low, high = declared[name].bounds
        ends = [max(low, _around(value, spread)["uniform"][0]),
                min(high, _around(value, spread)["uniform"][1])]  # fmt: skip
        if ends[0] < ends[1]:
            found[f"{DAMPER}.{name}"] = {"uniform": ends}
    return found


def _numbers(data: dict[str, Any]) -> dict[str, float]:
    """Return the masses and stiffnesses of a building by the names of ensembles."""
    return {
        f"{key}.{i}": float(value)
        for key in ("masses", "stiffnesses")
        for i, value in enumerate(data.get(key, ()))
    }


def _around(value: float, spread: Spread) -> dict[str, list[float]]:
    ends = sorted((value * (1.0 - spread.share), value * (1.0 + spread.share)))
    return {"uniform": [float(f"{end:.9g}") for end in ends]}


def _written(
    bench: CaseRunner,
    motion: ComparedMotion,
    values: dict[str, float],
    candidate: ComparedController,
    spread: Spread,
) -> list[str]:
    """Write the members' buildings as files: an FMU contains its building; return their names."""
    system = load_scenario(bench.write(motion, candidate))
    names = []
    for run in range(spread.members):
        drawn = {
            f"{_BUILDING}.{name}": Distribution(
                "uniform", tuple(_around(value, spread)["uniform"])
            ).draw(share(SEED, run, f"{_BUILDING}.{name}"))
            for name, value in values.items()
        }
        path = bench.folder.path / FILES / f"building_{run:03d}.toml"
        building = system.with_values(drawn).components[STRUCTURE].building
        assert isinstance(building, Mapping)
        bench.folder.write(path, "\n".join(toml_table(building)) + "\n")
        names.append(f"../../{FILES}/{path.name}")
    return names
