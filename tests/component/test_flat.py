"""Setup from flat numbers: compiled on arrays it gives the bits of plain Python, run and all."""

from __future__ import annotations

from typing import Any

import pytest
from flat import Arrays, check_run, made

from bristle.fmu import catalogue


def effects_of(name: str) -> list[str]:
    return [effect.name for effect in catalogue.instantiate(name)._effects]  # type: ignore[attr-defined]


DAMPERS = [name for name in catalogue.component_names() if name.endswith("Damper")]


@pytest.mark.parametrize("name", DAMPERS)
def test_a_damper(name: str) -> None:
    check_run(name, {})
    check_run(name, {"moving_mass": 2.0, "v_max": 0.2}, late="acceleration")


@pytest.mark.parametrize("effect", effects_of("LuGreDamper"))
def test_a_damper_with_an_effect(effect: str) -> None:
    known = catalogue.instantiate("LuGreDamper")
    given = {}
    for index, variable in known.vars.items():
        if index in known._parameters and variable.name.startswith(effect + "."):
            high = known._bounds.get(variable.name, (None, None, None))[1]
            value = known[variable.name]
            given[variable.name] = value if high is None else min(1.01 * value, high)
    check_run("LuGreDamper", {**given, f"{effect}.on": True, "sigma_a": 700.0})
    check_run("BinghamDamper", {f"{effect}.on": effect in effects_of("BinghamDamper")})


def test_two_series_elements_are_refused_in_both_forms() -> None:
    on = {"mount_compliance.on": True, "backlash.on": True}
    slave = made("LuGreDamper", on)
    with pytest.raises(ValueError, match="backlash and mount_compliance are series elements"):
        slave.configure()
    single = made("LuGreDamper", {})
    single.configure()
    for name in on:
        single._set_any([single._index[name]], [True], bool)
    assert slave.texts[Arrays(single).code].startswith("backlash and mount_compliance")


@pytest.mark.parametrize("effect", ["", *effects_of("Structure")])
def test_a_structure(effect: str) -> None:
    on = {f"{effect}.on": True} if effect else {}
    check_run("Structure", {**on, "attached_mass": 0.3})


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


@pytest.mark.parametrize(("name", "given"), SIGNALS, ids=str)
def test_a_source(name: str, given: dict[str, Any]) -> None:
    check_run(name, given)


def test_sensors() -> None:
    check_run("Sensors", {})
    check_run("Sensors", SENSORS)


@pytest.mark.parametrize(("name", "given"), CONTROLLERS, ids=str)
def test_a_controller(name: str, given: dict[str, Any]) -> None:
    check_run(name, given)


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
    assert slave.texts[Arrays(slave).code].format_map(slave).startswith(text)
