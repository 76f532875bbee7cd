"""A building's scenario carries the effects of its layer and storeys that are the user's own."""

from __future__ import annotations

import numpy as np
import pytest
import tomlkit

from bristle.learning.curve import Curve
from bristle.learning.effect_file import effect_text
from bristle.model.model import new_model
from bristle.physics.building import paper_building
from bristle.prediction.model_system import BuildingWithFile, Excitation, loads, write_scenario
from bristle.system.toml import part_text
from bristle.trust import load_file
from bristle.user_code import load

TIME = 0.01 * np.arange(200)


@pytest.fixture
def spring(tmp_path):
    """Return the file of an effect that was learned in the second storey."""
    curve = Curve(
        "force", "displacement", (), (-0.01, 0.0, 0.01), (-3.0, 0.0, 5.0), (1,), at="storey2"
    )
    file = tmp_path / "learned_1.py"
    file.write_text(effect_text("learned_1", curve, "made for a test, 2026"), encoding="utf-8")
    load_file(file, trust=True)
    yield file
    load.unload_effects()


def test_the_structure_is_given_the_effect_s_file_and_values(spring, tmp_path):
    own = loads(new_model("tanh", ("learned_1", "duffing")), paper_building())
    assert own.effects == (spring,)
    folder = tmp_path / "out"
    folder.mkdir()
    file, _ = write_scenario(
        folder, ("a house", "# a test"), BuildingWithFile(paper_building()),
        Excitation("quake", TIME, np.sin(TIME)), own,
        lambda given: part_text("damper", {"law": "tanh"}, given),
    )  # fmt: skip
    structure = tomlkit.parse(file.read_text(encoding="utf-8"))["components"]["structure"]
    assert structure["effects"] == [str(spring)]
    given = structure["parameters"]
    assert (given["learned_1.on"], given["learned_1.which"]) == (True, 2.0)
    assert [given[f"learned_1.curve[{k}]"] for k in (1, 2, 3)] == [-3.0, 0.0, 5.0]
