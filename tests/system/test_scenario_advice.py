"""What is allowed but seldom meant: order, coupling steps, saturation, masses, loops."""

import pytest
from valid import BASE_MASS, VALID

from bristle.engine.run import run
from bristle.system.advice import longest_step
from bristle.system.scenario import check_scenario, load_scenario

GROUND = VALID[VALID.index("[components.ground]") : VALID.index("[components.structure]")]
BINGHAM = {"damper.fmu": "BinghamDamper"}


@pytest.fixture
def levels(tmp_path):
    """Check a text: {level: texts}; the gas spring is taken out."""

    def of(text=VALID, overrides=None):
        file = tmp_path / "my.toml"
        file.write_text(text.replace('{ "gas_spring.on" = true, "gas_spring.k" = 80.0 }', "{}"))
        found = check_scenario(file, overrides)
        assert all(finding.level != "error" for finding in found), found
        load_scenario(file, overrides)  # advice stops nothing
        return {
            level: [finding.text for finding in found if finding.level == level]
            for level in ("warning", "note")
        }

    return of


@pytest.fixture
def told(levels):
    """Check a text that leaves no note: its warnings."""

    def of(text=VALID, overrides=None):
        found = levels(text, overrides)
        assert found["note"] == []
        return found["warning"]

    return of


def test_the_ground_motion_after_the_structure_is_a_warning(told, tmp_path):
    text = VALID.replace(GROUND, "").replace(
        "[components.voltage]", GROUND + "[components.voltage]"
    )
    (warning,) = told(text)
    assert "[components.ground] comes after [components.structure]" in warning
    assert "one step late" in warning
    (finding,) = check_scenario(tmp_path / "my.toml")
    assert (tmp_path / "my.toml").read_text().splitlines()[
        finding.line - 1
    ] == "[components.ground]"
    assert told(text, {"run.algorithm": "jacobi"}) == []


def grows(algorithm, step, mass, c, k):
    """Return whether a mass on bristles and a dashpot moves ever more, in the master's order."""
    v, z, force = 1e-6, 0.0, 0.0
    for _ in range(100_000):
        given = v
        v -= step / mass * force
        if algorithm == "gauss-seidel":
            given = v
        z += step * given
        force = k * z + c * given
        if abs(v) > 1e-3:
            return True
    return False


def midpoint_grows(order, step, mass, c, k):
    """Return the same of midpoint, for either order of the two, or with one rollback."""
    v = before = 1e-6
    z = force = last = 0.0
    for _ in range(100_000):
        if order == "structure first":
            new = v - step / mass * (1.5 * force - 0.5 * last)
            z += 0.5 * step * (v + new)
        elif order == "damper first":
            z += step * (1.5 * v - 0.5 * before)
            new = v - 0.5 * step / mass * (force + k * z + c * (2.0 * v - before))
        else:
            tried = v - step / mass * (1.5 * force - 0.5 * last)
            guess = k * (z + 0.5 * step * (v + tried)) + c * tried
            new = v - 0.5 * step / mass * (force + guess)
            z += 0.5 * step * (v + new)
        v, before = new, v
        force, last = k * z + c * v, force
        if abs(v) > 1e-3:
            return True
    return False


@pytest.mark.parametrize("order", ["structure first", "damper first", "rollback"])
@pytest.mark.parametrize(("c", "k"), [(185.0, 2310.0), (265.0, 3970.0), (260.0, 0.0), (10.0, 1e4)])
def test_midpoint_is_stable_up_to_its_longest_step_in_either_order(order, c, k):
    algorithm = "midpoint-iterated" if order == "rollback" else "midpoint"
    limit = longest_step(algorithm, BASE_MASS, c, k)
    assert not midpoint_grows(order, 0.99 * limit, BASE_MASS, c, k)
    assert midpoint_grows(order, 1.01 * limit, BASE_MASS, c, k)


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
@pytest.mark.parametrize(("c", "k"), [(185.0, 2310.0), (265.0, 3970.0), (260.0, 0.0), (100.0, 1e4)])
def test_the_longest_step_is_where_the_coupled_motion_begins_to_grow(algorithm, c, k):
    limit = longest_step(algorithm, BASE_MASS, c, k)
    assert not grows(algorithm, 0.99 * limit, BASE_MASS, c, k)
    assert grows(algorithm, 1.01 * limit, BASE_MASS, c, k)


@pytest.mark.parametrize(
    ("overrides", "c", "k"),
    [
        ({}, 5.0 + 100.0 + 20.0 * 4.0, 650.0 + 415.0 * 4.0),
        ({"voltage.level": 8.0}, 5.0 + 100.0 + 20.0 * 8.0, 650.0 + 415.0 * 8.0),
        ({"voltage.level": 0.0, "damper.sigma_2": 150.0}, 5.0 + 150.0, 650.0),
        ({"voltage.level": 6.0, "damper.v_max": 6.0}, 5.0 + 100.0 + 20.0 * 6.0, 650.0 + 415.0 * 6),
        (BINGHAM, 100.0 + 20.0 * 4.0, 0.0),
        ({**BINGHAM, "structure.attached_mass": 2.0}, 100.0 + 20.0 * 4.0, 0.0),
    ],
)
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel", "midpoint"])
def test_a_step_beyond_stability_is_a_warning_with_the_limit(told, overrides, c, k, algorithm):
    mass = BASE_MASS + overrides.get("structure.attached_mass", 0.0)
    jumps = algorithm == "midpoint" and k == 0.0  # friction that nothing holds: as gauss-seidel
    limit = longest_step("gauss-seidel" if jumps else algorithm, mass, c, k)
    overrides = {**overrides, "run.algorithm": algorithm}
    below, above = 0.99 * limit, 1.01 * limit
    assert told(VALID, {**overrides, "run.step": below, "run.stop": 100 * below}) == []
    (warning,) = told(VALID, {**overrides, "run.step": above, "run.stop": 100 * above})
    assert f"above about {1e3 * limit:.3g} ms" in warning
    assert ("or gauss-seidel" in warning) == (algorithm == "jacobi")


@pytest.mark.parametrize(
    ("algorithm", "limit"),
    [
        ("jacobi", 6.69e-3),
        ("gauss-seidel", 13.5e-3),
        pytest.param("midpoint", 7.43e-3, marks=pytest.mark.slow),  # two runs of 10 s
    ],
)
def test_the_fmus_themselves_become_unstable_where_the_warning_says(algorithm, limit, tmp_path):
    """The stock pulse at 8 V: below the limit the base comes to rest, above it never does."""

    def speed_at_the_end(step):
        overrides = {"voltage.level": 8.0, "run.algorithm": algorithm, "run.step": step}
        frame = run("half_sine_pulse", {**overrides, "run.stop": round(10.0 / step) * step})
        return frame["structure.base_velocity"].loc[5.0:].abs().max()

    findings = check_scenario(
        "half_sine_pulse",
        {"voltage.level": 8.0, "run.algorithm": algorithm, "run.step": 0.02},
    )
    assert f"above about {1e3 * limit:.3g} ms" in findings[0].text
    below, above = speed_at_the_end(0.95 * limit), speed_at_the_end(1.05 * limit)
    assert below < 3e-4
    assert above > 4e-4
    assert above > 4.0 * below


def test_an_unknown_voltage_counts_as_the_highest(levels):
    text = VALID.replace(
        'fmu = "ConstantVoltage"\nparameters = { level = 4.0 }',
        'fmu = "SignalSource"\nparameters = { kind = "sine" }',
    ).replace('"voltage.voltage"', '"voltage.value"')
    overrides = {"run.algorithm": "jacobi", "run.step": 0.01}
    found = levels(text, overrides)
    assert "about 6.69 ms" in found["warning"][0]
    assert "has no unit" in found["note"][0]


def test_two_dampers_add_up(told):
    second = '[components.second]\nfmu = "LuGreDamper"\nparameters = { voltage = 4.0 }\n\n'
    text = VALID.replace("[connections]\n", second + "[connections]\n")
    text += (
        '"structure.extra_force" = "second.force"\n'
        '"second.displacement" = "structure.base_displacement"\n'
        '"second.velocity" = "structure.base_velocity"\n'
    )
    limit = longest_step("jacobi", BASE_MASS, 2 * 185.0, 2 * 2310.0)
    overrides = {"run.algorithm": "jacobi", "run.step": 0.006, "run.stop": 6.0}
    (warning,) = told(text, overrides)
    assert f"about {1e3 * limit:.3g} ms" in warning
    assert "damper, second" in warning


def test_what_connections_multiply_counts(told):
    text = VALID.replace(
        '"structure.damper_force" = "damper.force"',
        '"structure.damper_force" = { from = "damper.force", factor = 2.0 }',
    )
    limit = longest_step("jacobi", BASE_MASS, 2 * 185.0, 2 * 2310.0)
    (warning,) = told(text, {"run.algorithm": "jacobi", "run.step": 0.006, "run.stop": 6.0})
    assert f"about {1e3 * limit:.3g} ms" in warning
    held = text + '"damper.holding_force" = "structure.holding_force"\n'
    assert told(held, {**BINGHAM, "damper.moving_mass": 0.5 * BASE_MASS}) == []


@pytest.mark.parametrize(("level", "volts"), [(10.0, 6.0), (3.0, -1.0)])
def test_a_voltage_counts_as_its_connection_gives_it(told, level, volts):
    text = VALID.replace(
        '"damper.voltage" = "voltage.voltage"',
        '"damper.voltage" = { from = "voltage.voltage", factor = 1.0, offset = -4.0 }',
    )
    found = told(text, {"voltage.level": level})
    assert len(found) == (volts < 0.0)
    assert all(f"damper.voltage = {volts:g} V lies outside" in one for one in found)


@pytest.mark.parametrize("level", [-1.0, 9.0])
def test_a_voltage_that_saturates_the_damper_is_a_warning(told, level):
    (warning,) = told(VALID, {"voltage.level": level})
    assert f"damper.voltage = {level:g} V lies outside 0 to 8 V" in warning
    assert f"feels {min(max(level, 0.0), 8.0):g} V" in warning


@pytest.mark.parametrize("level", [0.0, 8.0])
def test_the_ends_of_the_voltage_range_are_fine(told, level):
    assert told(VALID, {"voltage.level": level}) == []


def test_a_voltage_held_in_the_parameters_is_looked_at_too(told):
    text = VALID.replace('"damper.voltage" = "voltage.voltage"\n', "")
    (warning,) = told(text, {"damper.voltage": 12.0})
    assert 'override "damper.voltage"' in warning
    assert "12 V lies outside" in warning


def test_holding_force_and_its_mass_belong_together(told):
    text = VALID + '"damper.holding_force" = "structure.holding_force"\n'
    assert told(text, {**BINGHAM, "damper.moving_mass": BASE_MASS}) == []
    (warning,) = told(text, {**BINGHAM, "damper.moving_mass": 2.5})
    assert "moving_mass = 2.5 kg; the mass that it moves is 1.96936 kg" in warning
    assert told(
        text, {**BINGHAM, "damper.moving_mass": BASE_MASS + 0.5, "structure.attached_mass": 0.5}
    ) == []  # fmt: skip


def test_fluid_inertia_of_half_the_moving_mass_is_a_warning(told):
    on = {"damper.fluid_inertia.on": True}
    assert told(VALID, {**on, "damper.fluid_inertia.m_f": 0.49 * BASE_MASS}) == []
    (warning,) = told(VALID, {**on, "damper.fluid_inertia.m_f": 0.5 * BASE_MASS})
    assert "half or more of the moving mass of 1.969 kg" in warning
    assert "attached_mass" in warning


def test_a_parameter_of_an_effect_that_is_off_is_a_warning(told):
    (warning,) = told(VALID, {"damper.gas_spring.k": 60.0})
    assert "damper.gas_spring.k does nothing while damper.gas_spring.on is false" in warning


def test_an_algebraic_loop_is_a_note(levels):
    felt = '"damper.acceleration" = "structure.base_acceleration_absolute"\n'
    (note,) = levels(VALID + felt)["note"]
    assert "damper.force" in note
    assert "structure.base_acceleration_absolute" in note
    assert "one step old" in note


def test_the_stock_loop_of_damper_and_structure_is_none(told):
    # Velocity does not follow the force at once, so the holding force closes no loop.
    text = VALID + '"damper.holding_force" = "structure.holding_force"\n'
    assert told(text, {**BINGHAM, "damper.moving_mass": BASE_MASS}) == []
