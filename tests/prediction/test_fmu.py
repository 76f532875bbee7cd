"""Any FMU against a measurement: ports found or given, errors in units of the noise, failures."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made import write

from bristle import units
from bristle.cli import main
from bristle.errors import FmuError, RecordError, RunError
from bristle.fmu.build import ensure
from bristle.fmu.description import Description, Variable
from bristle.identification.histories import DamperForces
from bristle.prediction.compare_fmu import compare_fmu, map_ports

DT = 0.002
N = 1500


def columns(seed=3, noise=0.01):
    """Return a bench measurement of a LuGre damper with parameters that are known."""
    random = np.random.default_rng(seed)
    t = np.arange(N) * DT
    f, phase = random.uniform(0.5, 6.0, 8), random.uniform(0.0, 6.28, 8)
    w = 2.0 * np.pi * f
    angle = w[:, None] * t + phase[:, None]
    size = 0.004 / f
    x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
    V = np.repeat([0.0, 2.0, 4.0], N // 3)
    force = DamperForces("lugre", []).force(x, v, a, V, DT, {})

    def measured(y):
        return y + noise * np.std(y) * random.standard_normal(N)

    return {
        "time [s]": t, "displacement [mm]": 1e3 * measured(x), "velocity [m/s]": measured(v),
        "voltage [V]": V, "force [N]": measured(force),
    }  # fmt: skip


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> Path:
    return write(tmp_path_factory.mktemp("rig") / "run.csv", columns())


@pytest.fixture(scope="module")
def lugre() -> Path:
    return ensure("LuGreDamper")


def test_our_own_damper_is_right_within_the_noise_of_its_own_data(rig, lugre):
    found = compare_fmu(lugre, rig)
    (force,) = found.outputs
    assert (force.quantity, force.unit) == ("force", "N")
    assert force.z == pytest.approx(1.0, abs=0.15)
    fed = {one.name: one.signal for one in found.ports.inputs}
    assert fed["displacement"] == "displacement"
    assert fed["voltage"] == "voltage"
    # holding_force is in N as the measured force is, but it is not what was measured.
    assert "holding_force" not in fed
    assert any("holding_force" in text and "optional" in text for text in found.ports.left)
    assert force.sentences[0].startswith("In this measurement the model misses the force by")


def test_a_wrong_parameter_shows(rig, lugre):
    (force,) = compare_fmu(lugre, rig, values={"sigma_2": "200"}).outputs
    assert force.z > 2.0
    assert {"speed", "velocity"} & {force.first.coordinate, *force.first.alike}


def gain_data(tmp_path, factor=2.0, noise=0.02):
    random = np.random.default_rng(1)
    t = np.arange(2000) * 0.01
    u = np.sin(3.0 * t) + 0.5 * np.sin(7.1 * t + 1.0)
    y = factor * u + noise * random.standard_normal(2000)
    return write(tmp_path / "gain.csv", {"time [s]": t, "pressure [Pa]": u, "flow [kg/s]": y})


def test_a_stranger_is_fed_from_columns_that_we_do_not_know(toys, tmp_path):
    data = gain_data(tmp_path)
    with pytest.raises(FmuError, match=r"no output matches a measured channel") as error:
        compare_fmu(toys["Gain"], data)
    assert "pressure [Pa]" in str(error.value)
    assert "--map OUTPUT=CHANNEL" in str(error.value)
    found = compare_fmu(toys["Gain"], data, maps={"u": "pressure", "y": "flow"})
    (flow,) = found.outputs
    assert flow.z == pytest.approx(1.0, abs=0.15)
    assert flow.total.numerical < 1e-9  # it follows its input at once
    assert any("gives no unit" in line for line in found.mapping_lines())
    (wrong,) = compare_fmu(
        toys["Gain"], data, maps={"u": "pressure", "y": "flow"}, values={"gain": "2.3"}
    ).outputs
    assert wrong.z > 3.0
    assert wrong.first.coordinate == "pressure"


def test_units_are_turned_on_the_way(toys, tmp_path):
    t = np.arange(2000) * 0.01
    u = np.sin(3.0 * t)
    random = np.random.default_rng(2)
    y = 2.0 * u + 0.02 * random.standard_normal(2000)
    data = write(tmp_path / "kn.csv", {"time [s]": t, "suction [kPa]": u, "force [kN]": 1e-3 * y})
    (force,) = compare_fmu(toys["Gain"], data, maps={"u": "suction", "y": "force"}).outputs
    assert force.unit == "N"
    assert force.z == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(
    ("how", "kind", "text"),
    [
        ("discard", RunError, "answered Discard"),
        ("raise", RunError, "Fatal"),
        ("abort", RunError, "ended its process"),
        ("nan", RecordError, "predicted value is nan at"),
    ],
)
def test_a_stranger_that_fails_is_an_answer(toys, tmp_path, how, kind, text):
    data = gain_data(tmp_path)
    with pytest.raises(kind, match=text):
        compare_fmu(
            toys["Failing"], data, maps={"u": "pressure", "value": "flow"},
            values={"how": how, "at": "5"},
        )  # fmt: skip


def test_a_file_is_found_from_where_the_user_stands_and_a_wrong_parameter_is_named(
    tmp_path, monkeypatch
):
    t = 0.005 * np.arange(600)
    shaken = 2.0 * np.sin(9.0 * t)
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(t))
    write(tmp_path / "record.csv", {"time [s]": t, "acceleration [m/s2]": shaken})
    data = {"time [s]": t, "ground_acceleration [m/s2]": shaken + noise}
    data = write(tmp_path / "run.csv", data)
    monkeypatch.chdir(tmp_path)
    ground = ensure("GroundMotion")
    found = compare_fmu(ground, data, values={"record": "record.csv"})
    assert found.outputs[0].z < 1.2
    with pytest.raises(RunError, match=r"It said: .* peak = -5\.0 lies outside"):
        compare_fmu(ground, data, values={"record": "record.csv", "peak": "-5"})


def test_a_stranger_that_hangs_is_ended(toys, tmp_path):
    with pytest.raises(RunError, match="took longer than 3 s"):
        compare_fmu(
            toys["Failing"], gain_data(tmp_path), maps={"u": "pressure", "value": "flow"},
            values={"how": "hang", "at": "5"}, timeout=3.0,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"maps": {"v": "pressure"}}, r'"v"'),
        ({"maps": {"u": "presure", "y": "flow"}}, r'Did you mean "pressure"'),
        ({"values": {"gian": "2"}}, r'Did you mean "gain"'),
        ({"values": {"gain": "two"}}, "gain is Real"),
        ({"maps": {"u": "pressure"}, "values": {"u": "1"}}, "both set and mapped"),
    ],
)
def test_what_is_given_wrong_is_named(toys, tmp_path, options, text):
    with pytest.raises(FmuError, match=text):
        compare_fmu(toys["Gain"], gain_data(tmp_path), **options)


def test_units_that_differ_are_refused(lugre, rig):
    with pytest.raises(FmuError, match=r"voltage is in V, force in N"):
        compare_fmu(lugre, rig, maps={"voltage": "force"})


def test_a_sign_in_doubt_is_warned_of(toys, tmp_path):
    data = gain_data(tmp_path, factor=-2.0)
    found = compare_fmu(toys["Gain"], data, maps={"u": "pressure", "y": "flow"})
    assert any("has the opposite sign of flow" in note for note in found.notes)
    found = compare_fmu(toys["Gain"], data, maps={"u": "pressure", "y": "-flow"})
    assert found.outputs[0].z == pytest.approx(1.0, abs=0.15)
    assert any("is compared with flow, reversed" in line for line in found.mapping_lines())
    (turned,) = compare_fmu(toys["Gain"], data, maps={"u": "-pressure", "y": "flow"}).outputs
    assert turned.z == pytest.approx(1.0, abs=0.15)


def test_a_unit_in_doubt_is_warned_of(toys, tmp_path):
    t = np.arange(2000) * 0.01
    u = np.sin(3.0 * t)
    y = 2000.0 * u + 20.0 * np.random.default_rng(2).standard_normal(2000)
    data = write(tmp_path / "n.csv", {"time [s]": t, "suction [Pa]": u, "force [N]": y})
    maps = {"u": "suction", "y": "force"}
    found = compare_fmu(toys["Gain"], data, maps=maps)
    assert any("force is 1000 times y, taken in N" in note for note in found.notes)
    (force,) = compare_fmu(toys["Gain"], data, maps={**maps, "y": "force@kN"}).outputs
    assert force.z == pytest.approx(1.0, abs=0.15)
    with pytest.raises(FmuError, match='"kilo" is no unit'):
        compare_fmu(toys["Gain"], data, maps={**maps, "y": "force@kilo"})
    with pytest.raises(FmuError, match="y is in mm, force in N"):
        compare_fmu(toys["Gain"], data, maps={**maps, "y": "force@mm"})


def port(name, unit=None, causality="input"):
    return Variable(name, "Real", causality, "continuous", 1, unit, 0.0)


def described(*ports):
    named = {one.name: one for one in ports}
    return Description("Rig", "0", "Rig", "", named, {})


SIGNALS = {"displacement": "m", "velocity": "m/s", "force": "N", "current": "A"}


def test_ports_are_read_as_titles_are():
    ports = map_ports(
        described(
            port("x_mm"), port("v_mm_s"), port("rod.I_mA"), port("F_kN", causality="output")
        ),
        SIGNALS, {}, {},
    )  # fmt: skip
    assert [(one.name, one.signal, one.unit) for one in (*ports.inputs, *ports.outputs)] == [
        ("x_mm", "displacement", "mm"), ("v_mm_s", "velocity", "mm/s"),
        ("rod.I_mA", "current", "mA"), ("F_kN", "force", "kN"),
    ]  # fmt: skip
    assert "in mm/s by its name" in ports.inputs[1].reason


@pytest.mark.parametrize(
    ("own", "text"),
    [
        (port("velocity"), "neither the FMU nor its name gives one. --map velocity=velocity@UNIT"),
        (port("v_in"), "neither the FMU nor its name gives one"),
        (port("v_mm_s", "m/s"), "the FMU says m/s, and its name mm/s"),
    ],
)
def test_a_port_whose_unit_is_in_doubt_is_refused(own, text):
    out = port("force", "N", "output")
    with pytest.raises(FmuError, match=re.escape(text)):
        map_ports(described(own, out), SIGNALS, {}, {})
    found = map_ports(described(own, out), SIGNALS, {own.name: "velocity@mm/s"}, {})
    assert found.inputs[0].unit == "mm/s"


def test_the_unit_of_a_port_is_what_the_fmu_defines_it_as():
    """A moment called mN is no force, and a name that is not known here is read all the same."""
    joule, kilo = {"kg": "1", "m": "2", "s": "-2"}, {"kg": "1", "m": "1", "s": "-2"}
    kilo["factor"] = "1000"
    ports = map_ports(
        described(
            port("x", "m"),
            replace(port("a", "mN"), defined=units.defined("mN", joule)),
            replace(port("b", "rpm"), defined=units.defined("rpm", {"rad": "1", "factor": "0.17"})),
            replace(port("c", "Kraft", "output"), defined=units.defined("Kraft", kilo)),
        ),
        {"displacement": "m", "force": "N"}, {}, {},
    )  # fmt: skip
    assert [one.name for one in ports.inputs] == ["x"]
    assert [(one.name, one.unit, one.signal) for one in ports.outputs] == [("c", "kN", "force")]
    assert ports.left[0].startswith("a [J] is fed from nothing")
    assert ports.left[1].startswith("b [0.17 rad] is fed from nothing")


def test_data_without_noise_are_judged_by_a_stated_floor(toys, tmp_path):
    t = np.arange(500) * 0.01
    data = write(tmp_path / "clean.csv", {"time [s]": t, "a [Pa]": t, "b [kg]": 2.0 * t})
    found = compare_fmu(toys["Gain"], data, maps={"u": "a", "y": "b"})
    assert any("almost no noise" in note for note in found.notes)
    assert found.outputs[0].z < 0.1


def command(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "bristle.cli", "compare-fmu", *map(str, arguments)],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip


@pytest.mark.slow  # processes of the command: a foreign FMU over all runs
def test_the_command_prints_sentences_and_writes_a_picture(toys, tmp_path):
    data, picture = gain_data(tmp_path), tmp_path / "out.png"
    wires = ["--map", "u=pressure", "--map", "y=flow", "--out", picture]
    done = command(toys["Gain"], "--data", data, *wires)
    assert (done.returncode, done.stderr) == (0, "")
    assert "u [Pa] is fed from pressure: as given" in done.stdout
    assert "In this measurement the model misses" in done.stdout
    assert picture.read_bytes().startswith(b"\x89PNG")
    done = command(toys["Gain"], "--data", data, *wires, "--json")
    answer = json.loads(done.stdout)
    assert answer["comparisons"][0]["z"] == pytest.approx(1.0, abs=0.15)
    assert [one["signal"] for one in answer["inputs"]] == ["pressure"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["compare-fmu", "no.fmu", "--data", "no.csv"], "no.fmu"),
        (["compare-fmu", "no.fmu", "--data", "no.csv", "--set", "gain"], "NAME=VALUE"),
        (["compare", "nowhere"], "no study"),
    ],
)
def test_the_command_says_what_would_be_right(arguments, text, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    assert text in capsys.readouterr().err
