"""A building's scenario carries the effects of its layer and storeys that are the user's own."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.learning.curve import Curve
from bristle.learning.effect_file import effect_text
from bristle.model.model import new_model
from bristle.physics.building import paper_building
from bristle.prediction.model_system import BuildingWithFile, Excitation, building_system, loads
from bristle.user_code import load
from bristle.user_code.load import load_file

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


def test_the_structure_is_given_the_effect_s_file_and_values(spring):
    own = loads(new_model("tanh", ("learned_1", "duffing")), paper_building())
    assert own.effects == (spring,)
    system = building_system(
        "a house", BuildingWithFile(paper_building()), Excitation("quake", TIME, np.sin(TIME)),
        own, lambda given: {"law": "tanh", "parameters": given},
    )  # fmt: skip
    structure = system.components["structure"]
    assert structure.effects == (spring,)
    given = structure.values
    assert (given["learned_1.on"], given["learned_1.which"]) == (True, 2.0)
    assert [given[f"learned_1.curve[{k}]"] for k in (1, 2, 3)] == [-3.0, 0.0, 5.0]
