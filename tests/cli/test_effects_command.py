"""`bristle list effects`: everything about every effect, from the code."""

from __future__ import annotations

import json

import pytest

from bristle.cli import main
from bristle.core.text import typed
from bristle.physics import effects as _registered  # noqa: F401  (importing registers them)
from bristle.physics.effect import EFFECTS


def answer(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["list", "effects", *arguments]) == 0
    return capsys.readouterr().out


def test_all_effects_are_listed_with_their_data(capsys: pytest.CaptureFixture[str]) -> None:
    rows = json.loads(answer(capsys, "--json"))
    assert [row["name"] for row in rows] == sorted(EFFECTS)
    for row in rows:
        effect = EFFECTS[row["name"]]
        assert (row["site"], row["source"], row["expect"]) == (
            effect.site,
            effect.source,
            effect.expect,
        )
        assert set(row["parameters"]) == set(effect.parameters)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_one_effect_is_told_in_full(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    lines = answer(capsys, name).splitlines()
    assert max(map(len, lines)) <= 100
    said = " ".join(" ".join(lines).split())
    effect = EFFECTS[name]
    assert effect.first_line() in said
    assert effect.source in said
    assert effect.expect in said
    for parameter, about in effect.parameters.items():
        assert f"{name}.{parameter} {typed(about.value)} {about.unit} " in said
        assert about.text in said


def test_every_effect_has_its_row(capsys: pytest.CaptureFixture[str]) -> None:
    lines = answer(capsys).splitlines()
    first = [line[2:].split(" ")[0] for line in lines[2:-1]]
    assert [name for name in first if name] == sorted(EFFECTS)
    assert lines[-1] == "All of one:  bristle list effects NAME"
    assert max(map(len, lines)) <= 100  # the last column is broken into lines


def test_an_unknown_effect_is_an_error_that_names_the_nearest(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["list", "effects", "gas_sprin"]) == 2
    assert 'Did you mean "gas_spring"?' in capsys.readouterr().err
