"""Controllers compared: one's own building, motions, damper and controllers."""

from __future__ import annotations

import tempfile
import time as clock
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from math import ceil, inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..campaign.campaign import Statistic
from ..campaign.ensemble import cores
from ..component.controller_file import (
    COMMAND_UNITS,
    POLICY,
    Controller,
    building_digest,
    read_controller,
)
from ..core.config import SCHEMA, Document
from ..core.progress import Stages, tell
from ..core.text import did_you_mean, unknown
from ..errors import BuildError, DesignError, FmuError, ScenarioError
from ..fmu import catalogue
from ..fmu.build import build, plan
from ..fmu.controller import MEASURED, invertible
from ..fmu.description import Description, read_description
from ..physics.building import frequencies, paper_building
from ..physics.drive import VOLTAGE
from ..synthesis import DesignDamper, LqgWeights, Task, Weight, Weights, design
from ..synthesis.analysis import Reach, reach_of
from ..synthesis.design_file import task_of
from ..synthesis.task import check_sample_period
from ..system.library import controller_in, law_of
from .result import ControllerComparison, Setting, of_designs, of_engines
from .runs import (
    CaseRunner,
    Reached,
    Spread,
    best_level,
    flat,
    limit_of,
    refuse_limit,
    tied,
    unvaried,
    varied,
    worst_of,
)
from .setting import (
    ABOVE,
    BEST,
    CONSTANT,
    DAMPER,
    DEFAULT,
    FILES,
    LIMIT,
    OFF,
    ON,
    STRUCTURE,
    CommandedDamper,
    ComparedController,
    ComparedMotion,
    ComponentTable,
    DamperPlace,
    Folder,
    Given,
    Selection,
    choices_of,
    constant,
    damper_from,
    motions_of,
    number,
    plain_name,
    refuse_twice,
    site_from,
)

if TYPE_CHECKING:
    import pandas as pd

# Designs for a comparison's building: made anew where none was made for it.
#
# A stock design belongs to the library's building and damper. For others it is made again with the
# same weights, brought to their size: a command costs as much of the acceleration that it can make,
# drift weighs as much beside acceleration, and corners move with the first mode. So a building that
# differs in its unit of mass alone gets the same design.


def designed_for(kind: str, site: DamperPlace, damper: CommandedDamper) -> Controller:
    """Return a controller of some kind, designed for a building and its damper.

    Parameters
    ----------
    kind : of the design, "hinf", "lpv", "lqg" ...
    site, damper : what it is for

    Raises
    ------
    DesignError
        If there is none, or the design needs the damper's law and nobody knows it.
    """
    return design(task_for(kind, site, damper)).controller


def task_for(kind: str, site: DamperPlace, damper: CommandedDamper) -> Task:
    """Return the stock task of a kind, brought to a building and its damper.

    Parameters
    ----------
    kind, site, damper
        As in `designed_for`, and what is raised too.
    """
    if kind == POLICY:
        raise DesignError(
            f"the library's {kind} was trained for its own building and damper. Train one for "
            f"yours in a checkout: `python -m benchmarks train my_{kind}.toml`, then --controller "
            f"my_{kind}.json."
        )
    known = DesignDamper() if damper.usual else damper.for_design()
    if known is None and COMMAND_UNITS[kind] == VOLTAGE.unit:
        raise DesignError(
            f"a design of the kind {kind} follows the damper's law, and {damper.name} has none "
            "that is known in closed form."
        )
    stock = Task(kind)
    here = replace(
        stock, title=f"{kind} for {site.building.name}", building=site.building,
        device=site.device.name, damper=known or DesignDamper(),
    )  # fmt: skip
    return replace(here, **_weights(stock, here))


def _weights(stock: Task, here: Task) -> dict[str, Any]:
    """Return the weights of a stock task at the size of another plant."""
    before, now = reach_of(stock), reach_of(here)
    if stock.kind == "lqg":
        return {"lqg": _lqg(stock.lqg, before, now)}
    faster = frequencies(here.building)[0] / frequencies(stock.building)[0]
    w = stock.weights
    command = _moved(w.command, faster, now.command / before.command)
    return {"weights": Weights(_moved(w.acceleration, faster, 1.0), command, w.noise)}


def _lqg(w: LqgWeights, before: Reach, now: Reach) -> LqgWeights:
    per_force = now.command / before.command
    per_drift = (now.command / now.drift) / (before.command / before.drift)
    return replace(w, force=w.force * per_force**2, drift=w.drift * per_drift**2)


def _moved(weight: Weight, faster: float, share: float) -> Weight:
    """Return a weight whose frequencies are `faster` times as high, and its gain times `share`."""

    def scaled(polynomial: tuple[float, ...], gain: float = 1.0) -> tuple[float, ...]:
        missing = len(weight.denominator) - len(polynomial)
        return tuple(gain * c * faster ** (k + missing) for k, c in enumerate(polynomial))

    return Weight(scaled(weight.numerator, share), scaled(weight.denominator))


def force_share(damper: CommandedDamper) -> float:
    """Return how strong a damper is beside the library's: force at its typical speed and most V.

    1 where its law is not known in closed form.
    """
    return _beside(damper, lambda one: sum(one.sliding_force(one.speed, one.v_max)))


def slope_share(damper: CommandedDamper) -> float:
    """Return how much force a volt makes beside the library's damper, at its typical speed.

    1 where its law is not known in closed form.
    """

    def per_volt(one: DesignDamper) -> float:
        still, driven = (sum(one.sliding_force(one.speed, V)) for V in (0.0, one.v_max))
        return (driven - still) / one.v_max

    return _beside(damper, per_volt)


def _beside(damper: CommandedDamper, measure: Callable[[DesignDamper], float]) -> float:
    """Return what a measure tells of a damper over what it tells of the library's."""
    known = damper.for_design()
    if known is None or damper.usual:
        return 1.0
    return measure(known) / measure(DesignDamper(law_of(DEFAULT)))


@dataclass
class Maker:
    """Makes the candidates of one comparison: `site` and `damper` are what they are for."""

    site: DamperPlace
    damper: CommandedDamper
    folder: Folder
    _designs: dict[str, str] = field(default_factory=dict)

    def candidates(self, given: Given) -> list[ComparedController]:
        """Return the controllers of a list of texts.

        Parameters
        ----------
        given : `WHAT,NAME=VALUE,...` each: a stock name, a controller file or design file, a
            component of one's own (.py) or an FMU, with values of its parameters

        Raises
        ------
        ScenarioError, DesignError, BuildError, FmuError
            If there is none, one does not fit, or a file is not right.
        """
        chosen = choices_of(given, "--controller")
        if not chosen:
            raise ScenarioError(
                "no controllers: name some, as --controller LqgClipped my_design.json my.fmu."
            )
        found = [self.candidate(choice) for choice in chosen]
        refuse_twice([one.name for one in found], "--controller", (OFF, ON, BEST, LIMIT))
        plain = [plain_name(one.name) for one in found]
        refuse_twice(plain, "--controller", [plain_name(name) for name in (OFF, ON, BEST, LIMIT)])
        return found

    def candidate(self, choice: Selection) -> ComparedController:
        """Return the controller of one choice."""
        name = choice.as_text
        ending = Path(choice.what).suffix.lower()
        makers = {
            ".fmu": self._of_fmu, ".py": self._of_source, ".json": self._of_controller,
            ".toml": self._of_design,
        }  # fmt: skip
        try:
            found = makers.get(ending, self._of_stock)(choice, name)
            if found.period is not None:
                check_sample_period(found.period, self.site.building)
        except (ScenarioError, DesignError, BuildError, FmuError) as error:
            if choice.what in str(error):
                raise
            raise type(error)(f"--controller {choice.what}: {error}") from error
        return found

    # -- kinds of choices

    def _of_stock(self, choice: Selection, name: str) -> ComparedController:
        known = [CONSTANT, *catalogue.controllers()]
        if choice.what not in known:
            hint = did_you_mean(choice.what, known)
            raise ScenarioError(
                f'no controller is named "{choice.what}". There are: {", ".join(known)}; a file of '
                f"`bristle design`, of a component of your own (.py) or an FMU is right too.{hint}"
            )
        settings = dict(choice.settings)
        file = settings.pop("controller", None)
        kind = design_of(choice.what)
        if file is not None:
            return self._designed(choice.what, name, settings, self._checked(Path(str(file)), kind))
        if not kind:
            return self._built_in(choice.what, name, {"fmu": choice.what}, settings)
        building = building_digest(self.site.building) == building_digest(paper_building())
        if building and not self.site.device.name and self.damper.usual:
            about = f"the library's {kind} design, made for this building"
            source = {"fmu": choice.what}
            return self._built_in(choice.what, name, source, settings, about, carries=True)
        return self._designed(choice.what, name, settings, self._anew(kind), redesigned=True)

    def _of_controller(self, choice: Selection, name: str) -> ComparedController:
        file = Path(choice.what)
        kind = read_controller(file).kind
        kept = self._checked(file, kind)
        return self._designed(self._component(kind), name, dict(choice.settings), kept)

    def _of_design(self, choice: Selection, name: str) -> ComparedController:
        """Design what a design file asks for; building and damper are these unless it names one."""
        file = Path(choice.what)
        document = Document(file, DesignError)
        document.data.setdefault("schema", SCHEMA)
        place = self.site.building, self.site.device.name
        task = task_of(document, file.parent, place)
        known = self.damper.for_design()
        if "damper" not in document.data and known is not None:
            task = replace(task, damper=known)
        found = design(task).controller
        kept = self._save(found, file.stem)
        self.site.check_design(found, str(file))
        return self._designed(self._component(found.kind), name, dict(choice.settings), kept)

    def _of_source(self, choice: Selection, name: str) -> ComparedController:
        with tempfile.TemporaryDirectory() as scratch:
            made = build(plan(choice.what), Path(scratch))
            kept = self.folder.keep(made)
        about = f"a component of your own, {Path(choice.what).name}"
        return self._of_file(self.folder.path / FILES / Path(kept).name, kept, choice, name, about)

    def _of_fmu(self, choice: Selection, name: str) -> ComparedController:
        file = Path(choice.what)
        read_description(file, any_platform=True)
        return self._of_file(file, self.folder.keep(file), choice, name, f"the FMU {file.name}")

    # -- what they share

    def _designed(
        self,
        component: str,
        name: str,
        settings: dict[str, Any],
        kept: str,
        redesigned: bool = False,
    ) -> ComparedController:
        """Return a controller with a design of its own; `kept` is its file in the folder."""
        file = self.folder.path / FILES / Path(kept).name
        kind = read_controller(file).kind
        about = f"a design of the kind {kind}, {Path(kept).name}"
        about += ", made for this building by the comparison" if redesigned else ""
        source = {"fmu": component, "controller": kept}
        found = self._built_in(component, name, source, settings, about, carries=True, file=file)
        return replace(found, redesigned=redesigned)

    def _built_in(
        self, component: str, name: str, source: dict[str, Any], settings: dict[str, Any],
        about: str = "", *, carries: bool = False, file: Path | None = None,
    ) -> ComparedController:  # fmt: skip
        description = catalogue.describe(component, controller=file)
        parameters = {**self._suited(component, description, settings), **settings}
        period = parameters.get("sample_period", _start(description, "sample_period"))
        return ComparedController(
            name, ComponentTable(source, parameters), self._wires(description), "voltage", True,
            None if period is None else number(period, "sample_period", component),
            about or "without a design: it suits any building", carries,
        )  # fmt: skip

    def _suited(
        self, component: str, description: Description, settings: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the parameters that follow the damper: its largest voltage, its law's inverse."""
        there, found = description.variables, dict[str, Any]()
        if "v_max" in there and self.damper.most != _start(description, "v_max"):
            found["v_max"] = self.damper.most
        inverts = "inverse" in there and settings.get("kind", "inverse") == "inverse"
        if component == "Skyhook" and "kind" not in settings:
            inverts = False  # it switches, and inverts nothing
        shares = {"f_min": force_share, **({"least_slope": slope_share} if inverts else {})}
        for name, share_of in shares.items():
            if name in there and 0.0 < (share := share_of(self.damper)) != 1.0:
                found[name] = float(f"{share * float(_start(description, name) or 0.0):.4g}")
        if inverts and "inverse" not in settings:
            if self.damper.law not in _invertible():
                raise ScenarioError(
                    f"the law of {self.damper.name} is none that can be inverted, "
                    f"{', '.join(_invertible())}: ClippedOptimal takes the same designs."
                )
            values = {
                f"{self.damper.law}.{key}": value for key, value in self.damper.values.items()
            }
            found["inverse"] = self.damper.law
            found |= {key: value for key, value in values.items() if value != there[key].start}
        return found

    def _of_file(
        self, file: Path, kept: str, choice: Selection, name: str, about: str
    ) -> ComparedController:
        """Return a controller that is an FMU."""
        description = read_description(file, any_platform=True)
        there = description.variables
        outputs = [v.name for v in description.of("output")]
        drive = self.damper.drive.name
        output = next((one for one in (drive, "voltage", "command") if one in outputs), "")
        if not output:
            raise ScenarioError(
                f"has no output voltage [V]; its outputs are {', '.join(outputs) or 'none'}. A "
                f"controller has the output voltage and some of the inputs {', '.join(MEASURED)}."
            )
        wires = self._wires(description)
        missing = [
            v.name for v in description.of("input")
            if v.name not in wires and v.name not in choice.settings and not v.optional
        ]  # fmt: skip
        if missing:
            raise ScenarioError(
                f"nothing in the scenario is called as its input {', '.join(missing)}; a "
                f"controller has inputs of {', '.join(MEASURED)}, or of the outputs of the "
                f"building, or a value: {choice.what},{missing[0]}=0."
            )
        parameters: dict[str, Any] = dict(choice.settings)
        if "v_max" in there and "v_max" not in parameters:
            parameters |= self._suited("", _only(description, "v_max"), parameters)
        period = parameters.get("sample_period", _start(description, "sample_period"))
        return ComparedController(
            name, ComponentTable({"fmu": kept}, parameters), wires, output, False,
            float(period) if isinstance(period, int | float) else None, about,
            controller_in(file) is not None,
        )  # fmt: skip

    def _wires(self, description: Description) -> dict[str, str]:
        """Return what feeds a controller's inputs, by their names."""
        known = {port: f"{STRUCTURE}.{port}" for port in self.site.shown()}
        known |= self.site.measured
        return {v.name: known[v.name] for v in description.of("input") if v.name in known}

    def _component(self, kind: str) -> str:
        """Return the component that takes designs of a kind; one that inverts where it can."""
        able = [name for name in catalogue.controllers() if design_of(name) == kind]
        if not able:
            raise DesignError(f"no controller takes a design of the kind {kind}.")
        inverts = [one for one in able if "inverse" in catalogue.describe(one).variables]
        if inverts and self.damper.law in _invertible():
            return inverts[0]
        return next((one for one in able if one not in inverts), able[0])

    def _checked(self, file: Path, kind: str) -> str:
        """Keep a controller file that was made for this building, and of the kind."""
        found = read_controller(file)
        if found.kind != kind:
            raise DesignError(f"{file}: is of the kind {found.kind}; {kind or 'none'} is right.")
        self.site.check_design(found, str(file))
        return self.folder.keep(file)

    def _anew(self, kind: str) -> str:
        if kind not in self._designs:
            self._designs[kind] = self._save(designed_for(kind, self.site, self.damper), kind)
        return self._designs[kind]

    def _save(self, found: Controller, name: str) -> str:
        kept = f"{plain_name(name)}.json"
        found.save(self.folder.path / FILES / kept)
        return f"{ABOVE}/{FILES}/{kept}"


def design_of(component: str) -> str:
    """Return the kind of design that a component takes, "" of one without."""
    return str(getattr(catalogue.component_class(catalogue.source(component)), "design", ""))


def _start(description: Description, name: str) -> Any:
    variable = description.variables.get(name)
    return None if variable is None else variable.start


def _only(description: Description, name: str) -> Description:
    return replace(description, variables={name: description.variables[name]})


def _invertible() -> list[str]:
    return [law.name for law in invertible()]


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
