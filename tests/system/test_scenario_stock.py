"""The stock scenarios, checked against the components that there are."""

import math
from pathlib import Path

import pytest

from bristle.system.library import driven_mass
from bristle.system.scenario import check_scenario, load_scenario, stock_scenarios

STOCK = {file.stem: file for file in stock_scenarios()}
EL_CENTRO = {"0p2": 0.2, "0p4": 0.4, "0p6": 0.6, "0p8": 0.8}


@pytest.mark.parametrize("file", STOCK.values(), ids=STOCK)
def test_a_stock_scenario_has_neither_error_nor_warning(file):
    found = check_scenario(file)
    assert [finding for finding in found if finding.level != "note"] == []
    # The one thing there is to say: a test signal has no unit.
    assert all("has no unit" in finding.text for finding in found)


def test_stock_scenarios_are_found_by_their_names_and_have_titles_of_their_own():
    titles = [load_scenario(name).title for name in STOCK]
    assert len(set(titles)) == len(titles)


def test_the_paper_s_passive_case():
    scenario = load_scenario("el_centro_lugre_passive")
    assert scenario.components["ground"].values == {
        "record": "el_centro_1940_ns",
        "peak": pytest.approx(0.6 * 9.81),
        "factor": 0.45,
    }
    assert scenario.components["voltage"].values == {"level": 4.0}
    assert scenario.components["damper"].values == {}
    assert (scenario.stop, scenario.step) == (35.0, 0.002)
    assert scenario.algorithm == "midpoint"


@pytest.mark.parametrize(("name", "intensity"), EL_CENTRO.items())
def test_el_centro_at_four_intensities(name, intensity):
    scenario = load_scenario(f"el_centro_{name}g_constant_voltage")
    assert scenario.components["ground"].values["peak"] == pytest.approx(intensity * 9.81)
    assert f"{intensity} g" in scenario.title


def test_the_pulse_and_the_mass_that_sticks():
    scenario = load_scenario("bingham_half_sine_sticking")
    pulse = scenario.components["ground"].values
    assert pulse == {"kind": "half_sine", "amplitude": 2.0, "duration": 0.2}
    mass = scenario.components["damper"].values["moving_mass"]
    assert mass == pytest.approx(driven_mass(None), rel=1e-12)


@pytest.mark.parametrize("name", ["bench_sine_lugre", "bench_sine_bingham"])
def test_the_bench_runs_five_cycles_at_a_peak_speed_of_a_tenth(name):
    scenario = load_scenario(name)
    rod = scenario.components["rod"].values
    assert rod["amplitude"] * 2.0 * math.pi * rod["frequency"] == pytest.approx(0.1, rel=1e-12)
    assert scenario.stop * rod["frequency"] == 5.0


def test_the_example_of_the_documentation_is_right(tmp_path):
    docs = Path(__file__).parents[2] / "docs" / "scenarios.md"
    example = docs.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    file = tmp_path / "example.toml"
    file.write_text(example, encoding="utf-8")
    assert check_scenario(file) == []


def test_another_building_brings_its_own_ports(tmp_path):
    (tmp_path / "house.toml").write_text(
        "schema = 1\nmasses = [2.0, 1.0, 1.0, 1.0]\nstiffnesses = [1e3, 2e3, 2e3, 2e3]\n"
        "damping_ratio = 0.01\n"
    )
    text = STOCK["no_damper"].read_text(encoding="utf-8")
    file = tmp_path / "mine.toml"
    file.write_text(text.replace('"Structure"', '"Structure"\nbuilding = "house.toml"'))
    structure = load_scenario(file).components["structure"]
    assert structure.building == tmp_path / "house.toml"
    assert "floor3_displacement" in structure.description.variables


def test_a_building_that_cannot_be_is_a_mistake_of_the_scenario(tmp_path):
    (tmp_path / "house.toml").write_text(
        "schema = 1\nmasses = [-2.0]\nstiffnesses = [1e3]\ndamping_ratio = 0.01\n"
    )
    text = STOCK["no_damper"].read_text(encoding="utf-8")
    file = tmp_path / "mine.toml"
    file.write_text(text.replace('"Structure"', '"Structure"\nbuilding = "house.toml"'))
    (error,) = check_scenario(file)
    assert str(tmp_path / "house.toml") in error.text
    assert "must be positive" in error.text
    assert error.line == 1 + file.read_text().splitlines().index('building = "house.toml"')


def test_a_record_that_must_not_be_trusted_is_a_mistake_of_the_scenario(tmp_path):
    (tmp_path / "gap.csv").write_text(
        "time [s],acceleration [m/s2]\n0.0,0.0\n0.1,1.0\n0.2,0.5\n0.9,0.1\n1.0,0.0\n"
    )
    text = STOCK["no_damper"].read_text(encoding="utf-8")
    file = tmp_path / "mine.toml"
    file.write_text(text.replace("el_centro_1940_ns", "gap.csv"))
    (error,) = check_scenario(file)
    assert str(tmp_path / "gap.csv") in error.text
    assert "gap" in error.text


def test_a_scenario_file_reads_well():
    for file in STOCK.values():
        lines = file.read_text(encoding="utf-8").splitlines()
        assert max(map(len, lines)) <= 100, file
        assert lines[1].startswith("# "), file  # what it is, before how it is written
