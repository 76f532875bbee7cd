"""Devices at any level of a building: where they may sit, and the forces that they exert there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import cont2discrete

from bristle.component import structure
from bristle.core.toml_lines import toml_table
from bristle.data.building_file import read_building
from bristle.errors import PhysicsError
from bristle.fmu.catalogue import describe
from bristle.physics.building import Building, Device, driven_mass, from_data, paper_building

TOWER: dict[str, Any] = {
    "schema": 1,
    "masses": [2.0, 1.5, 1.0, 0.8],
    "stiffnesses": [1057.0, 2500.0, 2000.0, 1500.0],
    "base": "isolated",
    "damping_ratio": 0.02,
}
BRACE = {"name": "brace", "at": "storey1"}
TIE = {"name": "tie", "between": ["floor3", "ground"]}
SECOND = {"name": "second", "at": "isolation"}
SKIP = {"name": "skip", "between": ["base", "floor2"]}
H = 0.002


def tower(*devices: dict[str, Any], **more: Any) -> Building:
    return from_data({**TOWER, **more, "devices": list(devices)})


class Run:
    """A structure's functions in plain Python, its inputs held over each step."""

    def __init__(self, building: Building, effects: dict[str, float] | None = None) -> None:
        on = sorted({name.partition(".")[0] for name in effects or {}})
        store, self.state, self.work = structure.laid_down(building, effects or {}, on)
        structure.discretise(H, store, self.work)
        self.c, self.n, self.d = structure.constants(store), building.size, len(building.devices)
        self.time = 0.0
        drifts = self.n - building.isolated
        self.outputs = [0.0] * (3 * self.n + drifts + 1 + 3 * self.d)
        self.before = [0.0] * (3 + self.d)

    def step(self, ground: float, *forces: float) -> None:
        now, new = [ground, *forces], list(self.state)
        clock = (self.time, H, 0)
        structure.step(clock, self.before, now, self.c, self.state, new, self.outputs, self.work)
        self.state, self.before, self.time = new, now, self.time + H

    def show(self, ground: float, *forces: float) -> None:
        structure.output(self.time, [ground, *forces], self.c, self.state, self.outputs, self.work)

    @property
    def accelerations(self) -> np.ndarray:
        return np.array(self.outputs[2 : 3 * self.n : 3])

    def of_device(self, k: int) -> list[float]:
        """Return displacement, velocity and holding force of a device."""
        at = len(self.outputs) - 3 * (self.d - k)
        return self.outputs[at : at + 3]


def forces(count: int, k: int) -> list[float]:
    return [float(2.0 * np.sin(0.3 * k * (j + 1)) + j) for j in range(count)]


# -- the building file


def test_places_by_name_and_by_levels() -> None:
    found = tower(BRACE, TIE, SECOND, SKIP).devices
    assert found == (
        Device("brace", 0, 1), Device("tie", -1, 3), Device("second", -1, 0), Device("skip", 0, 2),
    )  # fmt: skip
    fixed = tower({"name": "a", "at": "storey1"}, {"name": "b", "at": "storey2"}, base="fixed")
    assert [device.levels for device in fixed.devices] == [(-1, 0), (0, 1)]


@pytest.mark.parametrize(
    ("devices", "text"),
    [
        ([{**BRACE, "at": "storey4"}], "at = 'storey4'; 'isolation', 'storey1', 'storey2' or"),
        ([{**BRACE, "at": ["storey1"]}], "is right"),
        ([{**TIE, "between": ["floor9", "base"]}], "there is no level 'floor9'; 'ground', 'base'"),
        ([{**TIE, "between": ["floor1", "floor1"]}], "connects floor1 to itself"),
        ([{**TIE, "between": "floor1"}], "a list of two levels is right"),
        ([{**BRACE, "between": ["base", "floor1"]}], "give either at"),
        ([{"name": "brace"}], "give either at"),
        ([{**BRACE, "level": 1}], "unknown key 'level'"),
        ([BRACE, TIE, BRACE], "[[devices]] 3: there are two devices of the name 'brace'"),
        ([{**BRACE, "name": "damper"}], "makes the port damper_force, which the building has"),
        ([{**BRACE, "name": "floor1"}], "makes the port floor1_displacement"),
        ([{**BRACE, "name": "holding"}], "makes the port holding_force"),
        ([BRACE, {**TIE, "name": "brace_holding"}], "brace_holding_force, which the device 'br"),
        ([{**BRACE, "name": "My brace"}], "small letters, digits and _"),
        ([{**BRACE, "name": 3}], "name = 3"),
        ([{"name": f"d{i}", "at": "storey1"} for i in range(41)], "at most 40 devices"),
    ],
)
def test_what_a_building_file_may_not_say(devices: list[Any], text: str) -> None:
    with pytest.raises(PhysicsError) as raised:
        tower(*devices)
    assert text in str(raised.value)


def test_devices_that_are_no_tables_are_refused() -> None:
    with pytest.raises(PhysicsError, match=r"\[\[devices\]\]"):
        from_data({**TOWER, "devices": {"name": "brace"}})


def test_a_device_that_the_building_lacks_is_named() -> None:
    with pytest.raises(PhysicsError, match="no device 'tie'; there are brace"):
        tower(BRACE).device("tie")


def test_an_isolation_is_no_place_of_a_fixed_base() -> None:
    with pytest.raises(PhysicsError, match="'isolation'; 'storey1'"):
        tower(SECOND, base="fixed")


# -- the ports


def test_each_device_has_ports_and_the_others_stay(tmp_path: Path) -> None:
    def ports(text: str) -> list[str]:
        file = tmp_path / "tower.toml"
        file.write_text(f"schema = 1\nmasses = [2.0, 1.0]\nstiffnesses = [900.0, 800.0]\n{text}")
        shown = describe("Structure", file).variables
        return [v.name for v in shown.values() if v.causality in ("input", "output")]

    plain = ports("damping_ratio = 0.01")
    more = ports('damping_ratio = 0.01\n[[devices]]\nname = "brace"\nat = "storey1"')
    brace = ["brace_force", "brace_displacement", "brace_velocity", "brace_holding_force"]
    assert [port for port in more if port not in brace] == plain
    assert sorted(set(more) - set(plain)) == sorted(brace)


# -- the physics


def test_each_force_enters_by_its_incidence_as_exactly_as_a_matrix_exponential() -> None:
    building = tower(BRACE, TIE, SKIP)
    M, C, K = (np.array(matrix) for matrix in building[1:4])
    n = building.size
    b = np.array([[1.0, 0, 0, 0], *(device.incidence(n) for device in building.devices)]).T
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    B = np.vstack([np.zeros((n, 4)), -np.linalg.solve(M, b)])
    held = cont2discrete((A, B, np.eye(2 * n), np.zeros((2 * n, 4))), H, "zoh")
    run, x = Run(building), np.zeros(2 * n)
    for k in range(100):
        f = forces(4, k)
        run.step(0.0, f[0], 0.0, *f[1:])
        x = held[0] @ x + held[1] @ f
    assert run.state[: 2 * n] == pytest.approx(x, abs=1e-12)
    for k, device in enumerate(building.devices):
        own = np.array(device.incidence(n))
        assert run.of_device(k)[:2] == pytest.approx([own @ x[:n], own @ x[n:]], abs=1e-13)


def test_an_inner_device_gives_no_momentum_and_one_to_the_ground_all_of_it() -> None:
    building = tower(BRACE, TIE, SKIP)
    masses = np.diag(building.M)
    run = Run(building)
    for k in range(20):
        run.step(1.0, *forces(5, k))
    before = masses @ run.accelerations
    f = forces(5, 19)
    run.show(1.0, f[0], f[1], f[2] + 7.0, f[3], f[4] - 3.0)  # brace and skip
    assert masses @ run.accelerations == pytest.approx(before, abs=1e-12)
    run.show(1.0, f[0], f[1], f[2], f[3] + 5.0, f[4])  # tie
    assert masses @ run.accelerations == pytest.approx(before - 5.0, abs=1e-12)


def test_a_device_at_the_isolation_is_the_extra_force() -> None:
    named, plain = Run(tower(SECOND)), Run(tower())
    for k in range(50):
        f = forces(3, k)
        named.step(f[2], f[0], 0.0, f[1])
        plain.step(f[2], f[0], f[1])
    shared = 3 * 4 + 3 + 1
    assert named.outputs[:shared] == pytest.approx(plain.outputs, rel=1e-12, abs=1e-12)
    x, v, hold = named.of_device(0)
    assert [x, v] == named.outputs[:2]
    assert hold == pytest.approx(plain.outputs[-1] - f[0] + f[1], abs=1e-12)


def test_two_devices_on_the_same_levels_are_one_with_both_forces() -> None:
    two, one = Run(tower(BRACE, {**BRACE, "name": "other"})), Run(tower(BRACE))
    for k in range(50):
        f = forces(3, k)
        two.step(f[2], f[0], 0.0, 0.3 * f[1], 0.7 * f[1])
        one.step(f[2], f[0], 0.0, f[1])
    assert two.state == pytest.approx(one.state, abs=1e-13)


@pytest.mark.parametrize("k", range(4))
def test_at_the_holding_force_the_ends_do_not_accelerate_to_each_other(k: int) -> None:
    devices = [BRACE, TIE, SKIP, SECOND]
    building, run = tower(*devices), Run(tower(*devices))
    for i in range(30):
        run.step(3.0, *forces(6, i))
    f = forces(6, 29)
    f[2 + k] = run.of_device(k)[2]
    run.show(3.0, *f)
    ground = 3.0 if building.devices[k].lower < 0 else 0.0
    apart = np.dot(building.devices[k].incidence(4), run.accelerations)
    assert apart == pytest.approx(ground, abs=1e-11)
    assert run.of_device(k)[2] == f[2 + k]  # it does not follow its own force


def test_driven_mass_is_that_of_both_ends() -> None:
    building = tower(BRACE, TIE, SECOND)
    mass = [driven_mass(building.M, device) for device in building.devices]
    assert mass == pytest.approx([2.0 * 1.5 / 3.5, 0.8, 2.0], rel=1e-14)
    assert driven_mass(building.M, building.device("")) == 2.0
    assert paper_building().devices == ()


def test_effects_of_the_structure_leave_the_devices_as_they_are() -> None:
    straight = {"storey_softening.d_half": 1e6}
    plain, split = Run(tower(BRACE, TIE)), Run(tower(BRACE, TIE), straight)
    assert split.c.substeps == 4
    for k in range(50):
        for run in (plain, split):
            run.step(2.0 * np.sin(0.1 * k), *forces(4, k))
    assert split.state[:8] == pytest.approx(plain.state[:8], abs=1e-9)


def test_outputs_follow_no_input_that_they_do_not_list(tmp_path: Path) -> None:
    file = tmp_path / "tower.toml"
    file.write_text(
        "schema = 1\nmasses = [2.0, 1.0, 1.5]\nstiffnesses = [900.0, 800.0, 700.0]\n"
        'damping_ratio = 0.01\n[[devices]]\nname = "brace"\nat = "storey1"\n'
        '[[devices]]\nname = "tie"\nbetween = ["ground", "floor2"]\n',
        encoding="utf-8",
    )
    shown = describe("Structure", file).variables.values()
    inputs = [v.name for v in shown if v.causality == "input"]
    outputs = [v for v in shown if v.causality == "output" and v.name != "fault"]
    run = Run(read_building(file))
    for k in range(20):
        run.step(1.0, *forces(4, k))
    at = [1.0, *forces(4, 19)]
    run.show(*at)
    before = list(run.outputs)
    for i, name in enumerate(inputs):
        run.show(*(value + (j == i) for j, value in enumerate(at)))
        followed = {v.name for v, a, b in zip(outputs, before, run.outputs, strict=True) if a != b}
        listed = {v.name for v in outputs if name in (v.dependencies or ())}
        assert followed <= listed, name


# -- which of them measurements tell


def test_a_building_knows_which_of_its_devices_is_identified() -> None:
    from bristle.physics.building import with_damper

    assert with_damper(tower()) == tower()
    assert with_damper(tower()).device("").on_first
    assert with_damper(tower(BRACE)).studied == "brace"
    chosen = with_damper(tower(BRACE, TIE), "tie")
    assert with_damper(chosen).studied == "tie"
    with pytest.raises(PhysicsError, match=r"2 devices.*device = 'brace' or 'tie' .in study"):
        with_damper(tower(BRACE, TIE))
    with pytest.raises(PhysicsError, match="no device 'roof'; there are brace, tie"):
        with_damper(tower(BRACE, TIE), "roof")
    with pytest.raises(PhysicsError, match="no device 'roof'; there are none but the damper"):
        with_damper(tower(), "roof")


def test_a_device_tells_its_place_and_what_it_acts_across() -> None:
    b = tower(BRACE, TIE)
    levels = b.levels()
    assert b.device("brace").place(levels) == f"at {BRACE['at']}"
    assert b.device("tie").place(levels) == "between the ground and floor3"
    crossed = [level for level in range(b.size) if b.device("tie").crosses(level)]
    assert crossed == list(range(b.device("tie").lower + 1, b.device("tie").upper + 1))


def test_toml_has_the_devices_of_a_building(tmp_path: Path) -> None:
    data = {**TOWER, "devices": [BRACE, TIE]}
    (tmp_path / "tower.toml").write_text("\n".join(toml_table(data)) + "\n")
    assert read_building(tmp_path / "tower.toml") == from_data(data)
