"""Buildings given as matrices: storeys that have no positive stiffness."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.core.finding import Finding
from bristle.system.scenario import check_scenario

SCENARIO = """
schema = 1
[run]
stop = 1.0
step = 0.001
[components.structure]
fmu = "Structure"
building = "house.toml"
parameters = {{ ground_acceleration = 0.0, damper_force = 0.0{more} }}
"""
HOUSE = """
schema = 1
base = "{base}"
M = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
C = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
K = {K}
"""
UPPER = "[[2e3, -1e3, 0.0], [-1e3, 2e3, 500.0], [0.0, 500.0, 1e3]]"
LAYER = "[[1e3, -1e3, 0.0], [-1e3, 2e3, -1e3], [0.0, -1e3, 2e3]]"
SOFT = ', "storey_softening.on" = true'
CONDENSED = "[[2e3, -1e3, 10.0], [-1e3, 2e3, -1e3], [10.0, -1e3, 1e3]]"


def found(folder: Path, K: str, more: str = "", base: str = "isolated") -> list[Finding]:
    """Return what a check finds of a building with this stiffness, notes aside."""
    (folder / "house.toml").write_text(HOUSE.format(base=base, K=K))
    file = folder / "my.toml"
    file.write_text(SCENARIO.format(more=more))
    return [one for one in check_scenario(file) if one.level != "note"]


def test_a_storey_that_pushes_outwards_is_told(tmp_path: Path) -> None:
    (one,) = found(tmp_path, UPPER)
    assert (one.level, one.line) == ("warning", 8)
    assert one.text == (
        "[components.structure] building: K gives -500 N/m between floor1 and floor2; a positive "
        "stiffness is right, with a negative entry in row 3, column 2 of K."
    )


def test_a_layer_without_stiffness_is_told(tmp_path: Path) -> None:
    (one,) = found(tmp_path, LAYER)
    assert "K gives 0 N/m between ground and base; a positive" in one.text
    assert "the sum of the first row of K" in one.text


def test_small_positive_entries_of_condensed_matrices_leave_no_word(tmp_path: Path) -> None:
    assert found(tmp_path, CONDENSED) == []
    assert found(tmp_path, CONDENSED, SOFT) == []


@pytest.mark.parametrize(
    ("K", "base", "more", "level"),
    [
        (UPPER, "isolated", SOFT, "error"),
        (UPPER, "isolated", SOFT + ', "storey_softening.which" = 2', "error"),
        (UPPER, "isolated", SOFT + ', "storey_softening.which" = 1', "warning"),
        (UPPER, "fixed", SOFT + ', "storey_softening.which" = 3', "error"),
        (UPPER, "isolated", ', "duffing.on" = true', "warning"),
        (LAYER, "isolated", ', "duffing.on" = true', "error"),
        (LAYER, "isolated", SOFT, "warning"),
        (LAYER, "fixed", SOFT, "error"),
        (UPPER, "isolated", ', "base_friction.on" = true', "warning"),
    ],
)  # fmt: skip
def test_an_effect_that_needs_the_stiffness_is_refused(
    tmp_path: Path, K: str, base: str, more: str, level: str
) -> None:
    (one,) = found(tmp_path, K, more, base)
    assert one.level == level
    if level == "error":
        name = more.split('"')[1].partition(".")[0]
        assert one.text.startswith(
            f"structure.{name} needs the stiffness below each level: K gives"
        )
