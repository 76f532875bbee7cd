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
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from ..core import files
from ..core.config import ANY, Document, Key, Spec
from ..core.text import did_you_mean, unknown, written
from ..core.toml_lines import KeyPath
from ..engine.results import make_columns
from ..engine.run import FORMS
from ..errors import BristleError, EnsembleError, PhysicsError, TrustError
from ..system.overrides import FILE_PARAMETERS, FILES
from ..system.parameters import Wrong, typed
from ..system.scenario import Scenario, load_scenario, resolve_scenario
from ..system.toml import scenario_text
from .campaign import STATISTICS, Output, Plan, changed_building, plain_target, split
from .distributions import KINDS, Distribution, Value, Varied
from .identified import IDENTIFIED, Identified, read_identified

MOST_RUNS = 10_000_000


LEAST_RUNS = 4
"""Runs per effect that --with-limits needs at least."""


def _values(value: object) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise EnsembleError(f"is {written(value)}: expected a list.")
    return tuple(value)


def _numbers(value: object) -> tuple[Any, ...]:
    if not all(isinstance(one, int | float) for one in _values(value)):
        raise EnsembleError("holds more than numbers: expected a list of numbers.")
    return _values(value)


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


def read_ensemble(name: str | Path, runs: int | None = None, *, with_limits: bool = False) -> Plan:
    """Return the checked plan of an ensemble file; `runs` takes the place of the file's number.

    Parameters
    ----------
    name : the file, or the name of a stock ensemble
    runs : in place of the file's number
    with_limits : whether effects that the verdict of its `[identified]` does not exclude are drawn

    Raises
    ------
    EnsembleError
        With every mistake of the file and its line.
    ScenarioError
        If the base scenario is wrong.
    """
    path = resolve_ensemble(name)
    return _Ensemble(path).plan(runs, with_limits)


class _Ensemble:
    """One file, on its way to a plan."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.document = Document(path, EnsembleError)
        self.error = self.document.error
        self.given = self.document.read(_SPEC)

    def plan(self, runs: int | None, with_limits: bool = False) -> Plan:
        given, engine = self.given, str(self.given["engine"])
        if given["fmus"] == "native" and engine != "fmu":
            self.error(("fmus",), 'fmus = "native" needs engine = "fmu": no other steps FMUs.')
        if runs is not None and not 1 <= runs <= MOST_RUNS:
            raise EnsembleError(f"--runs {runs}: expected 1 to {MOST_RUNS}.")
        fixed = {name: self._found(name, v) for name, v in given["set"].items()}
        if given["scenario"] is None:
            self.document.check()
        base = self._scenario(fixed)
        identified = self._identified(base, with_limits)
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
        plan = Plan(
            self.path, given["title"] or base.title, base.file, engine, runs or given["runs"],
            given["seed"], varied, outputs, fixed, content.hexdigest()[:16], identified,
            given["fmus"],
        )  # fmt: skip
        _refuse_few(plan)
        return plan

    def _identified(self, base: Scenario, with_limits: bool) -> Identified | None:
        """Return what `[identified]` says, None where there is none or it is wrong."""
        if "identified" not in self.document.data:
            if with_limits:
                raise EnsembleError(
                    f"{self.path}: --with-limits needs [identified], with the study whose verdict "
                    "has the limits."
                )
            return None
        if self.document.found:
            return None
        try:
            return read_identified(
                self.given["identified"], self.path.parent, base, with_limits=with_limits
            )
        except EnsembleError as error:
            self.error(("identified",), f"[identified]: {error}")
            return None

    def _all_varied(
        self, varied: tuple[Varied, ...], identified: Identified | None
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

    def _scenario(self, fixed: Mapping[str, Value]) -> Scenario:
        name = self.given["scenario"]
        beside = self.path.parent / name
        return load_scenario(resolve_scenario(beside if beside.is_file() else name), fixed)

    def _found(self, name: str, value: Any) -> Any:
        """Return a value, a file's name made absolute where it lies beside the ensemble file."""
        if name.rpartition(".")[2] in FILES and isinstance(value, str) and Path(value).suffix:
            beside = (self.path.parent / value).absolute()
            return str(beside) if beside.is_file() else value
        return value

    def _varied(
        self, name: str, table: dict[str, Any], base: Scenario, engine: str
    ) -> Varied | None:
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

    def _outputs(self, base: Scenario) -> tuple[Output, ...]:
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
                    outputs.append(Output(name, statistic, columns[name].unit or ""))
        if not outputs and not self.document.found:
            self.error(("outputs",), "nothing is kept: [outputs] names columns and statistics.")
        return tuple(dict.fromkeys(outputs))


def _refuse_few(plan: Plan) -> None:
    """Refuse an ensemble with fewer runs than its effects need."""
    effects = len(plan.identified.left) if plan.identified is not None else 0
    if plan.runs < LEAST_RUNS * effects:
        raise EnsembleError(
            f"--with-limits draws {effects} effects in turn: {LEAST_RUNS * effects} runs or more "
            f"are right, and {plan.runs} are asked for."
        )


def place_of(name: str, base: Scenario, engine: str) -> str:
    """Return where the value of a name goes; see `Varied`.

    Raises
    ------
    EnsembleError
        If a building's data cannot be varied there.
    """
    component, rest = split(name, base)
    if component is not None and rest.startswith("building."):
        if engine != "compiled":
            raise EnsembleError(
                f'"{name}": a building\'s data varies only with engine = "compiled", because '
                "an FMU contains its building."
            )
        if component.path is not None or component.fmu != "Structure":
            raise EnsembleError(f'"{name}": {component.name} is no Structure.')
        return "building"
    if component is not None and rest not in FILES and rest in component.description.variables:
        return "parameter"
    return "scenario"


def _try(varied: Varied, base: Scenario) -> str:
    """Return the words for why a scenario cannot take what will be drawn, "" if it can."""
    component, rest = split(varied.name, base)
    for value in varied.distribution.extremes():
        if varied.place == "scenario":
            try:
                load_scenario(base.file, {**base.overrides, varied.name: value})
            except TrustError:
                raise  # no mistake of the file, and it is asked about
            except BristleError as error:
                return f'"{varied.name}" = {written(value)}: {error}'
            continue
        assert component is not None
        if varied.place == "building":
            try:
                changed_building(component, {rest.removeprefix("building."): value})
            except PhysicsError as error:
                return f'"{varied.name}" = {written(value)}: {error}'
            continue
        variable = component.description.variables[rest]
        if variable.causality not in ("parameter", "input"):
            return f'"{varied.name}" is not a parameter or input and cannot be set.'
        fits = typed(variable, value)
        if isinstance(fits, Wrong):
            return f'"{varied.name}" {fits.words}'
    return ""


def _idle(varied: Varied, base: Scenario, all_varied: Collection[str]) -> str:
    """Return the words for why what is drawn would change nothing, "" if it does."""
    component, rest = split(varied.name, base)
    if component is None or varied.place != "parameter":
        return ""
    for wire in base.connections:
        if (wire.target, wire.input) == (component.name, rest):
            return (
                f'"{varied.name}" is fed by {wire.source}.{wire.output}, so that a value here '
                "would have no effect; vary what feeds it."
            )
    switch = f"{rest.rpartition('.')[0]}.on"
    known = component.description.variables.get(switch)
    on = known is None or component.parameters.get(switch, known.start) is True
    if on or f"{component.name}.{switch}" in map(plain_target, all_varied):
        return ""
    return (
        f'"{varied.name}" does nothing while {component.name}.{switch} is false; '
        f'"{component.name}.{switch}" = true in [set] is right.'
    )


def _files_read(base: Scenario, varied: tuple[Varied, ...]) -> list[Path]:
    """Return the files whose content decides the numbers: records, signals, buildings, own laws."""
    named: list[object] = []
    for component in base.components:
        named += [component.building, component.controller, component.path, *component.effects]
        named += [component.law.file] if component.law else []
        named += [component.parameters.get(key) for key in FILE_PARAMETERS]
    for one in varied:
        if one.name.rpartition(".")[2] in FILES:
            named += one.distribution.values
    folder = base.file.parent
    return sorted({folder / str(name) for name in named if name and (folder / str(name)).is_file()})
