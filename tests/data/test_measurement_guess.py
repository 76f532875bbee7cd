"""Which column is which channel: by names, units, and by what the data say."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.data.channels import channel_unit, meaning
from bristle.data.guess import Guess, guess_channels, left_out
from bristle.data.relation import derivative_relation
from bristle.data.table import from_arrays

TIME = np.arange(3000) / 500.0
GENERATOR = np.random.default_rng(4)
X = sum(np.sin(w * TIME + p) * 8e-3 / w for w, p in ((7.0, 0.3), (13.0, 1.0), (29.0, 2.0)))
V = sum(np.cos(w * TIME + p) * 8e-3 for w, p in ((7.0, 0.3), (13.0, 1.0), (29.0, 2.0)))
U = np.repeat([0.0, 4.0, 2.0, 6.0, 1.0, 3.0], 500)
F = (1.0 + 0.8 * U) * np.tanh(V / 1e-3) + 30.0 * V


def noisy(values, share: float = 0.01):  # type: ignore[no-untyped-def]
    return values + share * np.std(values) * GENERATOR.standard_normal(len(values))


def guessed(**columns) -> dict[str, Guess]:  # type: ignore[no-untyped-def]
    table = from_arrays(columns, "run.csv")
    return {guess.channel: guess for guess in guess_channels(table)}


def named(names: str) -> dict[str, Guess]:
    parts = names.split(";")
    factors = (1.0, 1e3, 1e3, 1.0, 1.0)
    data = (TIME, noisy(X), noisy(V), noisy(F), U)
    return guessed(**{n: f * d for n, f, d in zip(parts, factors, data, strict=True)})


@pytest.mark.parametrize(
    "names",
    [
        "time_s;displacement_mm;velocity_mm_s;force_N;voltage_V",
        "Time (s);Position (mm);Velocity (mm/s);Load (N);Coil voltage (V)",
        "t [s];x [mm];v [mm/s];F [N];U [V]",
        "Zeit [s];Weg [mm];Geschwindigkeit [mm/s];Kraft [N];Spannung [V]",
        "tempo_s;posição_mm;velocidade_mm_s;força_N;tensão_V",
        "ElapsedTime [s];LVDT [mm];RodVelocity [mm/s];LoadCell [N];DriveVoltage [V]",
        "a [s];b [mm];c [mm/s];d [N];e [V]",
    ],
)
def test_names_and_units_tell_the_channels(names: str) -> None:
    found = named(names)
    assert [found[c].column for c in ("time", "displacement", "velocity", "force", "voltage")] == (
        names.split(";")
    )
    assert all(guess.sign == 1 and guess.reason for guess in found.values())
    # Volts of a column that says nothing may be of any sensor.
    doubted = {channel for channel, guess in found.items() if guess.doubt}
    assert doubted == ({"voltage"} if names.startswith("a [s]") else set())


def test_units_that_lack_are_told_by_derivatives() -> None:
    found = named("t [s];x [mm];velocity;F [N];U [V]")
    assert found["velocity"].unit == "mm/s"
    assert "derivative" in found["velocity"].reason
    found = named("t [s];x;v [mm/s];F [N];U [V]")
    assert found["displacement"].unit == "mm"


def test_wrong_unit_is_doubted_and_kept() -> None:
    found = named("t [s];x [m];v [mm/s];F [N];U [V]")
    assert found["displacement"].unit == "m"
    assert "is mm/s or m wrong?" in found["velocity"].doubt


def test_signs_follow_displacement_and_power() -> None:
    found = guessed(**{"t [s]": TIME, "x [m]": noisy(X), "v [m/s]": -noisy(V), "F [N]": -noisy(F)})
    assert found["velocity"].sign == -1
    assert found["force"].sign == -1
    assert "drive the motion" in found["force"].reason


def test_velocity_of_another_motion_is_doubted() -> None:
    other = GENERATOR.standard_normal(len(TIME))
    found = guessed(**{"t [s]": TIME, "x [m]": X, "v [m/s]": other, "F [N]": F})
    assert "not the derivative" in found["velocity"].doubt
    found = guessed(**{"t [s]": TIME, "x [m]": X, "F [N]": other})
    assert "neither resists nor drives" in found["force"].doubt


def test_force_that_dissipates_is_preferred() -> None:
    normal = 50.0 + noisy(np.sin(TIME))
    found = guessed(
        **{"t [s]": TIME, "x [m]": X, "Normal force [N]": normal, "Friction force [N]": F}
    )
    assert found["force"].column == "Friction force [N]"
    assert '"Normal force [N]" 0.0' in found["force"].reason


def test_of_forces_of_like_names_the_one_that_dissipates_is_taken() -> None:
    dead = GENERATOR.standard_normal(len(TIME))
    found = guessed(**{"t [s]": TIME, "x [m]": X, "Force 0 [N]": dead, "Force 1 [N]": F})
    assert found["force"].column == "Force 1 [N]"
    assert '"Force 0 [N]" 0.0' in found["force"].reason
    assert not found["force"].doubt


def test_signals_in_volts_are_no_forces() -> None:
    table = from_arrays({"t [s]": TIME, "x [m]": X, "F [V]": F, "F [N]": F, "U [V]": U}, "run.csv")
    found = {guess.channel: guess.column for guess in guess_channels(table)}
    assert found["force"] == "F [N]"
    assert left_out(table, guess_channels(table)) == ["F [V]"]


def test_data_tell_what_names_do_not() -> None:
    found = named("Ch1;Ch2;Ch3;Ch4;Ch5")
    assert [found[c].column for c in ("time", "displacement", "velocity", "force", "voltage")] == (
        ["Ch1", "Ch2", "Ch3", "Ch4", "Ch5"]
    )
    assert all(found[c].unit == "" for c in ("displacement", "velocity", "force", "voltage"))
    assert "500 Hz" in found["time"].doubt


def test_negative_voltage_is_doubted() -> None:
    found = guessed(**{"t [s]": TIME, "x [m]": X, "F [N]": F, "U [V]": U - 3.0})
    assert "negative" in found["voltage"].doubt


def test_levels_of_a_structure_by_number() -> None:
    data = {"time_s": TIME, "ground_acc_m_s2": V, "ground_disp_m": X}
    data |= {f"acc{k}_abs_m_s2": k * V for k in (1, 2, 3)}
    data |= {f"disp{k}_rel_m": k * X for k in (1, 2, 3)}
    table = from_arrays(data, "run.csv")
    levels = ["base", "floor1", "floor2"]
    found = {g.channel: g.column for g in guess_channels(table, "structure", levels)}
    assert found == {
        "time": "time_s",
        "ground_acceleration": "ground_acc_m_s2",
        "base_acceleration_absolute": "acc1_abs_m_s2",
        "floor1_acceleration_absolute": "acc2_abs_m_s2",
        "floor2_acceleration_absolute": "acc3_abs_m_s2",
        "base_displacement": "disp1_rel_m",
        "floor1_displacement": "disp2_rel_m",
        "floor2_displacement": "disp3_rel_m",
    }
    assert left_out(table, guess_channels(table, "structure", levels)) == ["ground_disp_m"]
    reasons = [g.reason for g in guess_channels(table, "structure", levels)]
    assert sum("counted from the lowest" in reason for reason in reasons) == 6


def test_ports_of_bristle_name_themselves() -> None:
    data = {
        "time [s]": TIME,
        "structure.base_displacement [m]": X,
        "structure.base_velocity [m/s]": V,
        "structure.floor1_acceleration_absolute [m/s2]": V,
        "structure.drift1 [m]": X,
        "structure.holding_force [N]": F,
        "damper.force [N]": F,
        "ground.ground_acceleration [m/s2]": V,
    }
    found = {g.channel for g in guess_channels(from_arrays(data, "r"), "structure")}
    assert found == {
        "time",
        "base_displacement",
        "base_velocity",
        "floor1_acceleration_absolute",
        "drift1",
        "holding_force",
        "force",
        "ground_acceleration",
    }
    bench = {g.channel: g.column for g in guess_channels(from_arrays(data, "r"))}
    assert bench["displacement"] == "structure.base_displacement [m]"
    assert bench["force"] == "damper.force [N]"


@pytest.mark.parametrize(
    ("name", "unit", "quantity", "place"),
    [
        ("v", "m/s", "velocity", ""),
        ("v", "V", "voltage", ""),
        ("u", "m", "displacement", ""),
        ("u", "V", "voltage", ""),
        ("CoilCurrent", "A", "current", ""),
        ("damper.force", "N", "force", ""),
        ("base_disp", "m", "displacement", "base"),
        ("floor2 acc", "m/s2", "acceleration", "floor2"),
        ("table_acc", "g", "acceleration", "ground"),
        ("Beschleunigung", "m/s2", "acceleration", ""),
    ],
)
def test_meaning_of_names(name: str, unit: str, quantity: str, place: str) -> None:
    told = meaning(name, unit)
    assert told is not None
    assert (told.quantity, told.place) == (quantity, place)
    assert meaning("operator", None) is None


def test_units_of_channels() -> None:
    assert channel_unit("floor12_acceleration_absolute") == "m/s2"
    assert channel_unit("drift3") == "m"


@pytest.mark.parametrize("delay", [-0.0031, 0.0, 0.0008, 0.02])
@pytest.mark.parametrize("gain", [1.05, -1e3])
def test_relation_tells_gain_and_delay(gain: float, delay: float) -> None:
    late = sum(
        np.cos(w * (TIME - delay) + p) * 8e-3 for w, p in ((7.0, 0.3), (13.0, 1.0), (29.0, 2.0))
    )
    found = derivative_relation(noisy(X), gain * noisy(late) + 0.1 * gain, 0.002)
    assert found is not None
    assert found.gain == pytest.approx(gain, rel=5e-3)
    assert found.delay == pytest.approx(delay, abs=2e-4)
    assert found.offset == pytest.approx(0.1 * gain, rel=0.02)
    assert found.residual < 0.03


def test_relation_of_what_stands_still_is_none() -> None:
    assert derivative_relation(np.zeros(500), V[:500], 0.002) is None
