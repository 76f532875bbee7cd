"""Controllers of a comparison suited to its building and damper."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.component.controller_file import read_controller
from bristle.controller_comparison import compare_controllers
from bristle.fmu import catalogue
from bristle.physics.building import PAPER
from bristle.physics.laws import LAWS
from bristle.synthesis import design

MOTION = "el_centro_1940_ns,peak=0.4g,factor=0.45,stop=4"


def test_a_small_damper_is_inverted_as_a_large_one(tmp_path: Path) -> None:
    found = []
    for size in (1.0, 0.02):
        masses, stiffnesses = ([size * value for value in PAPER[key]] for key in
                               ("masses", "stiffnesses"))  # fmt: skip
        file = tmp_path / f"size_{size}.toml"
        file.write_text(
            f'schema = 1\nbase = "isolated"\nmasses = {masses}\nstiffnesses = {stiffnesses}\n'
            "damping_ratio = 0.01\n"
        )
        law = LAWS["lugre"].parameters
        values = [f"{name}={size * law[name].value}" for name in law if name.startswith("sigma")]
        one = compare_controllers(
            [MOTION], "HinfInverse", building=file, damper=",".join(["LuGreDamper", *values]),
            grid=3, workers=1,
        )  # fmt: skip
        found.append(one.value(one.motions[0], "HinfInverse", "rms controller.voltage"))
    assert found[1] == pytest.approx(found[0], rel=0.03)


def test_a_controller_takes_largest_voltage_and_inverse_from_the_damper_of_its_design(
    tmp_path: Path,
) -> None:
    file = tmp_path / "mine.json"

    def starts(component: str, damper: dict[str, object]) -> dict[str, object]:
        made = design({"kind": "hinf", "damper": damper}).controller
        made.save(file)
        there = catalogue.describe(component, controller=file).variables
        names = ("v_max", "inverse", "bouc_wen.f_v", "bouc_wen.rho")
        return {name: there[name].start for name in names if name in there}

    damper = {"law": "bouc_wen", "parameters": {"f_v": 2.0}, "v_max": 4.0}
    assert starts("HinfInverse", damper) == {
        "v_max": 4.0, "inverse": "bouc_wen", "bouc_wen.f_v": 2.0, "bouc_wen.rho": 500.0,
    }  # fmt: skip
    assert starts("ClippedOptimal", damper) == {"v_max": 4.0}
    usual = starts("HinfInverse", {})
    assert (usual["v_max"], usual["inverse"]) == (8.0, "lugre")


def test_a_design_file_without_a_building_is_for_that_of_the_comparison(tmp_path: Path) -> None:
    tower, file = tmp_path / "tower.toml", tmp_path / "mine.toml"
    tower.write_text(
        "schema = 1\nmasses = [4.0, 2.0, 2.0, 2.0]\n"
        "stiffnesses = [1500.0, 4000.0, 3500.0, 3000.0]\n"
        'base = "isolated"\ndamping_ratio = 0.01\n'
    )
    file.write_text('schema = 1\nkind = "hinf"\norder = 9\n')  # the library's plant has 8 states
    found = compare_controllers(
        ["el_centro_1940_ns,stop=1"], str(file), building=tower, grid=3, workers=1,
        out=tmp_path / "out",
    )  # fmt: skip
    assert found.controllers == ["mine"]
    assert read_controller(tmp_path / "out" / "files" / "mine.json").n == 9
