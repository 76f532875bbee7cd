"""The ensemble file: TOML in, a checked plan out.

schema = 1
title = "El Centro, damper and building as they may be"
scenario = "el_centro_0p6g_constant_voltage"   # a stock scenario, or a file beside this one
engine = "compiled"                            # or "fmu"; then fmus = "native" steps native ones
runs = 500
seed = 1

[set]                                          # the same in all runs; as --set of bristle run
"run.stop" = 31.18

[vary]                                         # one distribution per name
"damper.sigma_a" = { normal = [650.0, 65.0], within = [300.0, 1000.0] }
"damper.sigma_0" = { uniform = [350.0, 480.0] }
"damper.a_0" = { log_uniform = [250.0, 1000.0] }
"ground.record" = { each = ["el_centro_1940_ns", "my_record.AT2"] }    # equally often, in turn
"ground.peak" = { choice = [3.924, 5.886], weights = [2, 1] }
"sensors.seed" = { integers = [1, 1000000] }
"structure.building.masses.2" = { normal = [1.232, 0.06] }             # compiled only

[outputs]                                      # peak, rms, max, min, mean, last
"structure.floor2_acceleration_absolute" = ["peak", "rms"]

[identified]                                   # the damper as a study has it: see `identified`
model = "my_rig"
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from itertools import accumulate
from math import exp, isfinite, log, prod
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np

from ..core import files
from ..core.config import ANY, Document, Key, Spec
from ..core.text import command, did_you_mean, unknown, written
from ..core.toml_lines import KeyPath
from ..engine.cosimulation import FORMS
from ..engine.results import make_columns
from ..engine.run import engine_of
from ..errors import BristleError, EnsembleError, TrustError
from ..model.draws import has_covariance, joint_errors
from ..model.model import Model
from ..model.model_file import read_model
from ..physics.effect import EFFECTS, plain_name
from ..system.model import FILE_PARAMETERS, System, Wrong, plain_target, typed
from ..system.overrides import FILES
from ..system.scenario import load_scenario, resolve_scenario
from ..system.toml import scenario_text
from ..version import __version__
from .campaign import STATISTICS, Campaign, Statistic, is_read_anew

Value = bool | int | float | str

KINDS = ("uniform", "log_uniform", "normal", "integers", "choice", "each")


def share(seed: int, run: int, name: str) -> float:
    """Return a number within (0, 1), even over runs and names."""
    digest = hashlib.sha256(f"{seed}/{run}/{name}".encode()).digest()
    return ((int.from_bytes(digest[:8], "big") >> 11) + 0.5) / 2.0**53


@dataclass(frozen=True)
class Distribution:
    """What one name is drawn from.

    Attributes
    ----------
    kind : str
        One of `KINDS`. "each" takes every value equally often, in turn, not by chance.
    values : tuple
        uniform, log_uniform, integers: both ends; normal: mean and standard deviation; choice,
        each: the values themselves.
    within : tuple of float, optional
        normal: both ends between which it is cut off.
    weights : tuple of float, optional
        choice: how likely each value is, in any scale.
    """

    kind: str
    values: tuple[Value, ...]
    within: tuple[float, float] | None = None
    weights: tuple[float, ...] = ()

    def mistake(self) -> str:
        """Return the words for what is wrong with it, "" for nothing."""
        if self.kind in ("choice", "each"):
            return self._mistake_of_list()
        if len(self.values) != 2 or not all(_is_number(v) for v in self.values):
            return f"{self.kind} needs a list of two finite numbers."
        low, high = float(self.values[0]), float(self.values[1])
        if self.kind == "normal":
            return self._mistake_of_normal(low, high)
        if self.kind == "integers" and not all(isinstance(v, int) for v in self.values):
            return "integers needs two whole numbers."
        if self.kind == "log_uniform" and low <= 0.0:
            return f"log_uniform begins at {low:g}; it must begin above 0."
        if low > high or (low == high and self.kind != "integers"):
            return f"{self.kind} = [{low:g}, {high:g}] must rise."
        return ""

    def _mistake_of_list(self) -> str:
        if not self.values:
            return f"{self.kind} needs a list with at least one value."
        if not all(isinstance(v, str | bool) or _is_number(v) for v in self.values):
            return f"{self.kind} holds numbers, texts, true and false."
        if self.weights and len(self.weights) != len(self.values):
            return f"{len(self.values)} values need as many weights, found {len(self.weights)}."
        if self.weights and (min(self.weights) < 0.0 or sum(self.weights) <= 0.0):
            return "weights must not be negative, and one at least must be positive."
        return ""

    def _mistake_of_normal(self, mean: float, deviation: float) -> str:
        if deviation <= 0.0:
            return f"normal has the standard deviation {deviation:g}; it must be positive."
        if self.within is None:
            return ""
        low, high = self.within
        if not low < high:
            return f"within = [{low:g}, {high:g}] must rise."
        normal = NormalDist(mean, deviation)
        if normal.cdf(high) - normal.cdf(low) < 1e-6:
            return (
                f"within = [{low:g}, {high:g}] lies where normal = [{mean:g}, {deviation:g}] "
                "never comes."
            )
        return ""

    def draw(self, u: float) -> Value:
        """Return the value at the share u of the distribution, 0 < u < 1."""
        if self.kind == "choice":
            weights = self.weights or (1.0,) * len(self.values)
            reached = list(accumulate(weights))
            place = next((k for k, edge in enumerate(reached) if u * reached[-1] < edge), -1)
            return self.values[place]
        a, b = self.values[0], self.values[1]
        if self.kind == "integers":
            return int(a) + int(u * (int(b) - int(a) + 1))
        a, b = float(a), float(b)
        if self.kind == "uniform":
            return a + u * (b - a)
        if self.kind == "log_uniform":
            return min(max(exp(log(a) + u * (log(b) - log(a))), a), b)
        normal = NormalDist(a, b)
        if self.within is None:
            return normal.inv_cdf(u)
        low, high = (normal.cdf(end) for end in self.within)
        value = normal.inv_cdf(min(max(low + u * (high - low), 1e-300), 1.0 - 2.0**-53))
        return min(max(value, self.within[0]), self.within[1])

    def extremes(self) -> tuple[Value, ...]:
        """Return values that show whether a variable can take what will be drawn.

        The ends of a bounded distribution, the mean of an unbounded one, every value of a list.
        """
        if self.kind in ("choice", "each", "integers"):
            return self.values
        bounds = self.values if self.kind != "normal" else self.within or self.values[:1]
        return tuple(map(float, bounds))  # as they are drawn, also between whole numbers


@dataclass(frozen=True)
class Varied:
    """One name that varies, e.g. "damper.sigma_a", and what it is drawn from.

    `place` says where the value goes: "parameter" of a component, "building" for a number of a
    building's data, "scenario" for what the scenario must be read anew for (records, steps, FMUs).
    """

    name: str
    distribution: Distribution
    place: str = "parameter"


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


MOST_RUNS = 10_000_000


@dataclass(frozen=True)
class EnsemblePlan:
    """A checked ensemble.

    Attributes
    ----------
    file : Path
        The ensemble file.
    system : System
        What is varied.
    engine : str
        "compiled" or "fmu".
    runs, seed : int
    varied, outputs : tuple
    content : str
        Digest of the base scenario and of the files that it reads.
    identified : IdentifiedDraws, optional
        A component whose parameters are drawn together.
    fmus : str
        "python" or "native": which FMUs the engine "fmu" steps.
    """

    file: Path
    title: str
    system: System
    engine: str
    runs: int
    seed: int
    varied: tuple[Varied, ...]
    outputs: tuple[Statistic, ...]
    content: str = ""
    identified: IdentifiedDraws | None = None
    fmus: str = "python"

    def campaign(self) -> Campaign:
        """Return what makes its runs."""
        return Campaign(self.system, engine_of(self.engine, self.fmus), self.outputs, self)

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


def _values(value: object) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise EnsembleError(f"is {written(value)}: expected a list.")
    return tuple(value)


def _numbers(value: object) -> tuple[Any, ...]:
    if not all(isinstance(one, int | float) for one in _values(value)):
        raise EnsembleError("holds more than numbers: expected a list of numbers.")
    return _values(value)


IDENTIFIED = Spec({
    "model": Key(str, "", about="the folder of a study"), "component": Key(str, "damper"),
    "structure": Key(str, "structure"),
})  # fmt: skip
"""`[identified]` of an ensemble file."""

_SPEC = Spec({
    "title": Key(str, ""), "scenario": Key(str, about="the base: a stock scenario or a file"),
    "engine": Key(str, "compiled", choices=("compiled", "fmu")),
    "fmus": Key(str, "python", choices=FORMS),
    "runs": Key(int, 100, least=1, most=MOST_RUNS), "seed": Key(int, 1, least=0, most=2**62),
    "set": Spec(each=ANY),
    "vary": Spec(each=Spec({
        **dict.fromkeys(KINDS, Key(_values, None)), "within": Key(_numbers, None),
        "weights": Key(_numbers, ()),
    })),
    "outputs": Spec(each=Key([str], (), about=", ".join(STATISTICS))),
    "identified": IDENTIFIED,
})  # fmt: skip


def stock_ensembles() -> list[Path]:
    """Return the files of the stock ensembles, by name."""
    return sorted(files.ensembles_folder().glob("*.toml"))


def resolve_ensemble(name: str | Path) -> Path:
    """Return the path of an ensemble file, or of the stock ensemble of that name.

    Raises
    ------
    EnsembleError
        If neither is there; the text names the nearest.
    """
    path = Path(name)
    if path.is_file():
        return path.absolute()
    stock = {found.stem: found for found in stock_ensembles()}
    if len(path.parts) == 1 and path.name.removesuffix(".toml") in stock:
        return stock[path.name.removesuffix(".toml")].absolute()
    if path.is_dir():
        raise EnsembleError(f"{path}: is a folder; an ensemble is a TOML file.")
    hint = did_you_mean(path.stem, stock)
    raise EnsembleError(
        f'there is no ensemble file "{name}".{hint} Stock ensembles: {", ".join(stock)}.'
    )


def read_ensemble(name: str | Path, runs: int | None = None) -> EnsemblePlan:
    """Return the checked plan of an ensemble file; `runs` takes the place of the file's number.

    Parameters
    ----------
    name : the file, or the name of a stock ensemble
    runs : in place of the file's number

    Raises
    ------
    EnsembleError
        With every mistake of the file and its line.
    ScenarioError
        If the base scenario is wrong.
    """
    path = resolve_ensemble(name)
    return _Ensemble(path).plan(runs)


class _Ensemble:
    """One file, on its way to a plan."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.document = Document(path, EnsembleError)
        self.error = self.document.error
        self.given = self.document.read(_SPEC)

    def plan(self, runs: int | None) -> EnsemblePlan:
        given, engine = self.given, str(self.given["engine"])
        if given["fmus"] == "native" and engine != "fmu":
            self.error(("fmus",), 'fmus = "native" needs engine = "fmu": no other steps FMUs.')
        if runs is not None and not 1 <= runs <= MOST_RUNS:
            raise EnsembleError(f"--runs {runs}: expected 1 to {MOST_RUNS}.")
        fixed = {name: self._found(name, v) for name, v in given["set"].items()}
        if given["scenario"] is None:
            self.document.check()
        base = self._scenario(fixed)
        identified = self._identified(base)
        if identified is not None:
            fixed = {**identified.fixed, **fixed}
            base = self._scenario(fixed)
        varied = tuple(
            one
            for name, table in given["vary"].items()
            if (one := self._varied(name, table, base, engine)) is not None
        )
        varied = self._all_varied(varied, identified)
        if not varied and not self.document.found:
            self.error(("vary",), "nothing varies: [vary] names what does, and within what.")
        outputs = self._outputs(base)
        self.document.check()
        content = hashlib.sha256(scenario_text(base).encode())
        for file in _files_read(base, varied):
            content.update(file.read_bytes())
        return EnsemblePlan(
            self.path, given["title"] or base.title, base, engine, runs or given["runs"],
            given["seed"], varied, outputs, content.hexdigest()[:16], identified,
            given["fmus"],
        )  # fmt: skip

    def _identified(self, base: System) -> IdentifiedDraws | None:
        """Return what `[identified]` says, None where there is none or it is wrong."""
        if "identified" not in self.document.data or self.document.found:
            return None
        try:
            return read_identified(self.given["identified"], self.path.parent, base)
        except EnsembleError as error:
            self.error(("identified",), f"[identified]: {error}")
            return None

    def _all_varied(
        self, varied: tuple[Varied, ...], identified: IdentifiedDraws | None
    ) -> tuple[Varied, ...]:
        """Return what varies, the parameters that are drawn together first."""
        joint = identified.varied() if identified is not None else ()
        drawn = {one.name for one in joint}
        for table in ("vary", "set"):
            for name in self.given[table]:
                if plain_target(name) in drawn:
                    self.error(
                        (table, name),
                        f'"{name}" is drawn by [identified], so that a value here would have no '
                        f"effect; leave it out of [{table}].",
                    )
        return (*joint, *varied)

    def _scenario(self, fixed: Mapping[str, Value]) -> System:
        name = self.given["scenario"]
        beside = self.path.parent / name
        return load_scenario(resolve_scenario(beside if beside.is_file() else name), fixed)

    def _found(self, name: str, value: Any) -> Any:
        """Return a value, a file's name made absolute where it lies beside the ensemble file."""
        if name.rpartition(".")[2] in FILES and isinstance(value, str) and Path(value).suffix:
            beside = (self.path.parent / value).absolute()
            return str(beside) if beside.is_file() else value
        return value

    def _varied(self, name: str, table: dict[str, Any], base: System, engine: str) -> Varied | None:
        keys: KeyPath = ("vary", name)
        distribution = self._distribution(keys, name, table)
        if distribution is None:
            return None
        try:
            varied = Varied(name, distribution, place_of(name, base, engine))
            mistake = self._repeated(name) or _try(varied, base)
            mistake = mistake or _idle(varied, base, self.given["vary"])
        except EnsembleError as error:
            mistake = str(error)
        if mistake:
            self.error(keys, mistake)
            return None
        return varied

    def _repeated(self, name: str) -> str:
        """Return the words for a name that varies twice or is set as well; "" if it is neither."""
        names = list(self.given["vary"])
        before = names[: names.index(name)]
        twin = next((one for one in before if plain_target(one) == plain_target(name)), "")
        if twin:
            return f'"{name}" is "{twin}" once more; one of them must go.'
        if plain_target(name) in map(plain_target, self.given["set"]):
            return f'"{name}" is in [set] as well, where it would do nothing; one must go.'
        return ""

    def _distribution(self, keys: KeyPath, name: str, table: dict[str, Any]) -> Distribution | None:
        if not isinstance(written_keys := self.document.data["vary"][name], dict):
            return None
        kinds = [key for key in KINDS if table[key] is not None]
        if len(kinds) != 1:
            if not {*written_keys} - {"within", "weights"} or len(kinds) > 1:
                self.error(keys, f'"{name}" needs one of {", ".join(KINDS)}.')
            return None
        kind, within, weights = kinds[0], table["within"], table["weights"]
        values = tuple(self._found(name, item) for item in table[kind])
        wrong = ""
        for key, owner in (("within", "normal"), ("weights", "choice")):
            if key in written_keys and kind != owner:
                wrong = f"{key} goes with {owner}, not with {kind}."
        if within is not None and len(within) != 2:
            wrong = wrong or "within needs 2 numbers."
        if not wrong:
            distribution = Distribution(kind, values, within, weights)
            wrong = distribution.mistake()
        if wrong:
            self.error(keys, f'"{name}": {wrong}')
            return None
        return distribution

    def _outputs(self, base: System) -> tuple[Statistic, ...]:
        columns = {column.name: column for column in make_columns(base)}
        outputs = []
        for name, statistics in self.given["outputs"].items():
            keys: KeyPath = ("outputs", name)
            if name not in columns:
                self.error(keys, unknown("output", name, columns))
                continue
            if not statistics and not self.document.found:
                self.error(keys, f'"{name}" needs a list of {", ".join(STATISTICS)}.')
                continue
            for statistic in statistics:
                if statistic not in STATISTICS:
                    text = unknown("statistic", statistic, STATISTICS)
                    self.error(keys, f'"{name}": {text}')
                else:
                    outputs.append(Statistic(name, statistic, columns[name].unit or ""))
        if not outputs and not self.document.found:
            self.error(("outputs",), "nothing is kept: [outputs] names columns and statistics.")
        return tuple(dict.fromkeys(outputs))


def place_of(name: str, base: System, engine: str) -> str:
    """Return where the value of a name goes; see `Varied`.

    Raises
    ------
    EnsembleError
        If a building's data cannot be varied there.
    """
    component, rest = base.part(name)
    if component is not None and rest.startswith("building."):
        if engine != "compiled":
            raise EnsembleError(
                f'"{name}": a building\'s data varies only with engine = "compiled", because '
                "an FMU contains its building."
            )
        if component.path is not None or component.kind != "Structure":
            raise EnsembleError(f'"{name}": {component.name} is no Structure.')
        return "building"
    return "scenario" if is_read_anew(base, name) else "parameter"


def _try(varied: Varied, base: System) -> str:
    """Return the words for why a scenario cannot take what will be drawn, "" if it can."""
    component, rest = base.part(varied.name)
    if varied.place == "parameter" and component is not None:
        variable = component.description.variables[rest]
        if variable.causality not in ("parameter", "input"):
            return f'"{varied.name}" is not a parameter or input and cannot be set.'
    for value in varied.distribution.extremes():
        if varied.place == "parameter" and component is not None:
            fits = typed(variable, value)
            if isinstance(fits, Wrong):
                return f'"{varied.name}" {fits.words}'
            continue
        try:
            if varied.place == "scenario":
                load_scenario(base, {varied.name: value})
            else:
                base.with_values({varied.name: value})
        except TrustError:
            raise  # no mistake of the file, and it is asked about
        except BristleError as error:
            return f'"{varied.name}" = {written(value)}: {error}'
    return ""


def _idle(varied: Varied, base: System, all_varied: Collection[str]) -> str:
    """Return the words for why what is drawn would change nothing, "" if it does."""
    component, rest = base.part(varied.name)
    if component is None or varied.place != "parameter":
        return ""
    for wire in base.wires:
        if (wire.target, wire.input) == (component.name, rest):
            return (
                f'"{varied.name}" is fed by {wire.source}.{wire.output}, so that a value here '
                "would have no effect; vary what feeds it."
            )
    switch = f"{rest.rpartition('.')[0]}.on"
    on = switch not in component.description.variables or component.value(switch) is True
    if on or f"{component.name}.{switch}" in map(plain_target, all_varied):
        return ""
    return (
        f'"{varied.name}" does nothing while {component.name}.{switch} is false; '
        f'"{component.name}.{switch}" = true in [set] is right.'
    )


def _files_read(base: System, varied: tuple[Varied, ...]) -> list[Path]:
    """Return the files whose content decides the numbers: records, signals, buildings, own laws."""
    named: list[object] = []
    for component in base.components.values():
        named += [component.building, component.controller, component.path, *component.effects]
        named += [component.law.file] if component.law else []
        named += [component.values.get(key) for key in FILE_PARAMETERS]
    for one in varied:
        if one.name.rpartition(".")[2] in FILES:
            named += one.distribution.values
    folder = base.origin.parent if base.origin else Path()
    return sorted({folder / str(name) for name in named if name and (folder / str(name)).is_file()})


# A damper in an ensemble as a study has identified it: its parameters are drawn together.

_JOINT = "identified"


@dataclass(frozen=True)
class Places:
    """Where a scenario has the parameters of a model: its components for damper and structure.

    `bench`: whether the model was identified on a bench; `mass` the name of the structure's mass
    that moves with the damper's rod, "" where the scenario has no structure.
    """

    damper: str
    structure: str
    bench: bool
    mass: str = ""

    def of(self, name: str) -> str:
        """Return the scenario's name of a model's parameter, "" for one of an instrument."""
        effect, _, own = name.rpartition(".")
        if not effect:
            return f"{self.damper}.{own}"
        at = self.at(effect)
        if at == self.damper and own == EFFECTS[effect].mass and self.mass:
            return self.mass  # from differences of velocity it would diverge
        return f"{at}.{plain_name(effect)}.{own}" if at else ""

    def at(self, effect: str) -> str:
        """Return the component that has an effect of a model, "" for one of an instrument."""
        known = EFFECTS[effect]
        site = "damper" if self.bench and "damper" in known.sites else known.site
        return {"damper": self.damper, "structure": self.structure}.get(site, "")

    def of_effect(self, effect: str, values: Mapping[str, float]) -> dict[str, float]:
        """Return an effect's values and its switch by the names of the scenario.

        Parameters
        ----------
        effect : as a model has it
        values : by the model's names of its parameters
        """
        if not self.at(effect):
            return {}
        place = f"{self.at(effect)}.{plain_name(effect)}"
        found: dict[str, float] = {f"{place}.on": True}
        for name, value in values.items():
            found[self.of(name)] = value
            if self.of(name) == self.mass:
                found[f"{place}.{EFFECTS[effect].mass}"] = 0.0
        return found


@dataclass(frozen=True)
class IdentifiedDraws:
    """The parameters of a component that are drawn together.

    `names` of the scenario ("damper.sigma_a") with their values `centre` and bounds `low`, `high`
    in SI; `root` rows that make their errors of independent standard normal numbers; `fixed` what
    the model sets besides.
    """

    names: tuple[str, ...]
    centre: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    root: tuple[tuple[float, ...], ...]
    fixed: Mapping[str, Value]

    def draw(self, seed: int, run: int) -> dict[str, float]:
        """Return the values of a run, from its number and the seed alone."""
        count = len(self.root[0]) if self.root else 0
        normal = [NormalDist().inv_cdf(share(seed, run, f"{_JOINT} {k}")) for k in range(count)]
        drawn = np.array(self.centre) + np.array(self.root) @ np.array(normal)
        within = np.clip(drawn, self.low, self.high)
        return dict(zip(self.names, within.tolist(), strict=True))

    def varied(self) -> tuple[Varied, ...]:
        """Return the names as a plan lists what varies, each with its own error."""
        spread = np.linalg.norm(np.array(self.root), axis=1)
        return tuple(
            Varied(name, Distribution("normal", (centre, float(std)), (low, high)))
            for name, centre, std, low, high in zip(
                self.names, self.centre, spread, self.low, self.high, strict=True
            )
        )


def read_identified(table: Mapping[str, Any], beside: Path, base: System) -> IdentifiedDraws:
    """Return what `[identified]` of an ensemble file says.

    Parameters
    ----------
    table : as read
    beside : folder of the ensemble file
    base : its scenario

    Raises
    ------
    EnsembleError
        If a key is wrong, the model has no covariance, or the component lacks its parameters.
    StudyError
        If the model cannot be read.
    """
    folder, model = _model_of(table, beside)
    damper, structure = table["component"], table["structure"]
    there = base.components
    mass = f"{structure}.attached_mass" if structure in there else ""
    places = Places(damper, structure, not model.building, mass)
    fixed = _fixed(model, places)
    _refuse_others(fixed, base, model)
    if not has_covariance(model):
        raise EnsembleError(
            f"{folder}: its model has no covariance of the parameters to draw from. Identify it "
            f"again:  {command('identify', folder)}"
        )
    errors = joint_errors(model)
    names = [places.of(name) for name in errors.names]
    keep = [k for k, name in enumerate(names) if name]
    if not keep:
        raise EnsembleError(f"{folder}: no parameter of its damper was identified.")
    centre, low, high = (
        tuple(float(values[k]) for k in keep) for values in (errors.centre, errors.low, errors.high)
    )
    root = tuple(tuple(map(float, errors.root[k])) for k in keep)
    return IdentifiedDraws(tuple(names[k] for k in keep), centre, low, high, root, fixed)


def _model_of(table: Mapping[str, Any], beside: Path) -> tuple[Path, Model]:
    """Return the folder of the study that a table names, and its model."""
    if not table["model"]:
        words = 'model is missing: expected the folder of a study, as in model = "my_rig".'
        raise EnsembleError(words)
    path = beside / table["model"]
    folder = path if path.is_dir() else path.parent
    return folder, read_model(folder / "model.toml" if path.is_dir() else path)


def _fixed(model: Model, places: Places) -> dict[str, Value]:
    """Return all values of a model, and the switches of its effects, by a scenario's names.

    Not what follows a channel of the runs: the damper has it as an input.
    """
    values = model.values
    found: dict[str, Value] = {places.of(name): values[name] for name in values if "." not in name}
    for effect in model.effects:
        channels = {f"{effect}.{name}" for name in EFFECTS[effect].channels}
        own = {n: v for n, v in values.items() if n.startswith(f"{effect}.") and n not in channels}
        found |= places.of_effect(effect, own)
    return found


def _refuse_others(fixed: Mapping[str, Value], base: System, model: Model) -> None:
    """Refuse a scenario whose components lack the model's parameters."""
    there = base.components
    for full in fixed:
        name, _, rest = full.partition(".")
        if name not in there:
            raise EnsembleError(unknown("component", name, there))
        if rest not in there[name].description.variables:
            raise EnsembleError(
                f"the model's law is {model.law}, and {name} ({there[name].kind}) of the scenario "
                f"has no parameter {rest}. A scenario with a damper of that law is right."
            )
