"""What every built-in FMU says of itself, and how it behaves: outputs, state, faults."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from built import COMPONENTS, DAMPERS, SITES, built, lively
from fmpy import read_model_description
from fresh import fresh
from kinds import ONE_OF_EACH

from bristle import units
from bristle.fmu import build, catalogue
from bristle.physics.effect import effects_of
from bristle.physics.laws import LAWS

CONTROLLERS = ["ClippedOptimal", "HinfInverse", "Lpv", "LqgClipped", "Skyhook", "TrainedPolicy"]
each_component = pytest.mark.parametrize("component", COMPONENTS)
each_damper = pytest.mark.parametrize("component", DAMPERS)

# What a host can do wrong is tried on all components by `bristle conform` (tests/conformance); here
# on one of each slave class, with every effect on.

# Names, units and order of the ports: other tools hold on to them.
DAMPER_INPUTS = {
    "displacement": "m",
    "velocity": "m/s",
    "voltage": "V",
    "holding_force": "N",
    "acceleration": "m/s2",
}
DAMPER_OUTPUTS = {"force": "N", "dissipated_energy": "J", "stroke_ratio": "1"}
MEASURED = {
    "floor_acceleration": "m/s2",
    "base_displacement": "m",
    "base_velocity": "m/s",
    "damper_force": "N",
}
CONTROLLER_PARAMETERS = {
    "v_max": 8.0,
    "velocity": "direct",
    "velocity_corner": 18.0,
    "sample_period": 0.002,
}
FAULTLESS = {"gain": 1.0, "bias": 0.0, "noise_density": 0.0, "quantisation": 0.0} | {
    "delay": 0.0,
    "cut_off": 0.0,
}
LEVELS = ("base", "floor1", "floor2")
INPUTS: dict[str, dict[str, str]] = {
    "Structure": {"ground_acceleration": "m/s2", "damper_force": "N", "extra_force": "N"},
    **dict.fromkeys(DAMPERS, DAMPER_INPUTS),
    "GroundMotion": {},
    "ConstantVoltage": {},
    "SignalSource": {},
    "PrescribedMotion": {},
    "Sensors": MEASURED,
    **dict.fromkeys(CONTROLLERS, MEASURED),
}
OUTPUTS: dict[str, dict[str, str | None]] = {
    "Structure": {
        **{f"{level}_displacement": "m" for level in LEVELS},
        **{f"{level}_velocity": "m/s" for level in LEVELS},
        **{f"{level}_acceleration_absolute": "m/s2" for level in LEVELS},
        "drift1": "m",
        "drift2": "m",
        "holding_force": "N",
    },
    **dict.fromkeys(DAMPERS, DAMPER_OUTPUTS),
    "GroundMotion": {"ground_acceleration": "m/s2"},
    "ConstantVoltage": {"voltage": "V"},
    "SignalSource": {"value": None},
    "PrescribedMotion": {"displacement": "m", "velocity": "m/s"},
    "Sensors": {f"{name}_measured": unit for name, unit in MEASURED.items()},
    **{name: {"voltage": "V", "command_raw": "N", "scheduling": "m/s"} for name in CONTROLLERS},
    "Lpv": {"voltage": "V", "command_raw": "V", "scheduling": "m/s"},
    "TrainedPolicy": {"voltage": "V", "command_raw": "V", "scheduling": "m/s"},
}
PARAMETERS: dict[str, dict[str, Any]] = {
    "Structure": {"attached_mass": 0.0},
    **{
        component: {"stroke": 0.02, "v_max": 8.0, "moving_mass": 0.0}
        | {f"{state}_0": 0.0 for state in LAWS[law].states}
        for component, law in DAMPERS.items()
    },
    "GroundMotion": {"record": "el_centro_1940_ns", "peak": 0.0, "factor": 1.0, "start": 0.0},
    "ConstantVoltage": {"level": 4.0},
    "SignalSource": {"kind": "constant", "level": 0.0},
    "PrescribedMotion": {"kind": "constant", "level": 0.0},
    "Sensors": {"sample_period": 0.002, "seed": 1}
    | {f"{name}.{key}": value for name in MEASURED for key, value in FAULTLESS.items()},
    "ClippedOptimal": {**CONTROLLER_PARAMETERS, "f_min": 0.5},
    "LqgClipped": {**CONTROLLER_PARAMETERS, "f_min": 0.5},
    "TrainedPolicy": {**CONTROLLER_PARAMETERS},
    "HinfInverse": {**CONTROLLER_PARAMETERS, "inverse": "lugre", "anti_windup": 0.0},
    "Lpv": {**CONTROLLER_PARAMETERS, "anti_windup": 200.0},
    "Skyhook": {**CONTROLLER_PARAMETERS, "kind": "switch", "gain": 50.0, "inverse": "lugre"},
}


# -- what the description says


@cache
def description_of(component: str) -> Any:
    """Return what fmpy reads, which raises an error for all that its validator finds."""
    whole = {"validate_variable_names": True, "validate_model_structure": True}
    return read_model_description(str(built(component)), **whole)


def variables(component: str) -> dict[str, Any]:
    return {variable.name: variable for variable in description_of(component).modelVariables}


def test_the_components_are_those_listed() -> None:
    assert set(COMPONENTS) == set(INPUTS) == set(OUTPUTS)


@each_component
def test_ports_parameters_and_units_are_those_listed(component: str) -> None:
    found = variables(component)
    inputs = {n: v.unit for n, v in found.items() if v.causality == "input"}
    outputs = {n: v.unit for n, v in found.items() if v.causality == "output"}
    assert inputs == INPUTS[component]
    assert outputs == {**OUTPUTS[component], "fault": None}
    assert (found["fault"].type, found["fault"].variability) == ("Integer", "discrete")
    for name, value in PARAMETERS[component].items():
        assert type(value)(found[name].start) == value
        assert (found[name].causality, found[name].variability) == ("parameter", "fixed")
    defined = {unit.name: unit.baseUnit for unit in description_of(component).unitDefinitions}
    assert {v.unit for v in found.values() if v.unit} == set(defined)
    for name, base in defined.items():
        unit = units.parse(name)
        assert units.canonical(name) == name
        exponents = tuple(getattr(base, symbol) or 0 for symbol in units.DIMENSIONS)
        assert exponents == unit.dimension
        assert base.factor in (None, unit.factor)


@pytest.mark.parametrize("component", SITES)
def test_every_effect_offers_its_switch_and_its_parameters(component: str) -> None:
    found = variables(component)
    effects = effects_of(*SITES[component])
    assert effects
    for effect in effects:
        switch = found[f"{effect.name}.on"]
        assert (switch.type, switch.start) == ("Boolean", "false")
        assert switch.description == effect.first_line()
        for name, parameter in effect.parameters.items():
            variable = found[f"{effect.name}.{name}"]
            assert float(variable.start) == parameter.value
            assert variable.unit == parameter.unit
            assert (float(variable.min), float(variable.max)) == parameter.bounds
            assert variable.description == parameter.text
        for name, unit in effect.states.items():
            assert found[f"{effect.name}.{name}_0"].unit == unit


@each_damper
def test_parameters_of_the_law_carry_unit_and_bounds(component: str) -> None:
    found = variables(component)
    law = SITES[component][1]
    for name, parameter in LAWS[law].parameters.items():
        assert float(found[name].start) == parameter.value
        assert found[name].unit == parameter.unit
        assert (float(found[name].min), float(found[name].max)) == parameter.bounds
    assert float(found["force"].nominal) == 10.0


@each_component
def test_every_output_is_an_initial_unknown_with_its_dependencies(component: str) -> None:
    description = description_of(component)
    outputs = {unknown.variable.name: unknown for unknown in description.outputs}
    unknowns = {unknown.variable.name: unknown for unknown in description.initialUnknowns}
    assert set(outputs) == set(unknowns) == {*OUTPUTS[component], "fault"}
    for name, unknown in unknowns.items():
        direct = {v.name for v in outputs[name].dependencies}
        known = {v.name for v in unknown.dependencies}
        assert direct <= set(INPUTS[component])
        assert direct <= known
        assert set(PARAMETERS[component]) <= known


@each_component
def test_capabilities_and_guid_and_the_catalogue_that_describes_it_without_an_fmu(
    component: str,
) -> None:
    description = description_of(component)
    able = description.coSimulation
    assert able.canGetAndSetFMUstate
    assert able.canSerializeFMUstate
    assert able.canHandleVariableCommunicationStepSize
    assert able.needsExecutionTool
    assert not able.canBeInstantiatedOnlyOncePerProcess
    assert description.guid == build.plan(component).guid()
    assert description.variableNamingConvention == "structured"
    found, described = variables(component), catalogue.describe(component).variables
    assert list(described) == list(found)
    for name, variable in described.items():
        other = found[name]
        assert (variable.kind, variable.causality) == (other.type, other.causality)
        assert (variable.unit, variable.reference) == (other.unit, other.valueReference)
        bounds = [None if one is None else float(one) for one in (other.min, other.max)]
        assert [variable.minimum, variable.maximum] == bounds, name


# -- outputs follow inputs


@fresh
def follow(path: str, cases: list[dict[str, Any]]) -> list[tuple[str, str]]:
    """Return the pairs of output and input where setting the input alone moved the output."""
    from live import OK, Fmu

    moved = set()
    for i, values in enumerate(cases):
        with Fmu(path, f"number {i}") as fmu:
            fmu.begin(values)
            for k in range(30):
                for j, name in enumerate(fmu.names("input")):
                    before = fmu.outputs()
                    scale = {"displacement": 0.01, "velocity": 0.2, "voltage": 4.0}.get(name, 2.0)
                    # At times the rod stands still: only then a holding force is felt.
                    value = scale * ((k * (3 + j)) % 7 - 2.5) * (name != "velocity" or k % 3 > 0)
                    assert fmu.set({name: value}) == OK
                    after = fmu.outputs()
                    moved |= {(output, name) for output in after if after[output] != before[output]}
                assert fmu.step(0.002) == OK, fmu.said
            assert fmu.outputs() == fmu.outputs()
    return sorted(moved)


@pytest.mark.parametrize(
    "component",
    [
        # Half a second each: a building, laws with and without states, and one without a command.
        name
        if name in ("Structure", "BinghamDamper", "LuGreDamper", "FluidViscousDamper")
        else pytest.param(name, marks=pytest.mark.slow)
        for name in ("Structure", *DAMPERS)
    ],
)
def test_dependencies_are_what_is_seen(component: str) -> None:
    description = description_of(component)
    said = {(u.variable.name, v.name) for u in description.outputs for v in u.dependencies}
    cases: list[dict[str, Any]] = [{}]
    cases += [{f"{effect.name}.on": True} for effect in effects_of(*SITES[component])]
    if component == "BinghamDamper":
        cases.append({"moving_mass": 2.0})
    seen = {tuple(pair) for pair in follow(built(component), cases)}
    assert seen <= said
    # No effect needs the acceleration yet, and bristles need no holding.
    reserved = {("force", "acceleration")} | (
        {("force", "holding_force")}
        if component in DAMPERS and not LAWS[DAMPERS[component]].has("sign")
        else set()
    )
    # A law with a lag of its own follows the voltage later, one without a command not at all.
    law = LAWS[DAMPERS[component]] if component in DAMPERS else None
    if law is not None and law.felt:
        reserved |= {("force", "voltage")}
    if law is not None and not law.has("command"):
        reserved |= {("force", "voltage"), ("dissipated_energy", "voltage")}
    # The energy has the force times velocity at the end: nothing of it at rest.
    reserved |= {("dissipated_energy", name) for _, name in reserved if name != "voltage"}
    reserved |= {("dissipated_energy", "holding_force")} if component in DAMPERS else set()
    assert said - seen <= reserved


@fresh
def initial(path: str, record: str) -> list[Any]:
    from live import OK, Fmu

    with Fmu(path) as fmu:
        found = [fmu.get("ground_acceleration")]
        assert fmu.set({"record": record}) == OK
        found.append(fmu.get("ground_acceleration"))
        assert fmu.call("setupExperiment", startTime=0.5) == OK
        found.append(fmu.get("ground_acceleration"))
        assert fmu.call("enterInitializationMode") == OK
        assert fmu.set({"factor": 3.0}) == OK
        found.append(fmu.get("ground_acceleration"))
        assert fmu.call("exitInitializationMode") == OK
        found.append(fmu.get("ground_acceleration"))
        assert fmu.set({"factor": 5.0}) == OK
        found += [fmu.get("ground_acceleration"), fmu.get("factor")]
        assert fmu.step(0.25, time=0.5) == OK
        return [*found, fmu.get("ground_acceleration"), fmu.said]


def test_parameters_take_effect_until_initialisation_ends(tmp_path: Path) -> None:
    record = tmp_path / "ramp.csv"
    record.write_text("time [s],acceleration [m/s2]\n0,1\n1,2\n2,3\n", encoding="utf-8")
    *found, said = initial(built("GroundMotion"), str(record))
    assert found[1:] == [1.0, 1.5, 4.5, 4.5, 4.5, 3.0, 5.25]
    assert len(said) == 1
    assert "factor keeps 3.0: it is fixed after initialisation" in said[0]


@fresh
def at_zero(path: str, values: dict[str, Any]) -> dict[str, Any]:
    from live import Fmu

    with Fmu(path) as fmu:
        return fmu.begin(values).outputs()


def test_outputs_have_values_before_the_first_step() -> None:
    motion = {"kind": "sine", "amplitude": 0.01, "frequency": 2.0, "phase": 0.0, "offset": 0.003}
    found = at_zero(built("PrescribedMotion"), motion)
    assert found["displacement"] == 0.003
    assert found["velocity"] == pytest.approx(0.01 * 4.0 * math.pi, rel=1e-14)
    damper = {"displacement": 0.01, "velocity": 0.1, "voltage": 8.0}
    found = at_zero(built("BinghamDamper"), damper)
    assert found["force"] == pytest.approx(8.115186622, abs=1e-9)
    assert found["stroke_ratio"] == 0.5
    found = at_zero(built("LuGreDamper"), {**damper, "bristle_deflection_0": 0.002})
    assert found["force"] == pytest.approx(8.115186622, abs=1e-9)
    found = at_zero(built("Structure"), {"ground_acceleration": 2.0, "damper_force": 3.0})
    assert found["base_acceleration_absolute"] == pytest.approx(-3.0 / 1.96935633694460)
    assert found["holding_force"] == pytest.approx(-2.0 * 1.96935633694460)


@fresh
def played(path: str, values: dict[str, Any], steps: int) -> list[float]:
    from live import OK, Fmu

    with Fmu(path) as fmu:
        found = [fmu.begin(values).get("value")]
        for _ in range(steps):
            assert fmu.step(0.5) == OK
            found.append(fmu.get("value"))
        return found


def test_a_signal_source_plays_steps_and_files(tmp_path: Path) -> None:
    file = tmp_path / "signal.csv"
    file.write_text("# measured\ntime [s],U [V]\n0,1\n1,3\n2,-1\n", encoding="utf-8")
    source = built("SignalSource")
    assert played(source, {"kind": "csv", "file": str(file)}, 5) == [1, 2, 3, 1, -1, 0]
    assert played(source, {"kind": "steps", "steps": "0:2 1:-4 1.75:0.5"}, 4) == [2, 2, -4, -4, 0.5]
    arch = {"kind": "half_sine", "amplitude": 2.0, "duration": 2.0, "offset": 1.0}
    expected = [1.0, 1.0 + 2.0**0.5, 3.0, 1.0 + 2.0**0.5, 1.0]
    assert played(source, arch, 4) == pytest.approx(expected, abs=1e-12)


# -- state


@fresh
def replay(path: str, values: dict[str, Any]) -> dict[str, Any]:
    """Return outputs of the same steps run in several ways; all of them must be equal."""
    from live import OK, Fmu

    def drive(fmu: Fmu, first: int, last: int) -> list[Any]:
        rows = []
        for k in range(first, last):
            for i, name in enumerate(fmu.names("input")):
                scale = {"displacement": 0.01, "velocity": 0.2, "voltage": 5.0}.get(name, 2.0)
                assert fmu.set({name: scale * ((k * (3 + i)) % 7 - 2.5)}) == OK
            assert fmu.step((0.002, 0.005, 0.0005)[k % 3]) == OK, fmu.said
            rows.append(list(fmu.outputs().values()))
        return rows

    with Fmu(path, "one") as fmu, Fmu(path, "two") as other:
        begin = fmu.begin(values).outputs()
        head = drive(fmu, 0, 40)
        saved, time = fmu.save(), fmu.time
        kept = fmu.slave.getFMUState()
        tail = drive(fmu, 40, 80)
        ways = {}
        assert fmu.call("setFMUState", kept) == OK
        fmu.time = time
        ways["a kept state"] = drive(fmu, 40, 80) == tail
        fmu.slave.freeFMUState(kept)
        assert fmu.restore(saved, time) == OK
        ways["a serialised state"] = drive(fmu, 40, 80) == tail
        ways["saving twice"] = fmu.restore(saved, time) == OK and fmu.save() == saved
        # Another instance, with other parameters or none so far.
        assert other.restore(saved, time) == OK
        ways["a new instance"] = drive(other, 40, 80) == tail
        assert fmu.reset() == OK
        ways["reset, outputs"] = fmu.begin(values).outputs() == begin
        ways["reset, steps"] = drive(fmu, 0, 40) == head
        assert fmu.restore(saved, time) == OK
        ways["after a reset"] = drive(fmu, 40, 80) == tail
        # A state from before initialisation brings back that time, too.
        assert fmu.reset() == OK
        early = fmu.save()
        fmu.begin(values)
        drive(fmu, 0, 3)
        assert fmu.restore(early, 0.0) == OK
        ways["an early state"] = fmu.begin(values).outputs() == begin
        ways["an early state, steps"] = drive(fmu, 0, 40) == head
        moving = any(row != tail[0] for row in tail)
    return {"ways": ways, "moving": moving, "faults": [row[-1] for row in head + tail]}


BY_DEFAULT = ("Structure", "BinghamDamper", "LuGreDamper", "Sensors")


@pytest.mark.parametrize(
    ("component", "effects"),
    # Half a second each; by default laws and the building with effects, and sensors.
    [(c, c in SITES) for c in BY_DEFAULT]
    + [
        pytest.param(c, c in SITES, marks=pytest.mark.slow)
        for c in {**dict.fromkeys(ONE_OF_EACH), **SITES}
        if c not in BY_DEFAULT
    ],
)
def test_the_whole_state_can_be_kept_and_set(component: str, effects: bool) -> None:
    values = {k: v for k, v in lively(component).items() if effects or not k.endswith(".on")}
    if component == "BinghamDamper":
        values["moving_mass"] = 2.0
    found = replay(built(component), values)
    assert [way for way, same in found["ways"].items() if not same] == []
    assert set(found["faults"]) == {0}
    assert found["moving"] or component == "ConstantVoltage"


@fresh
def strange_states(path: str, other: str, record: str) -> dict[str, Any]:
    """Return what comes of states that cannot be set; none may be Fatal."""
    from pathlib import Path

    from live import OK, Fmu

    found: dict[str, Any] = {}
    with Fmu(path, "one") as fmu, Fmu(other, "two") as stranger:
        stranger.begin()
        fmu.begin({"record": record})
        assert fmu.step(0.25) == OK
        value, saved = fmu.get("ground_acceleration"), fmu.save()
        for name, state in (
            ("garbage", b"no state at all"),
            ("empty", b"{}"),
            ("a number", b"3"),
            ("of another FMU", stranger.save()),
        ):
            status = fmu.restore(state, 0.25)
            found[name] = [status, fmu.step(0.25), fmu.get("fault")]
            assert fmu.restore(saved, 0.25) == OK
            found[name] += [fmu.get("ground_acceleration") == value, fmu.step(0.25)]
        # The record is not read again as long as the parameters are the same.
        Path(record).unlink()
        assert fmu.restore(saved, 0.25) == OK
        found["the same record"] = [fmu.get("ground_acceleration") == value, fmu.step(0.25)]
        assert fmu.reset() == OK
        found["a lost record"] = [fmu.restore(saved, 0.25), fmu.step(0.25), fmu.get("fault")]
        assert fmu.reset() == OK
        found["reset"] = [fmu.begin().step(0.25), fmu.get("fault")]
        found["said"] = fmu.said
    return found


def test_a_state_that_cannot_be_set_is_a_fault(tmp_path: Path) -> None:
    record = tmp_path / "ramp.csv"
    record.write_text("time [s],acceleration [m/s2]\n0,1\n1,2\n2,3\n", encoding="utf-8")
    found = strange_states(built("GroundMotion"), built("ConstantVoltage"), str(record))
    for name in ("garbage", "empty", "a number", "of another FMU"):
        assert found[name] == [0, 2, 4, True, 0], name
    assert found["the same record"] == [True, 0]
    assert found["a lost record"] == [0, 2, 4]
    assert found["reset"] == [0, 0]
    assert any("the state cannot be set" in text for text in found["said"])
    assert any("there is no such file" in text for text in found["said"])


# -- faults


@fresh
def faults(path: str, values: dict[str, Any], bad: list[list[Any]]) -> list[dict[str, Any]]:
    """Return for each kind and thing that is bad what the component does, how it recovers."""
    from live import DISCARD, OK, Fmu

    def drive(fmu: Fmu, count: int) -> list[Any]:
        for k in range(count):
            fmu.set(dict.fromkeys(fmu.names("input"), 0.01 * (k % 5)))
            assert fmu.step(0.002) == OK
        return list(fmu.outputs().values())

    def provoke(fmu: Fmu, kind: str, thing: Any) -> tuple[int, dict[str, Any]]:
        """Return the status, and the outputs before."""
        before = fmu.outputs()
        if kind == "input":
            assert fmu.set({thing[0]: float(thing[1])}) == OK
            assert fmu.outputs() == before
            return fmu.step(0.002), before
        if kind == "step":
            return fmu.step(float(thing)), before
        if kind == "time":
            return fmu.step(0.002, time=float(thing)), before
        if kind == "end":
            assert fmu.call("terminate") == OK
            return fmu.step(0.002), before
        for _ in range(5):  # kind "huge"
            assert fmu.set({name: 1e308 * sign for name, sign in thing.items()}) == OK
            status = fmu.step(0.002)
            if status == DISCARD:
                break
            before = fmu.outputs()
        return status, before

    answers = []
    for i, (kind, thing) in enumerate(bad):
        with Fmu(path, f"number {i}") as fmu:
            fmu.begin(values)
            first = drive(fmu, 20)
            saved, time = fmu.save(), fmu.time
            status, before = provoke(fmu, kind, thing)
            after = fmu.outputs()
            found: dict[str, Any] = {"status": status, "fault": after["fault"]}
            # An output that follows an input at once shows the huge one, as long as it is finite.
            found["held"] = kind == "huge" or {**after, "fault": 0} == before
            found["finite"] = all(abs(value) < float("inf") for value in after.values())
            # What was wrong is mended: the fault stays, and so do the outputs.
            fmu.set(dict.fromkeys(fmu.names("input"), 0.0))
            found["again"] = fmu.step(0.002, time=time)
            found["stays"] = fmu.outputs() == after
            found["said"] = fmu.said
            assert fmu.restore(saved, time) == OK
            found["restored"] = list(fmu.outputs().values()) == first and fmu.step(0.002) == OK
            provoke(fmu, kind, thing)
            assert fmu.reset() == OK
            fmu.begin(values)
            found["reset"] = drive(fmu, 20) == first
            answers.append(found)
    return answers


def check_fault(found: dict[str, Any], code: int) -> str:
    """See that the fault is right in every respect; return what the component said."""
    assert found["fault"] == code
    assert found["status"] == 2  # Discard
    assert found["again"] == 2
    assert found["held"]
    assert found["finite"]
    assert found["stays"]
    assert found["restored"]
    assert found["reset"]
    said = [text for text in found["said"] if f"fault {code}" in text]
    assert len(said) == 1, found["said"]
    return str(said[0])


@pytest.mark.parametrize(
    "component",
    [  # a second each; what hosts do wrong is tried on others by `bristle conform`
        one if one == "LuGreDamper" else pytest.param(one, marks=pytest.mark.slow)
        for one in ONE_OF_EACH
    ],
)
def test_faults_1_to_3_of_what_a_host_does_wrong(component: str) -> None:
    names = INPUTS[component]
    bad: list[list[Any]] = [
        ["input", [name, value]] for name in names for value in ("nan", "inf", "-inf")
    ]
    bad += [["step", step] for step in ("0", "-0.002", "nan", "inf")]
    bad += [["time", "nan"], ["time", "inf"], ["end", None]]
    answers = faults(built(component), lively(component), bad)
    for (kind, thing), answer in zip(bad, answers, strict=True):
        code = {"input": 1, "end": 3}.get(kind, 2)
        said = check_fault(answer, code)
        if kind == "input":
            assert f"{thing[0]} = {thing[1]}" in said
        elif kind in ("step", "time"):
            assert f"{kind} {float(thing)!r} s" in said


@pytest.mark.parametrize(
    ("component", "values", "inputs"),
    [
        ("Structure", {}, {"damper_force": 1, "extra_force": 1}),
        ("Structure", {}, {"damper_force": 1, "ground_acceleration": -1}),
        ("BinghamDamper", {"gas_spring.on": True, "gas_spring.k_3": 1e9}, {"displacement": 1}),
        ("LuGreDamper", {}, {"velocity": 1}),
        ("LuGreDamper", {"mount_compliance.on": True}, {"velocity": 1}),
    ],
    ids=str,
)
def test_fault_4_what_leaves_the_numbers(
    component: str, values: dict[str, Any], inputs: dict[str, int]
) -> None:
    check_fault(faults(built(component), values, [["huge", inputs]])[0], 4)


@fresh
def overflow(path: str, record: str) -> dict[str, Any]:
    from live import OK, Fmu

    with Fmu(path) as fmu:
        fmu.begin({"record": record, "factor": 1e6})
        rows = []
        for _ in range(8):
            status = fmu.step(0.25)
            rows.append([status, fmu.get("ground_acceleration"), fmu.get("fault")])
        return {"rows": rows, "said": fmu.said, "ok": OK}


def test_fault_4_a_record_that_overflows_on_its_way(tmp_path: Path) -> None:
    record = tmp_path / "spike.csv"
    lines = ["time [s],acceleration [m/s2]", "0,1", "1,2", "2,1e306", "3,0"]
    record.write_text("\n".join(lines) + "\n", encoding="utf-8")
    rows = overflow(built("GroundMotion"), str(record))["rows"]
    good = [row for row in rows if row[0] == 0]
    assert [row[1] for row in good] == [1.25e6, 1.5e6, 1.75e6, 2e6]
    assert rows[len(good) :] == [[2, 2e6, 4]] * (8 - len(good))


@fresh
def wrong_parameters(path: str, cases: list[dict[str, Any]]) -> list[dict[str, Any]]:
    from live import OK, Fmu

    answers = []
    for i, values in enumerate(cases):
        with Fmu(path, f"number {i}") as fmu:
            fmu.get(fmu.names("output")[0])  # something to hold that is not zero
            fmu.begin({k: float(v) if v in ("nan", "inf") else v for k, v in values.items()})
            outputs = fmu.outputs()
            found = {"fault": outputs.pop("fault"), "zero": set(outputs.values()) <= {0.0}}
            found["steps"] = [fmu.step(0.002), fmu.step(0.002)]
            found["said"] = fmu.said
            assert fmu.reset() == OK
            fmu.begin()
            found["reset"] = [fmu.step(0.002), fmu.get("fault")]
            answers.append(found)
    return answers


WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("Structure", {"attached_mass": -1.0}, r"attached_mass = -1.0 lies outside [0.0"),
    ("Structure", {"attached_mass": "nan"}, "attached_mass = nan is not finite"),
    ("Structure", {"storey_softening.d_half": 0.0}, "storey_softening.d_half = 0.0 lies"),
    ("BinghamDamper", {"v_n": -0.02}, "v_n = -0.02 lies outside"),
    ("BinghamDamper", {"stroke": 0.0}, "stroke = 0.0 lies outside"),
    ("BinghamDamper", {"exponent": 9.0}, "exponent = 9.0 lies outside"),
    ("LuGreDamper", {"a_0": 0.0}, "a_0 = 0.0 lies outside"),
    ("LuGreDamper", {"v_max": "inf"}, "v_max = inf is not finite"),
    ("LuGreDamper", {"coil_lag.tau": -1.0}, "coil_lag.tau = -1.0 lies outside"),
    ("LuGreDamper", {"bristle_deflection_0": "nan"}, "bristle_deflection_0 = nan"),
    ("GroundMotion", {"peak": -1.0}, "peak = -1.0 lies outside"),
    ("GroundMotion", {"record": "el_centro"}, "el_centro: there is no such file"),
    ("GroundMotion", {"record": "100 %s%n.csv"}, "100 %s%n.csv: there is no such file"),
    ("GroundMotion", {"record": ""}, "no such file"),
    ("ConstantVoltage", {"level": "nan"}, "level = nan is not finite"),
    ("SignalSource", {"kind": "sinus"}, "kind 'sinus' is none of constant, sine"),
    ("SignalSource", {"kind": "steps", "steps": "0:0 0:1"}, "0 s does not follow 0 s"),
    ("SignalSource", {"kind": "csv", "file": "none.csv"}, "none.csv: there is no such file"),
    ("SignalSource", {"duration": 0.0}, "duration = 0.0 lies outside"),
    ("PrescribedMotion", {"kind": "steps"}, "kind 'steps' jumps: no velocity fits it"),
    ("Sensors", {"seed": -1}, "seed = -1 lies outside [0, 2147483647]"),  # a whole number
]


@pytest.mark.parametrize("component", sorted({component for component, _, _ in WRONG}))
def test_fault_5_a_wrong_parameter(component: str) -> None:
    cases = [(values, says) for name, values, says in WRONG if name == component]
    answers = wrong_parameters(built(component), [values for values, _ in cases])
    for (_, says), found in zip(cases, answers, strict=True):
        assert found["fault"] == 5, says
        assert found["zero"], says
        assert found["steps"] == [2, 2], says
        assert len(found["said"]) == 1, found["said"]
        assert says in found["said"][0]
        assert found["reset"] == [0, 0], says


@fresh
def strange_calls(path: str) -> dict[str, Any]:
    """Return what answers to calls that no importer should make; none may be Fatal."""
    from live import Fmu

    with Fmu(path) as fmu:
        fmu.begin()
        slave = fmu.slave
        found = {
            "unknown reference": [slave.getReal([9999]), fmu.call("setReal", [9999], [1.0])],
            "wrong type": [fmu.call("setReal", [fmu.variables["fault"].valueReference], [1.0])],
            "an output": [fmu.call("setReal", [fmu.variables["force"].valueReference], [7.0])],
            "step": fmu.step(0.002),
            "force": fmu.get("force"),
            "said": fmu.said,
        }
    return found


def test_strange_calls_are_warned_of_and_do_no_harm() -> None:
    found = strange_calls(built("LuGreDamper"))
    assert found["step"] == 0
    assert found["force"] == 0.0
    texts = "\n".join(found["said"])
    assert "9999" in texts
    assert "fault is not of type float" in texts
    assert "force cannot be set" in texts


# -- the damper as a component


@fresh
def saturate(path: str) -> dict[str, Any]:
    from live import Fmu

    with Fmu(path) as fmu:
        fmu.begin({"v_max": 6.0, "velocity": 0.1})
        forces = {}
        for voltage in (9.0, 6.0, -3.0, 0.0, 7.0):
            fmu.set({"voltage": voltage})
            fmu.step(0.5)
            forces[str(voltage)] = fmu.get("force")
        return {"forces": forces, "said": fmu.said, "voltage": fmu.get("voltage")}


@each_damper
def test_the_voltage_saturates_and_that_is_said_once(component: str) -> None:
    found = saturate(built(component))
    law = LAWS[DAMPERS[component]]
    if law.has("command") and not law.felt:  # else the force follows the voltage late, or not
        assert found["forces"]["6.0"] == pytest.approx(found["forces"]["9.0"], rel=1e-9)
        assert found["forces"]["7.0"] == pytest.approx(found["forces"]["9.0"], rel=1e-9)
        assert found["forces"]["-3.0"] == pytest.approx(found["forces"]["0.0"], rel=1e-9)
        assert found["forces"]["9.0"] == pytest.approx(sum(law.sliding_force({}, 0.1, 6.0)))
    assert len(found["said"]) == 1
    assert "the voltage left 0 .. 6 V; the damper saturates" in found["said"][0]
    assert found["voltage"] == 7.0  # the input itself stays as it was set


@fresh
def cycle(path: str, values: dict[str, Any], steps: int) -> dict[str, Any]:
    """Return energy and ratio over ten cycles of 2 Hz, with the work summed from outside."""
    from math import cos, pi, sin

    from live import Fmu

    h = 0.5 / steps
    with Fmu(path) as fmu:
        fmu.begin({**values, "voltage": 4.0, "velocity": 0.1})
        work, before, ratios, begin = 0.0, 0.1 * fmu.get("force"), [], 0.0
        for k in range(1, 10 * steps + 1):
            angle = 2.0 * pi * k / steps
            x, v = 0.1 / (4.0 * pi) * sin(angle), 0.1 * cos(angle)
            fmu.set({"displacement": x, "velocity": v})
            fmu.step(h)
            power = v * fmu.get("force")
            work += 0.5 * h * (before + power)
            before = power
            ratios.append(fmu.get("stroke_ratio"))
            if k == 9 * steps:
                begin = fmu.get("dissipated_energy")
        energy = fmu.get("dissipated_energy")
        return {"work": work, "energy": energy, "cycle": energy - begin, "ratio": max(ratios)}


@pytest.mark.parametrize(
    ("component", "expected"), [("LuGreDamper", 0.1235973), ("BinghamDamper", 0.1582816)]
)
def test_dissipated_energy_is_the_integral_of_the_power(component: str, expected: float) -> None:
    found = cycle(built(component), {"stroke": 0.01}, 500)
    assert found["energy"] == pytest.approx(found["work"], rel=1e-12)
    assert found["cycle"] == pytest.approx(expected, rel=5e-3)
    assert found["ratio"] == pytest.approx(0.1 / (4.0 * math.pi) / 0.01, rel=1e-4)


def test_stored_energy_counts_as_dissipated_until_it_comes_back() -> None:
    spring = {"gas_spring.on": True, "gas_spring.k": 500.0}
    plain = cycle(built("LuGreDamper"), {}, 200)
    found = cycle(built("LuGreDamper"), spring, 200)
    assert found["cycle"] == pytest.approx(plain["cycle"], rel=1e-6)


@fresh
def hold(path: str, mass: float) -> list[Any]:
    from live import Fmu

    found = []
    with Fmu(path) as fmu:
        fmu.begin({"moving_mass": mass, "voltage": 4.0})
        for force, velocity in ((3.0, 0.0), (-4.0, 0.0), (3.0, 1e-4), (30.0, 0.0), (3.0, 0.1)):
            fmu.set({"holding_force": force, "velocity": velocity})
            fmu.step(0.002)
            found.append(fmu.get("force"))
    return found


def test_a_stuck_damper_gives_the_holding_force() -> None:
    mass, limit = 2.0, 1.3 + 0.83 * 4.0
    found = hold(built("BinghamDamper"), mass)
    assert found[0] == pytest.approx(3.0, rel=1e-12)
    assert found[1] == pytest.approx(-4.0, rel=1e-12)
    assert found[2] == pytest.approx(3.0 + mass * 1e-4 / 0.002, rel=1e-9)
    assert found[3] == pytest.approx(limit, rel=1e-12)
    assert found[4] == pytest.approx(4.741283046, abs=1e-9)  # too fast to stop: it slides


def test_without_a_moving_mass_the_holding_force_is_ignored() -> None:
    found = hold(built("BinghamDamper"), 0.0)
    assert found[0] == found[1] == found[3] == 0.0
    assert found[4] == pytest.approx(4.741283046, abs=1e-9)


# -- the coupled loop: how large a step may be


@fresh
def coupled(
    paths: dict[str, str], voltage: float, h: float, stop: float, algorithm: str
) -> list[list[float]]:
    """Return rows of drift, y and force of the half-sine pulse."""
    from live import Fmu, Loop

    fmus = {name: Fmu(path, name) for name, path in paths.items()}
    connections = {
        "structure.ground_acceleration": "ground.value",
        "structure.damper_force": "damper.force",
        "damper.displacement": "structure.base_displacement",
        "damper.velocity": "structure.base_velocity",
    }
    loop = Loop(fmus, connections)
    loop.begin(
        {
            "ground": {"kind": "half_sine", "amplitude": 2.0, "duration": 0.2},
            "damper": {"voltage": voltage},
        }
    )
    watch = (
        "structure.base_displacement",
        "structure.floor2_acceleration_absolute",
        "damper.force",
    )
    return loop.run(round(stop / h), h, watch, algorithm)


def pulse(voltage: float, h: float, stop: float, algorithm: str) -> list[tuple[float, ...]]:
    """Return the columns drift [m], y [m/s2] and force [N]."""
    parts = {"ground": "SignalSource", "structure": "Structure", "damper": "LuGreDamper"}
    paths = {name: str(built(component)) for name, component in parts.items()}
    return list(zip(*coupled(paths, voltage, h, stop, algorithm), strict=True))


def peak(values: tuple[float, ...]) -> float:
    return max(map(abs, values))


def test_half_sine_peaks_by_gauss_seidel_at_half_a_millisecond() -> None:
    drift, y, force = pulse(4.0, 0.0005, 0.5, "gauss-seidel")
    assert peak(drift) == pytest.approx(0.005340066, rel=6e-3)
    assert peak(y) == pytest.approx(3.3272810, rel=6e-3)
    assert peak(force) == pytest.approx(5.8066298, rel=6e-3)
