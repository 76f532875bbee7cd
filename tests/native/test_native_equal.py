"""A component gives the same numbers and says the same, in Python and native."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from both_forms import Both, Native, both, folder, needs_zig

from bristle.fmu import catalogue
from bristle.fmu.build import plan
from bristle.native.build import build
from bristle.native.entrance import component_of
from bristle.native.zig import here
from bristle.physics.effect import effects_of
from bristle.physics.laws import LAWS, laws_of

pytestmark = needs_zig

EQUAL = 1e-12
"""Largest difference as a share of an output's peak."""

MEASURED = ("floor_acceleration", "base_displacement", "base_velocity", "damper_force")
ALL_FAULTS = {
    f"{name}__{key}": value
    for name in MEASURED
    for key, value in {
        "gain": 1.1, "bias": 0.01, "noise_density": 0.002, "quantisation": 1e-3, "delay": 0.0051,
        "cut_off": 30.0,
    }.items()
}  # fmt: skip
LIGHT: list[tuple[str, dict[str, Any]]] = [
    ("ConstantVoltage", {"level": 3.5}),
    ("GroundMotion", {}),
    ("GroundMotion", {"peak": 3.0, "factor": 1.5, "start": 0.05}),
    *[("SignalSource", {"kind": kind}) for kind in ("constant", "sine", "chirp", "half_sine")],
    ("SignalSource", {"kind": "steps", "steps": " 0:0  0.05:4\t0.1:-1e-3 "}),
    ("PrescribedMotion", {"kind": "chirp", "amplitude": 0.01}),
    ("ClippedOptimal", {}),
    ("LqgClipped", {"f_min": 0.1, "velocity": "filtered"}),
    ("HinfInverse", {}),
    ("TrainedPolicy", {}),
    ("HinfInverse", {"inverse": "bingham", "anti_windup": 50.0, "velocity": "filtered"}),
    ("Lpv", {}),
    ("Skyhook", {}),
    ("Skyhook", {"kind": "inverse", "gain": 80.0, "sample_period": 0.003}),
]
STRUCTURE_EFFECTS = {f"{effect.name}__on": True for effect in effects_of("structure")}
DAMPERS = {catalogue.component_of_law(law.name): law.name for law in laws_of("damper")}
HEAVY: list[tuple[str, dict[str, Any]]] = [
    ("Sensors", {}),
    ("Sensors", ALL_FAULTS),
    ("Structure", {}),
    ("Structure", {"attached_mass": 1.0, **STRUCTURE_EFFECTS}),
    *[("Structure", {switch: True}) for switch in STRUCTURE_EFFECTS],
    *[(damper, {"moving_mass": 2.0}) for damper in DAMPERS],
    *[
        (damper, {f"{effect.name}__on": True})
        for damper, law in DAMPERS.items()
        for effect in effects_of("damper", law)
    ],
]


def equal(component: str, values: dict[str, Any]) -> None:
    pair = both(component, **values)
    pair.begin()
    assert pair.largest_difference() <= EQUAL
    mine, other = pair.said()
    assert mine == other
    pair.end()


@pytest.mark.parametrize(("component", "values"), LIGHT, ids=lambda value: str(value))
def test_sources_and_controllers_give_the_same_numbers(
    component: str, values: dict[str, Any]
) -> None:
    equal(component, values)


@pytest.mark.slow  # all dampers are compiled with all effects
@pytest.mark.parametrize(("component", "values"), HEAVY, ids=lambda value: str(value))
def test_every_effect_of_every_component_gives_the_same_numbers(
    component: str, values: dict[str, Any]
) -> None:
    equal(component, values)


@pytest.mark.slow  # of all dampers compiled: no law is left out
def test_every_law_of_the_library_is_among_them() -> None:
    assert set(DAMPERS.values()) == {law for law in LAWS if LAWS[law] in laws_of("damper")}


# -- what goes wrong, goes wrong in the same words

RECORD = "time [s],acceleration [m/s2]\n"
SPOILT = {
    "empty": b"",
    "header": b"t,a\n0,1\n1,2\n",
    "short": RECORD.encode() + b"0,1\n",
    "columns": RECORD.encode() + b"0,1\n1,2,3\n",
    "one": RECORD.encode() + b"0,1\n1\n",
    "word": RECORD.encode() + b"0,1\n0.1,a word of more than forty letters, which is cut\n",
    "text": RECORD.encode() + b"0,1\n0.1," + b"x" * 60 + b"\n",
    "hex": RECORD.encode() + b"0,0x10\n1,2\n",
    "under": RECORD.encode() + b"0,1_000\n1,2\n",
    "nan": RECORD.encode() + b"0,nan\n1,2\n",
    "infinite": RECORD.encode() + b"0,1e400\n1,2\n",
    "missing": RECORD.encode() + b"0,\n1,2\n",
    "twice": RECORD.encode() + b"0,1\n0.5,1\n0.5,2\n",
    "back": RECORD.encode() + b"0,1\n0.5,1\n0.25,2\n",
    "negative": RECORD.encode() + b"-1,1\n0.5,1\n",
    "gap": RECORD.encode() + b"0,1\n0.1,1\n0.2,2\n0.3,1\n0.9,1\n",
    "zero": b"\xef\xbb\xbf# said\r\n\r\n" + RECORD.encode() + b"0,0\r\n 0.1 , 0 \r\n",
    "utf16": "\ufefftime".encode("utf-16-le"),
    "binary": b"time\0[s]",
    "latin": b"# ok\n# \xe4\n",
}


@pytest.mark.parametrize("kind", SPOILT)
def test_a_file_is_refused_in_the_same_words(kind: str, tmp_path: Path) -> None:
    file = tmp_path / f"{kind} ü.csv"
    file.write_bytes(SPOILT[kind])
    pair = both("GroundMotion", record=str(file), peak=2.0)
    pair.begin()
    assert pair.faults() == (5, 5)
    mine, other = pair.said()
    assert mine == other
    named = str(file) if kind != "zero" else "record"
    assert mine[0].startswith(f"one: fault 5, a parameter or record is wrong: {named}")
    assert pair.step(0.0, 0.1) == (False, 3)
    pair.end()


def test_a_path_without_a_file_is_refused_in_the_same_words(tmp_path: Path) -> None:
    for path in (tmp_path / "gone.csv", tmp_path, Path("/dev/null")):
        pair = both("GroundMotion", record=str(path))
        pair.begin()
        mine, other = pair.said()
        assert mine == other
        assert str(path) in mine[0]
        pair.end()


@pytest.mark.parametrize(("component", "unit"), [("SignalSource", "kN"), ("PrescribedMotion", "m")])
def test_a_file_of_its_own_is_played(component: str, unit: str, tmp_path: Path) -> None:
    file = tmp_path / "signal.csv"
    rows = "".join(f"{0.01 * k!r},{math.sin(k)!r}\n" for k in range(40))
    file.write_text(f"# by hand\n\ntime [s],anything [{unit}]\n{rows}")
    pair = both(component, kind="csv", file=str(file))
    pair.begin()
    assert pair.largest_difference() == 0.0
    for time in (0.0, 0.25):  # its samples end between
        pair.step(time, 0.25)
        assert pair.largest_difference() == 0.0
    pair.end()


def test_a_file_in_another_unit_is_refused_in_the_same_words(tmp_path: Path) -> None:
    file = tmp_path / "signal.csv"
    file.write_text("time [s],x [mm]\n0,0\n1,5\n")
    pair = both("PrescribedMotion", kind="csv", file=str(file))
    pair.begin()
    mine, other = pair.said()
    assert mine == other
    assert 'line 1: the header is "time [s],x [mm]". It must be "time [s],NAME [m]".' in mine[0]
    pair.end()


@pytest.mark.parametrize(
    ("component", "values", "words"),
    [
        ("SignalSource", {"kind": "wiggle"}, "kind 'wiggle' is none of constant"),
        ("SignalSource", {"kind": "it's"}, 'kind "it\'s" is none of'),
        ("SignalSource", {"kind": "steps", "steps": "0:0 x:1"}, 'steps: "x:1" is not TIME:VALUE'),
        ("SignalSource", {"kind": "steps", "steps": "1:0 0.5:1"}, "steps: the time 0.5 s does not"),
        ("SignalSource", {"kind": "steps", "steps": "  "}, "steps: no pair"),
        ("PrescribedMotion", {"kind": "steps"}, "kind 'steps' jumps"),
        ("SignalSource", {"frequency": -1.0}, "frequency = -1.0 lies outside [0.0, 1000000.0]."),
        ("SignalSource", {"level": math.inf}, "level = inf is not finite."),
        ("ConstantVoltage", {"level": 1.25e-7 - 2e3}, "lies outside [-1000.0, 1000.0]."),
        ("Skyhook", {"kind": "%s"}, "kind '%%s' is neither switch nor inverse."),
        ("Skyhook", {"velocity": "both"}, "velocity 'both' is neither direct nor filtered."),
        ("Skyhook", {"kind": "inverse", "inverse": "none"}, "inverse 'none' is neither"),
    ],
    ids=lambda value: str(value),
)
def test_a_parameter_is_refused_in_the_same_words(
    component: str, values: dict[str, Any], words: str
) -> None:
    pair = both(component, **values)
    pair.begin()
    assert pair.faults() == (5, 5)
    mine, other = pair.said()
    assert mine == other
    assert words in mine[0]
    assert pair.shown()[1] == [0.0] * len(pair.reals)
    pair.end()


@pytest.mark.slow  # one more damper is compiled
def test_an_input_that_the_build_sets_counts_as_set_after_a_reset_too() -> None:
    starts = {"fluid_inertia.on": True, "fluid_inertia.m_f": 2.0, "acceleration": 3.0}
    what = plan("LuGreDamper", name="Accelerated", starts=starts)
    pair = Both(Native(build(what, folder(), [here()])), component_of(what))
    for _ in range(2):
        pair.begin()
        pair.set("velocity", 0.05)
        assert pair.step(0.0, 0.001) == (True, 0)
        mine, other = pair.shown()
        assert other == pytest.approx(mine, rel=EQUAL)
        assert pair.slave.constants.measured
        pair.slave = component_of(what)
        assert pair.one.reset() == 0
    pair.end()


def test_faults_come_in_the_same_words() -> None:
    pair = both("ClippedOptimal")
    assert pair.step(0.0, 0.002) == (False, 3)
    assert pair.faults() == (3, 3)
    mine, other = pair.said()
    assert mine == other != []
    pair.end()
    for step in (0.0, -0.001, math.nan, math.inf):
        pair = both("ClippedOptimal")
        pair.begin()
        assert pair.step(0.002, step) == (False, 3)
        assert pair.faults() == (2, 2)
        mine, other = pair.said()
        assert mine == other != []
        pair.end()
    pair = both("ClippedOptimal")
    pair.begin()
    pair.set("base_velocity", math.nan)
    before = pair.shown()
    assert pair.step(0.0, 0.002) == (False, 3)
    assert pair.faults() == (1, 1)
    assert pair.shown() == before
    mine, other = pair.said()
    assert mine == other == ["one: fault 1, an input is not finite: base_velocity = nan."]
    pair.end()


def test_a_long_step_warns_and_an_endless_one_is_refused_in_the_same_words() -> None:
    pair = both("ClippedOptimal")
    pair.begin()
    assert pair.step(0.0, 0.01) == (True, 0)
    assert pair.step(0.01, 1e6) == (False, 3)
    mine, other = pair.said()
    assert mine == other
    assert [line.split(":")[1][:14] for line in mine] == [
        " stepped by 0.", " stepped by 1e", " fault 4, a st",
    ]  # fmt: skip
    pair.end()


def test_what_cannot_be_set_keeps_its_value_and_is_told_once() -> None:
    pair = both("SignalSource", kind="sine")
    pair.begin()
    assert pair.set("value", 3.0) == 1
    assert pair.set("amplitude", 2.0) == 1
    assert pair.set("amplitude", 2.5) == 1
    assert pair.set("kind", "chirp") == 1
    assert pair.set("kind", "sine") == 0
    mine, other = pair.said()
    assert mine == other
    assert mine == [
        "one: value cannot be set.",
        "one: amplitude keeps 1.0: it is fixed after initialisation.",
        "one: kind keeps 'sine': it is fixed after initialisation.",
    ]
    pair.end()
