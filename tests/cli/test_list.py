"""`bristle list`: what there is, with units."""

import json

import pytest

from bristle.cli import main
from bristle.data import list_ground_motions
from bristle.fmu.catalogue import component_names
from bristle.physics.effect import EFFECTS
from bristle.system.scenario import stock_scenarios


def answer(capsys, *arguments):
    assert main(["list", *arguments]) == 0
    return capsys.readouterr().out


def test_the_whole_list_names_everything(capsys):
    out = answer(capsys)
    for name in component_names():
        assert f"  {name} " in out
    for file in stock_scenarios():
        assert f"  {file.stem} " in out
    for record in list_ground_motions():
        assert f"\n  {record.name}\n" in out
    for effect in EFFECTS:
        assert f"  {effect} " in out


def test_components_have_a_line_each(capsys):
    lines = answer(capsys, "components").splitlines()
    assert lines[0] == "components"
    assert lines[1].split() == ["name", "description"]
    named = [line for line in lines[2:] if line[2] != " "]  # others go on
    assert [line.split()[0] for line in named] == component_names()
    assert all(len(line.split()) > 3 for line in named)


def test_ports_have_causality_unit_and_bounds(capsys):
    rows = {
        row["name"]: row for row in json.loads(answer(capsys, "ports", "LuGreDamper", "--json"))
    }
    assert rows["velocity"]["unit"] == "m/s"
    assert rows["velocity"]["causality"] == "input"
    assert rows["holding_force"]["causality"] == "input (optional)"
    assert rows["force"]["causality"] == "output"
    assert (rows["sigma_b"]["start"], rows["sigma_b"]["unit"]) == (20.0, "N.s/(m.V)")
    assert rows["gas_spring.on"]["type"] == "Boolean"
    assert rows["moving_mass"]["minimum"] == 0.0


def test_ports_are_readable_without_json(capsys):
    lines = answer(capsys, "ports", "LuGreDamper").splitlines()
    titles = [line for line in lines if line[:1] != " "]
    assert titles[:3] == ["inputs", "outputs", "parameters"]
    assert titles[3].startswith("Effects, each with a switch")  # and not the parameters of all
    assert max(map(len, lines)) <= 100
    row = next(line for line in lines if line.strip().startswith("sigma_b "))
    assert row.split()[:5] == ["sigma_b", "N.s/(m.V)", "20", "0", "10⁷"]


def test_ports_of_another_building(capsys, tmp_path):
    file = tmp_path / "house.toml"
    file.write_text(
        "schema = 1\nmasses = [2.0, 1.0, 1.0, 1.0]\nstiffnesses = [1e3, 2e3, 2e3, 2e3]\n"
        "damping_ratio = 0.01\n"
    )
    rows = json.loads(answer(capsys, "ports", "Structure", "--building", str(file), "--json"))
    assert "floor3_displacement" in {row["name"] for row in rows}


def test_records_have_peak_and_duration(capsys):
    rows = json.loads(answer(capsys, "records", "--json"))
    el_centro = next(row for row in rows if row["name"] == "el_centro_1940_ns")
    assert el_centro["peak"] == pytest.approx(0.31882 * 9.81, rel=1e-3)
    assert el_centro["duration"] == pytest.approx(31.18)
    assert "peak [m/s2]" in answer(capsys, "records")


def test_scenarios_have_their_titles(capsys):
    rows = {row["name"]: row["title"] for row in json.loads(answer(capsys, "scenarios", "--json"))}
    assert rows["el_centro_lugre_passive"] == "El Centro, LuGre damper at 4 V"
    assert set(rows) == {file.stem for file in stock_scenarios()}


def test_effects_have_site_and_meaning(capsys):
    rows = {row["name"]: row for row in json.loads(answer(capsys, "effects", "--json"))}
    assert set(rows) == set(EFFECTS)
    assert rows["gas_spring"]["site"] == "damper"
    assert rows["gas_spring"]["about"].startswith("Gas spring")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["ports"], "expected a name"),
        (["ports", "LugreDamper"], 'Did you mean "LuGreDamper"?'),
        (["ports", "nix.fmu"], "nix.fmu"),
        (["ports", "LuGreDamper", "--building", "x.toml"], "--building goes with Structure"),
        (["ports", "Structure", "--building", "nix.toml"], "nix.toml"),
        (["components", "LuGreDamper"], "only ports, effects and laws take a name"),
        (["records", "--building", "x.toml"], "--building goes with ports"),
    ],
)
def test_a_wrong_question_is_one_message(capsys, arguments, words):
    assert main(["list", *arguments]) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert "Traceback" not in captured.err
    assert captured.out == ""
