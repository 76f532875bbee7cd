"""The base of every component: what pythonfmu leaves out.

Units, bounds, dependencies and InitialUnknowns in the model description; a call order; faults that
never raise (an exception would poison the FMU's binary); the whole state in get, set and
serialise; outputs that follow their inputs as soon as these are set.

This module is bundled in every FMU: standard library and pythonfmu only.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from functools import wraps
from math import isfinite
from operator import itemgetter
from pathlib import Path
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from pythonfmu import (
    Boolean,
    DefaultExperiment,
    Fmi2Causality,
    Fmi2Initial,
    Fmi2Slave,
    Fmi2Variability,
    Integer,
    Real,
    String,
)
from pythonfmu.enums import Fmi2Status

from .. import units
from ..component import OVER_STEP
from ..version import __version__
from .binary import hold, reset_at_exit
from .model_description import (
    AUTHOR,
    COPYRIGHT,
    LICENSE,
    add_dependencies,
    complete,
    usual_size,
)

BAKED = "baked.json"
"""Name of the resource with what a build fixes: model name, start values, building."""

NOT_FINITE_INPUT, BAD_STEP, WRONG_MODE, BAD_STATE, BAD_PARAMETER = 1, 2, 3, 4, 5
FAULTS = {
    NOT_FINITE_INPUT: "an input is not finite",
    BAD_STEP: "the step is not positive or not finite",
    WRONG_MODE: "a step outside step mode",
    BAD_STATE: "a state or output is not finite or out of bounds",
    BAD_PARAMETER: "a parameter or record is wrong",
}

_INSTANTIATED, _INITIALISING, STEPPING, _TERMINATED = range(4)


def outermost(method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method that the binary calls, made safe against what it raises, as Ctrl-C does."""

    @wraps(method)
    def call(slave: Slave, *arguments: Any, **named: Any) -> Any:
        try:
            return method(slave, *arguments, **named)
        except BaseException:
            slave._hold()
            raise

    return call


class _Slot:
    """A variable as an attribute of the component; its value lives in the flat list."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, slave: Slave | None, _owner: Any = None) -> Any:
        if slave is None:
            return self
        return slave._values[slave._index[self.name]]

    def __set__(self, slave: Slave, value: Any) -> None:
        slave._values[slave._index[self.name]] = value


class Slave(Fmi2Slave):  # type: ignore[misc]
    """A component: declares its ports in `declare`, and fills three methods.

    `configure()` builds the model from the parameters, `advance(time, step)` moves it over one
    step, `refresh()` computes the outputs from inputs and state; `self.time` [s] is where the
    component stands. None of them returns a status: what they raise becomes a fault, with the
    outputs held at their last finite values.

    `get_inner` and `set_inner` hand out and take back the model's state, made of lists, numbers and
    texts.
    """

    guid: Any
    fault: int
    icon: ClassVar[str] = "component"
    """Which of bristle's icons tools show."""
    changes: ClassVar[str] = "continuous"
    """How Real outputs change: "continuous", or "discrete" where they stand between instants."""

    def __init__(self, baked: dict[str, Any] | None = None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        if "visible" in kwargs:  # from the FMU's binary
            reset_at_exit()
        self._values: list[Any] = []
        self._index: dict[str, int] = {}
        self._units: dict[str, str] = {}
        self._bounds: dict[str, tuple[float | None, float | None, float | None]] = {}
        self._depends: dict[str, tuple[str, ...]] = {}
        self._optional: list[str] = []
        self._over_step: dict[str, str] = {}
        self._jumps: dict[str, str] = {}
        self._inputs: list[int] = []
        self._outputs: list[int] = []
        self._parameters: set[int] = set()
        self._words: dict[int, tuple[str, ...]] = {}
        self._set: set[int] = set()
        self._mode = _INSTANTIATED
        self._stale = True
        self._unbuilt = True
        self._warned: set[str] = set()
        self.time = 0.0
        self.baked = self._read_baked() if baked is None else baked
        self.modelName = self.baked.get("name", type(self).__name__)
        self.guid = self.baked.get("guid", self.guid)
        self.default_experiment = DefaultExperiment(
            start_time=0.0, stop_time=10.0, step_size=self.baked.get("step", 0.002)
        )
        self.author, self.copyright, self.license = AUTHOR, COPYRIGHT, LICENSE
        self.version = __version__
        self.description = (type(self).__doc__ or "").strip().split("\n")[0]
        self.declare()
        text = "0, or why the component stopped: 1 input, 2 step, 3 mode, 4 state, 5 parameter"
        self.add_output("fault", None, text)
        # All Real outputs in one call; `fault` stands twice behind them, for it must give a tuple.
        fault = self._index["fault"]
        self._shown = itemgetter(*self._outputs, fault, fault)
        for name, value in self.baked.get("starts", {}).items():
            index = self._index[name]
            self._values[index] = value
            if index in self._inputs:  # the build sets it as a host would: it is measured
                self._set.add(index)

    def _hold(self) -> None:
        """Keep alive what the binary lets go of as an exception passes it."""
        hold(self, type(self), self.log_queue)

    # -- what a component fills in

    def declare(self) -> None:
        """Declare inputs, outputs and parameters."""
        raise NotImplementedError

    def configure(self) -> None:
        """Build the model from the parameters; raise what is wrong with them."""

    def advance(self, time: float, step: float) -> None:
        """Move the model from `time` [s] over `step` [s]."""

    def refresh(self) -> None:
        """Compute the outputs from inputs and state, without moving the model."""

    def get_inner(self) -> Any:
        """Return a copy of the model's state."""
        return None

    def set_inner(self, state: Any) -> None:
        """Take a copy of the model's state."""

    # -- declaring

    def add_input(
        self,
        name: str,
        unit: str,
        text: str,
        *,
        over_step: str,
        start: float = 0.0,
        optional: bool = False,
    ) -> None:
        """Declare a Real input.

        Parameters
        ----------
        name, unit, text : its name, unit and description
        over_step : how it is taken over a step, one of `component.OVER_STEP`
        start : value that it has until it is set, in its unit
        optional : whether it may stay unconnected
        """
        if over_step not in OVER_STEP:
            raise TypeError(f"{name}: {over_step!r} is none of {', '.join(OVER_STEP)}.")
        self._over_step[name] = over_step
        if optional:
            self._optional.append(name)
        variable = Real(
            name, causality=Fmi2Causality.input, variability=Fmi2Variability.continuous,
            description=text,
        )  # fmt: skip
        self._inputs.append(self._add(variable, float(start), unit))

    def add_output(
        self,
        name: str,
        unit: str | None,
        text: str,
        *,
        depends: Iterable[str] = (),
        bounds: tuple[float | None, float | None] = (None, None),
        nominal: float | None = None,
        jumps_without: str = "",
    ) -> None:
        """Declare an output: Real, or Integer without a unit.

        Parameters
        ----------
        name, text : its name and description
        unit : of a Real one; None: it is an Integer
        depends : names of the inputs that it follows as soon as they are set
        bounds : lowest and highest value in its unit, None: no bound
        nominal : usual size in its unit, None: not said
        jumps_without : an input; while that is not connected the output may jump from one time to
            the next, and cannot be told ahead
        """
        common = {
            "causality": Fmi2Causality.output,
            "description": text,
            "initial": Fmi2Initial.calculated,
        }
        if unit is None:
            variable = Integer(name, variability=Fmi2Variability.discrete, **common)
        else:
            variable = Real(name, variability=Fmi2Variability[self.changes], **common)
        if jumps_without:
            self._jumps[name] = jumps_without
        self._depends[name] = tuple(depends)
        self._bounds[name] = (bounds[0], bounds[1], nominal)
        index = self._add(variable, 0 if unit is None else 0.0, unit)
        if unit is not None:
            self._outputs.append(index)

    def add_parameter(
        self,
        name: str,
        value: Any,
        unit: str | None,
        text: str,
        bounds: tuple[float | None, float | None] = (None, None),
        words: Iterable[str] = (),
    ) -> None:
        """Declare a fixed parameter, of the type of its value.

        Parameters
        ----------
        name, text : its name and description
        value : start value in its unit: a float, int, bool or str
        unit : None: it has none
        bounds : lowest and highest value in its unit, None: no bound; not for a bool or str
        words : among which a str chooses, none: it is any text
        """
        common = {
            "causality": Fmi2Causality.parameter,
            "variability": Fmi2Variability.fixed,
            "description": text,
        }
        kind = {bool: Boolean, int: Integer, str: String}.get(type(value), Real)
        if kind in (Real, Integer):
            self._bounds[name] = (bounds[0], bounds[1], None)
        index = self._add(kind(name, **common), value, unit)
        self._parameters.add(index)
        if words:
            self._words[index] = tuple(words)

    def _add(self, variable: Any, value: Any, unit: str | None) -> int:
        name = variable.name
        if name in self._index:
            raise TypeError(f"{type(self).__name__}: {name!r} is declared twice.")
        index = len(self._values)
        self._values.append(value)
        self._index[name] = index
        if unit:
            self._units[name] = units.canonical(unit)
        if isinstance(variable, Real):
            low, high, nominal = self._bounds.get(name, (None, None, None))
            self._bounds[name] = (low, high, nominal or usual_size(self._units.get(name), value))
        if name.isidentifier():
            if not isinstance(getattr(type(self), name, _Slot(name)), _Slot):
                raise TypeError(f"{type(self).__name__}: {name!r} is taken.")
            setattr(type(self), name, _Slot(name))
        variable.getter = lambda: self._values[index]
        variable.setter = lambda value: self._put(index, value)
        self.register_variable(variable, nested=False)
        return index

    def __getitem__(self, name: str) -> Any:
        """Return the value of a variable by its full name ("gas_spring.k")."""
        return self._values[self._index[name]]

    # -- the life of an instance

    @outermost
    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Take the start time [s]; neither stop time nor tolerance matters here."""
        self.time = start_time
        self._stale = True

    @outermost
    def enter_initialization_mode(self) -> None:
        """Begin the initialisation: once, until the instance is reset."""
        if self._mode != _INSTANTIATED:
            self._stop(WRONG_MODE, "initialisation entered twice; reset the instance first.")
            return
        self._mode = _INITIALISING

    @outermost
    def exit_initialization_mode(self) -> None:
        """Build the model from its parameters and show the first outputs; steps may follow."""
        if self._mode != _INITIALISING:
            self._stop(WRONG_MODE, "initialisation left without being entered.")
            return
        self._unbuilt = self._stale = True
        self._follow(final=True)
        self._mode = STEPPING

    @outermost
    def terminate(self) -> None:
        """End the run; the last values can still be read."""
        self._mode = _TERMINATED

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Step from `current_time` [s] over `step_size` [s]; False, with a fault, if it cannot."""
        try:
            if self.fault:
                return False
            if self._mode != STEPPING:
                return self._stop(
                    WRONG_MODE, "doStep belongs between initialisation and terminate."
                )
            if not (step_size > 0.0 and isfinite(step_size) and isfinite(current_time)):
                return self._stop(BAD_STEP, f"time {current_time!r} s, step {step_size!r} s.")
            values = self._values
            for index in self._inputs:
                if not isfinite(values[index]):
                    return self._stop(
                        NOT_FINITE_INPUT, f"{self.vars[index].name} = {values[index]!r}."
                    )
            held = self._shown(values)
            before = self.time
            self.time = current_time + step_size
            try:
                self.advance(current_time, step_size)
                self.refresh()
                wrong = self._not_finite()
            except Exception as error:  # an exception would poison the binary: it becomes a fault
                wrong = f"{type(error).__name__}: {error}"
            if wrong:
                for index, value in zip(self._outputs, held):
                    values[index] = value
                self.time = before
                return self._stop(BAD_STATE, wrong)
            self._stale = False
            return True
        except BaseException:
            self._hold()
            raise

    def _not_finite(self) -> str:
        values = self._values
        if isfinite(sum(self._shown(values))):
            return ""
        names = [self.vars[i].name for i in self._outputs if not isfinite(values[i])]
        return "not finite: {}.".format(", ".join(names) or "the sum of the outputs")

    def _stop(self, code: int, text: str) -> bool:
        if not self.fault:
            self.fault = code
            said = f"{self.instance_name}: fault {code}, {FAULTS[code]}: {text}"
            self.log(said, Fmi2Status.discard)
        return False

    def log(self, msg: str, status: Any = Fmi2Status.ok, *more: Any) -> None:
        """Log a message as it stands."""
        # Hosts take a message for the format of a printf: a "%s" in a path would read wild memory.
        super().log(msg.replace("%", "%%"), status, *more)

    def warn_once(self, text: str) -> None:
        """Log a warning, the first time only."""
        if text not in self._warned:
            self._warned.add(text)
            self.log(f"{self.instance_name}: {text}", Fmi2Status.warning)

    def _follow(self, final: bool = False) -> None:
        """Bring the outputs up to date with inputs, parameters and state."""
        self._stale = False
        if self.fault or self._mode == _TERMINATED:
            return
        values = self._values
        held = self._shown(values)
        try:
            if self._unbuilt:
                self._check_parameters()
                self.configure()
                self._unbuilt = False
            for index in self._inputs:
                if not isfinite(values[index]):
                    break
            else:
                self.refresh()
            wrong = self._not_finite()
        except Exception as error:  # an exception would poison the binary: it becomes a fault
            wrong = f"{error}" or type(error).__name__
        if wrong:
            for index, value in zip(self._outputs, held):
                values[index] = 0.0 if final else value
            if final:
                self._stop(BAD_PARAMETER, wrong)

    def _check_parameters(self) -> None:
        for index in self._parameters:
            name, value = self.vars[index].name, self._values[index]
            low, high, _ = self._bounds.get(name, (None, None, None))
            if isinstance(value, float) and not isfinite(value):
                raise ValueError(f"{name} = {value!r} is not finite.")
            if (low is not None and value < low) or (high is not None and value > high):
                raise ValueError(f"{name} = {value!r} lies outside [{low!r}, {high!r}].")

    # -- values in and out

    def _put(self, index: int, value: Any) -> None:
        if index in self._parameters:
            if self._mode in (STEPPING, _TERMINATED):
                if value != self._values[index]:
                    kept = f"{self.vars[index].name} keeps {self._values[index]!r}"
                    self.warn_once(f"{kept}: it is fixed after initialisation.")
                return
            self._unbuilt = True
        elif index not in self._inputs:
            self.warn_once(f"{self.vars[index].name} cannot be set.")
            return
        self._values[index] = value
        self._set.add(index)
        self._stale = True

    def _known(self, vrs: list[int]) -> list[int]:
        """Return the references with unknown ones replaced by `fault`'s, and say so."""
        if all(0 <= vr < len(self._values) for vr in vrs):
            return vrs
        self.warn_once(f"no variable has one of the value references {list(vrs)}.")
        return [vr if 0 <= vr < len(self._values) else self._index["fault"] for vr in vrs]

    def _converted(self, vrs: list[int], kind: type) -> list[Any]:
        """Return values as another type than the variables have, with a warning.

        Hosts read Integers as Reals, and the like. An exception would poison the binary: what is
        no number is 0, and an unknown variable has the value of `fault`.
        """
        self._known(vrs)
        found = []
        for vr in vrs:
            there = 0 <= vr < len(self._values)
            value = self._values[vr if there else self._index["fault"]]
            alike = isinstance(value, kind) and isinstance(value, bool) == (kind is bool)
            if there and not alike:
                self.warn_once(
                    f"{self.vars[vr].name} is not of type {kind.__name__}: its value is converted."
                )
            try:
                found.append(kind() if isinstance(value, str) and kind is not str else kind(value))
            except (ValueError, OverflowError):
                found.append(kind())
        return found

    def _get(self, vrs: list[int], kind: type) -> list[Any]:
        try:
            if self._stale:
                self._follow()
            values = self._values
            try:
                found = [values[vr] for vr in vrs]
            except IndexError:
                return self._converted(vrs, kind)
            return found if {*map(type, found)} <= {kind} else self._converted(vrs, kind)
        except BaseException:
            self._hold()
            raise

    def get_real(self, vrs: list[int]) -> list[float]:
        """Return the values of Real variables by their references."""
        return self._get(vrs, float)

    def get_integer(self, vrs: list[int]) -> list[int]:
        """Return the values of Integer variables by their references."""
        return self._get(vrs, int)

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Return the values of Boolean variables by their references."""
        return self._get(vrs, bool)

    def get_string(self, vrs: list[int]) -> list[str]:
        """Return the values of String variables by their references."""
        return self._get(vrs, str)

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Real variables by their references."""
        try:
            if self._mode == STEPPING:
                inputs, store = self._inputs, self._values
                for vr, value in zip(vrs, values):
                    if vr in inputs:
                        store[vr] = value
                        self._set.add(vr)
                    else:
                        self._set_any([vr], [value], float)
                self._stale = True
            else:
                self._set_any(vrs, values, float)
        except BaseException:
            self._hold()
            raise

    @outermost
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Set Integer variables by their references."""
        self._set_any(vrs, values, int)

    @outermost
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Set Boolean variables by their references."""
        self._set_any(vrs, values, bool)

    @outermost
    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Set String variables by their references."""
        self._set_any(vrs, values, str)

    def _set_any(self, vrs: list[int], values: Iterable[Any], kind: type) -> None:
        for vr, value in zip(vrs, values):
            if not 0 <= vr < len(self._values):
                self.warn_once(f"no variable has the value reference {vr}.")
            elif type(self._values[vr]) is not kind:
                self.warn_once(f"{self.vars[vr].name} is not of type {kind.__name__}.")
            else:
                self._put(vr, kind(value))

    # -- the whole state

    @outermost
    def _get_fmu_state(self) -> dict[str, Any]:
        if self._stale:
            self._follow()
        return {
            "values": list(self._values),
            "set": sorted(self._set),
            "mode": self._mode,
            "time": self.time,
            "unbuilt": self._unbuilt,
            "warned": sorted(self._warned),
            "inner": None if self._unbuilt else self.get_inner(),
        }

    @outermost
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            self._take(state)
        except Exception as error:  # an exception would poison the binary: it becomes a fault
            self.fault = 0
            self._stop(BAD_STATE, f"the state cannot be set: {error!r}")

    def _take(self, state: dict[str, Any]) -> None:
        parameters = [] if self._unbuilt else self._fixed()
        if [type(value) for value in state["values"]] != [type(value) for value in self._values]:
            raise ValueError("it is not one of this FMU.")
        self._values[:] = state["values"]
        self._set = set(state["set"])
        self._mode = state["mode"]
        self.time = state["time"]
        self._warned = set(state["warned"])
        self._unbuilt = state["unbuilt"]
        self._stale = self._unbuilt
        if self._unbuilt:
            return
        if parameters != self._fixed():  # a state of another instance, or from before a reset
            outputs = list(self._values)
            self.configure()
            self._values[:] = outputs
        self.set_inner(state["inner"])

    def _fixed(self) -> list[Any]:
        """Return the values of the parameters."""
        return [self._values[index] for index in sorted(self._parameters)]

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        try:
            found = json.loads(state.decode("utf-8"))
        except ValueError:
            found = None
        return found if isinstance(found, dict) else {"values": []}

    # -- the model description

    def to_xml(self, model_options: dict[str, str] | None = None) -> Element:
        """Return pythonfmu's description with what it leaves out."""
        self._follow()
        root: Element = super().to_xml(model_options or {})
        complete(root, self)
        structure = root.find("ModelStructure")
        assert structure is not None
        self._structure(structure)
        return root

    def _structure(self, structure: Element) -> None:
        """Say which inputs every output follows, and what its start value follows."""
        parameters = sorted(index + 1 for index in self._parameters)
        add_dependencies(structure, self._inputs_of, parameters)

    def _inputs_of(self, number: int) -> list[int]:
        """Return the numbers, from 1, of the inputs that an output follows at once."""
        name = self.vars[number - 1].name
        return sorted(self._index[other] + 1 for other in self._depends[name])

    def _read_baked(self) -> dict[str, Any]:
        path = Path(self.resources or ".") / BAKED
        return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}

    def resource(self, name: str) -> Path:
        """Return the path of a file that was bundled with the component, or stands for one."""
        given = self.baked.get("files", {}).get(name)
        return Path(given or Path(self.resources or ".") / name)
