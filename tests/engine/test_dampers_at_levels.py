"""Dampers at several levels of a building: both engines, energy, a matrix solution, wiring."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lsim

from bristle import run
from bristle.data.building_file import read_building
from bristle.engine.coupled import Coupled, room, sharing
from bristle.physics.building import Building, Device
from bristle.system.library import driven_mass
from bristle.system.scenario import check_scenario, copy_scenario, load_scenario

STOCK = "dampers_at_two_levels"
BUILDING = """
schema = 1
masses = [2.0, 1.5, 1.0]
stiffnesses = [1057.0, 2500.0, 2000.0]
base = "isolated"
{damping}

[[devices]]
name = "brace"
at = "storey1"

[[devices]]
name = "tie"
between = ["ground", "floor2"]
"""
PLACES = {"damper": "base", "brace": "brace", "tie": "tie"}  # by where the motion is felt


def scenario(
    folder: Path, parameters: dict[str, str], damping: str = "damping_ratio = 0.02"
) -> Path:
    """Write a scenario with a damper of each name, its keys as given."""
    (folder / "tower.toml").write_text(BUILDING.format(damping=damping), encoding="utf-8")
    dampers = [f"[components.{name}]\n{keys}" for name, keys in parameters.items()]
    wires = []
    for name in parameters:
        wires.append(f'"structure.{name}_force" = "{name}.force"')
        for what in ("displacement", "velocity"):
            wires.append(f'"{name}.{what}" = "structure.{PLACES[name]}_{what}"')
    idle = ", ".join(f"{name}_force = 0.0" for name in PLACES if name not in parameters)
    lines = [
        'schema = 1\ntitle = "pulse"\n[run]\nstop = 2.0\nstep = 0.001',
        '[components.ground]\nfmu = "SignalSource"',
        'parameters = { kind = "half_sine", amplitude = 3.0, duration = 0.2 }',
        *dampers,
        '[components.structure]\nfmu = "Structure"\nbuilding = "tower.toml"',
        f"parameters = {{ {idle} }}",
        '[connections]\n"structure.ground_acceleration" = "ground.value"',
        *wires,
    ]
    file = folder / "pulse.toml"
    file.write_text("\n".join(lines), encoding="utf-8")
    return file


LUGRE = 'fmu = "LuGreDamper"\nparameters = { voltage = 2.0 }'


def energy(building: Building, columns: dict[str, np.ndarray]) -> np.ndarray:
    """Return kinetic and elastic energy [J] over time."""
    M, K = np.array(building.M), np.array(building.K)
    levels = building.levels()
    q = np.array([columns[f"structure.{level}_displacement"] for level in levels])
    v = np.array([columns[f"structure.{level}_velocity"] for level in levels])
    return np.asarray(0.5 * np.sum(v * (M @ v) + q * (K @ q), axis=0))


def test_the_dampers_take_what_an_undamped_building_loses(tmp_path: Path) -> None:
    names = ["damper", "brace", "tie"]
    file = scenario(tmp_path, dict.fromkeys(names, LUGRE), "damping_ratio = 0.0")
    columns = Coupled().run(load_scenario(file))
    after = columns["time"] > 0.2005
    kept = energy(read_building(tmp_path / "tower.toml"), columns)[after]
    taken = sum(columns[f"{name}.dissipated_energy"] for name in names)[after]
    assert kept[0] > 0.05
    assert kept + taken == pytest.approx(kept[0] + taken[0], abs=2e-5 * kept[0])
    assert all(columns[f"{name}.dissipated_energy"][-1] > 0.1 * kept[0] for name in names[:2])


def test_dashpots_at_several_levels_are_their_matrices(tmp_path: Path) -> None:
    c = {"damper": 10.0, "brace": 25.0, "tie": 8.0}
    # A Bingham law without friction whose viscous part does not fall off at such speeds.
    dashpot = 'law = "bingham"\nparameters = {{ voltage = 0.0, f_c = 0.0, c_0 = {}, v_n = 100 }}'
    file = scenario(tmp_path, {name: dashpot.format(value) for name, value in c.items()})
    columns = Coupled().run(load_scenario(file, {"ground.amplitude": 0.03}))
    building = read_building(tmp_path / "tower.toml")
    M, C, K = (np.array(matrix) for matrix in building[1:4])
    for name, value in c.items():
        b = np.array(building.device("" if name == "damper" else name).incidence(3))
        C = C + value * np.outer(b, b)
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    fine = np.arange(20001) * 1e-4
    ground = np.where(fine < 0.2, 0.03 * np.sin(np.pi * fine / 0.2), 0.0)
    system = (A, np.array([[0.0]] * 3 + [[-1.0]] * 3), np.eye(6), np.zeros((6, 1)))
    x = lsim(system, ground, fine)[1][::10]
    for i, level in enumerate(building.levels()):
        found = columns[f"structure.{level}_displacement"]
        assert found == pytest.approx(x[:, i], abs=5e-5 * np.abs(x[:, i]).max()), level
    for name in ("brace", "tie"):
        b = np.array(building.device(name).incidence(3))
        found = columns[f"structure.{name}_velocity"]
        assert found == pytest.approx(x[:, 3:] @ b, abs=1e-4 * np.abs(found).max()), name


def apart(step: float, **more: Any) -> pd.Series[float]:
    """Return the largest difference of the engines as a share of each column's peak."""
    given = {"run.step": step, "run.stop": 0.6, **more}
    fmu, compiled = (run(STOCK, given, engine=engine) for engine in ("fmu", "compiled"))
    moving = compiled.columns[compiled.abs().max() > 0.0]
    return (fmu[moving] - compiled[moving]).abs().max() / compiled[moving].abs().max()


def test_the_master_comes_to_the_coupled_engine_in_second_order() -> None:
    coarse, fine = apart(0.002), apart(0.001)
    watched = ["damper.force", "brace.force", "structure.floor2_acceleration_absolute"]
    assert (fine[watched] < 0.006).all()
    assert (coarse[watched] > 3.0 * fine[watched]).all()


def test_dry_friction_sticks_at_two_levels_at_once(tmp_path: Path) -> None:
    bingham = 'fmu = "BinghamDamper"\nparameters = {{ voltage = {} }}'
    file = scenario(
        tmp_path, {name: bingham.format(v) for name, v in (("damper", 8.0), ("brace", 6.0))}
    )
    columns = Coupled().run(load_scenario(file, {"run.stop": 5.0}))
    late = columns["time"] > 4.0
    for port in ("base_velocity", "brace_velocity"):
        assert np.abs(columns[f"structure.{port}"]).max() > 3e-3
        assert np.abs(columns[f"structure.{port}"][late]).max() < 1e-6, port
    assert np.abs(columns["structure.drift2"][late]).max() > 5e-5  # the floor above still swings
    # At rest the brace carries what storey 1 is loaded with, beside its own spring.
    hold, force = columns["structure.brace_holding_force"][late], columns["brace.force"][late]
    assert hold == pytest.approx(force, abs=1e-2 * np.abs(force).max())


def test_dampers_at_one_place_share_and_others_by_how_they_move_each_other() -> None:
    scenario = load_scenario(STOCK)
    building = read_building(scenario.components["structure"].building)
    n = building.size
    M_inverse = np.linalg.inv(building.M)
    held = np.zeros((2 * n, n + 1))
    held[n:, :n] = -0.001 * M_inverse
    record = {"n": n, "held": held.ravel()}
    first, brace = building.device(""), building.device("brace")

    def shared(*devices: Device) -> float:
        """Return by how much each holds less, of so many dampers that stick."""
        dampers = [
            {"on_structure": 0, "signed": True, "lower": one.lower, "upper": one.upper}
            for one in devices
        ]
        return sharing(dampers, [record], 0, [0.0] * room(len(dampers)))

    assert shared() == 1.0
    assert shared(first, first, first) == 3.0
    # Eigenvalues 1 - r and 1 + r, their mean 1; two on either place double it.
    assert shared(first, brace) == pytest.approx(1.0)
    assert shared(first, first, brace, brace) == pytest.approx(2.0)


# -- what check finds


def warnings(file: Path, overrides: dict[str, Any] | None = None) -> list[str]:
    return [f.text for f in check_scenario(file, overrides) if f.level in ("warning", "error")]


def test_check_compares_a_damper_with_the_mass_at_its_own_place(tmp_path: Path) -> None:
    names = {"damper": LUGRE, "brace": LUGRE.replace("voltage = 2.0", "voltage = 8.0")}
    file = scenario(tmp_path, names)
    assert warnings(file) == []
    (found,) = warnings(file, {"run.step": 0.01})  # the brace drives less mass than the damper
    assert "coupling of brace with structure becomes unstable (0.8571 kg" in found
    tower = tmp_path / "tower.toml"
    assert driven_mass(tower, "brace_force") == pytest.approx(2.0 * 1.5 / 3.5)
    assert driven_mass(tower, "brace_force", 1.0) == pytest.approx(3.0 * 1.5 / 4.5)
    assert driven_mass(tower, "damper_force", 1.0) == 3.0


def test_a_damper_that_feels_another_motion_is_a_warning(tmp_path: Path) -> None:
    file = scenario(tmp_path, {"damper": LUGRE, "brace": LUGRE})
    wrong = {"connections.brace.velocity": "structure.floor1_velocity"}
    (found,) = warnings(file, wrong)
    assert found.removeprefix('override "connections.brace.velocity": ') == (
        "brace feels structure.floor1_velocity and pushes structure.brace_force; the motion there "
        "is structure.brace_velocity."
    )


def test_a_device_without_a_damper_is_an_error_and_the_old_place_may_stay_empty(
    tmp_path: Path,
) -> None:
    file = scenario(tmp_path, {"tie": LUGRE})
    file.write_text(file.read_text().replace("damper_force = 0.0, brace_force = 0.0", ""))
    (found,) = warnings(file)
    assert '"structure.brace_force" [N] has no source' in found


def test_a_wrong_device_is_an_error_with_file_and_key(tmp_path: Path) -> None:
    file = scenario(tmp_path, {"damper": LUGRE})
    tower = tmp_path / "tower.toml"
    tower.write_text(tower.read_text().replace('"storey1"', '"storey7"'), encoding="utf-8")
    found = warnings(file)
    assert any("tower.toml:" in text and "storey7" in text for text in found), found


def test_a_copy_of_a_stock_scenario_takes_its_building_along(tmp_path: Path) -> None:
    file = copy_scenario(STOCK, tmp_path / "mine.toml")
    assert warnings(file) == []
    assert (tmp_path / "buildings" / "damper_in_first_storey.toml").is_file()
    copy_scenario(STOCK, tmp_path / "second.toml")  # the same building may stay
