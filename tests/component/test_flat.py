"""Setup from flat numbers: on arrays it gives the bits of the component, run and all."""

from __future__ import annotations

from typing import Any

import pytest
from flat import Arrays, check_run, made

from bristle.fmu import catalogue


def effects_of(name: str) -> list[str]:
    return [effect.name for effect in catalogue.instantiate(name)._effects]  # type: ignore[attr-defined]


both = pytest.mark.parametrize(
    "machine", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["python", "machine"]
)
"""By default the functions on arrays run as Python. To compile a kind takes 2 to 25 s; that numba
gives the numbers of Python is seen in test_compiled_laws, and in native FMUs."""

DAMPERS = [name for name in catalogue.component_names() if name.endswith("Damper")]


@both
@pytest.mark.parametrize("name", DAMPERS)
def test_a_damper(name: str, machine: bool) -> None:
    check_run(name, {}, machine=machine)
    given = {"moving_mass": 2.0, "v_max": 0.2}
    check_run(name, given, late="acceleration", machine=machine)


@both
@pytest.mark.parametrize("effect", effects_of("LuGreDamper"))
def test_a_damper_with_an_effect(effect: str, machine: bool) -> None:
    known = catalogue.instantiate("LuGreDamper")
    given = {}
    for index, variable in known.vars.items():
        if index in known._parameters and variable.name.startswith(effect + "."):
            high = known._bounds.get(variable.name, (None, None, None))[1]
            value = known[variable.name]
            given[variable.name] = value if high is None else min(1.01 * value, high)
    check_run("LuGreDamper", {**given, f"{effect}.on": True, "sigma_a": 700.0}, machine=machine)
    on = effect in effects_of("BinghamDamper")
    check_run("BinghamDamper", {f"{effect}.on": on}, machine=machine)


def test_two_series_elements_are_refused_in_both_forms() -> None:
    on = {"mount_compliance.on": True, "backlash.on": True}
    slave = made("LuGreDamper", on)
    with pytest.raises(ValueError, match="backlash and mount_compliance are series elements"):
        slave.configure()
    single = made("LuGreDamper", {})
    single.configure()
    for name in on:
        single._set_any([single._index[name]], [True], bool)
    assert slave.texts[Arrays(single, machine=False).code].startswith(
        "backlash and mount_compliance"
    )


@both
@pytest.mark.parametrize("effect", ["", *effects_of("Structure")])
def test_a_structure(effect: str, machine: bool) -> None:
    on = {f"{effect}.on": True} if effect else {}
    check_run("Structure", {**on, "attached_mass": 0.3}, machine=machine)


SIGNALS = [
    ("SignalSource", {"kind": "chirp", "duration": 0.2}),
    ("SignalSource", {"kind": "steps", "steps": "0:1 0.05:3"}),
    ("PrescribedMotion", {"kind": "half_sine", "duration": 0.1, "start": 0.02}),
    ("GroundMotion", {"peak": 3.0, "factor": 0.4, "start": 0.05}),
    ("GroundMotion", {}),
    ("ConstantVoltage", {"level": 2.5}),
]
SENSORS = {
    "floor_acceleration.noise_density": 0.01, "base_velocity.delay": 0.0051, "seed": 5,
    "base_displacement.cut_off": 20.0, "damper_force.quantisation": 0.01, "sample_period": 7e-4,
}  # fmt: skip
CONTROLLERS = [
    *(
        (name, {})
        for name in (
            "ClippedOptimal",
            "HinfInverse",
            "LqgClipped",
            "Lpv",
            "Skyhook",
            "TrainedPolicy",
        )
    ),
    ("Skyhook", {"kind": "inverse", "velocity": "filtered", "inverse": "bingham"}),
    ("HinfInverse", {"anti_windup": 50.0, "inverse": "tanh", "tanh.f_c": 2.0}),
]


@both
@pytest.mark.parametrize(("name", "given"), SIGNALS, ids=str)
def test_a_source(name: str, given: dict[str, Any], machine: bool) -> None:
    check_run(name, given, machine=machine)


@both
@pytest.mark.parametrize("given", [{}, SENSORS], ids=["plain", "faulty"])
def test_sensors(given: dict[str, Any], machine: bool) -> None:
    check_run("Sensors", given, machine=machine)


@both
@pytest.mark.parametrize(("name", "given"), CONTROLLERS, ids=str)
def test_a_controller(name: str, given: dict[str, Any], machine: bool) -> None:
    check_run(name, given, machine=machine)


@pytest.mark.parametrize(
    ("name", "parameter", "text"),
    [
        ("Skyhook", "velocity", "velocity 'odd' is neither direct nor filtered."),
        ("Skyhook", "kind", "kind 'odd' is neither switch nor inverse."),
        ("HinfInverse", "inverse", "inverse 'odd' is neither lugre nor"),
        ("SignalSource", "kind", "kind 'odd' is none of constant, sine"),
    ],
)
def test_a_text_that_is_none_of_its_words(name: str, parameter: str, text: str) -> None:
    slave = made(name, {parameter: "odd"})
    with pytest.raises(ValueError, match=text):
        slave.configure()
    assert slave.texts[Arrays(slave, machine=False).code].format_map(slave).startswith(text)
