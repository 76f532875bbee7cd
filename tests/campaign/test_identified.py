"""Ensembles with a damper as a study has it: its parameters are drawn together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bristle.campaign import read_ensemble
from bristle.campaign.ensemble_file import Places
from bristle.errors import BristleError, EnsembleError
from bristle.model.model import Model, new_model
from bristle.model.model_file import model_text

Write = Callable[..., Path]
MASSES = '"structure.building.masses.2" = { uniform = [1.1, 1.4] }\n'
SIGMA = '"damper.sigma_a" = { normal = [650.0, 65.0], within = [500.0, 800.0] }\n'
STD = {"sigma_a": 20.0, "sigma_0": 10.0}
COVARIANCE = np.array([[400.0, -180.0], [-180.0, 100.0]])
NAMES = ("damper.sigma_a", "damper.sigma_0")


def a_model(*effects: str) -> Model:
    model = new_model("lugre", effects).with_values({"sigma_a": 640.0, "sigma_0": 400.0}, STD)
    return model.with_covariance(list(STD), COVARIANCE)


def a_study(folder: Path, model: Model | None = None) -> Path:
    """Write what an ensemble reads of a study."""
    rig = folder / "my_rig"
    rig.mkdir()
    (rig / "model.toml").write_text(model_text(model or a_model()))
    return rig


def with_study(write: Write, *replaced: tuple[str, str], more: str = "") -> Path:
    path = write((SIGMA, ""), *replaced)
    path.write_text(path.read_text() + '\n[identified]\nmodel = "my_rig"\n' + more)
    return path


def test_parameters_are_drawn_together(write: Write, tmp_path: Path) -> None:
    a_study(tmp_path)
    plan = read_ensemble(with_study(write))
    assert [one.name for one in plan.varied][:2] == list(NAMES)
    drawn = np.array([[plan.values(run)[name] for name in NAMES] for run in range(2000)])
    np.testing.assert_allclose(drawn.mean(axis=0), [640.0, 400.0], rtol=5e-3)
    np.testing.assert_allclose(np.cov(drawn.T), COVARIANCE, rtol=0.1)
    assert plan.values(3) == read_ensemble(plan.file, 50).values(3)


def test_the_scenario_has_the_models_values_and_effects(write: Write, tmp_path: Path) -> None:
    model = a_model("gas_spring").with_values({"gas_spring.k": 33.0, "sigma_2": 77.0})
    a_study(tmp_path, model.with_covariance(list(STD), COVARIANCE))
    plan = read_ensemble(with_study(write))
    parameters = plan.campaign().varied(plan.values(0)).components["damper"].values
    assert parameters["gas_spring.on"] is True
    assert (parameters["gas_spring.k"], parameters["sigma_2"]) == (33.0, 77.0)
    assert parameters["sigma_a"] == plan.values(0)["damper.sigma_a"]


def test_a_file_without_it_is_what_it_was(write: Write) -> None:
    assert read_ensemble(write()).identified is None


def test_effects_of_all_sites_have_their_places() -> None:
    places = Places("damper", "structure", False, "structure.attached_mass")
    assert places.of("sigma_a") == "damper.sigma_a"
    assert places.of("duffing.k_3") == "structure.duffing.k_3"
    assert places.of("delay.time") == ""
    inertia = places.of_effect("fluid_inertia", {"fluid_inertia.m_f": 0.3})
    assert inertia == {
        "damper.fluid_inertia.on": True, "structure.attached_mass": 0.3,
        "damper.fluid_inertia.m_f": 0.0,
    }  # fmt: skip
    assert places.of_effect("delay", {"delay.time": 1e-3}) == {}
    bench = Places("damper", "structure", True)
    assert bench.of("duffing.k_3") == "damper.duffing.k_3"
    assert bench.of("fluid_inertia.m_f") == "damper.fluid_inertia.m_f"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('model = "my_rig"', ""), "model is missing"),
        (('model = "my_rig"', "model = 3"), "model is 3: expected a text"),
        (('model = "my_rig"', 'modell = "my_rig"'), 'no key "modell"'),
        (('model = "my_rig"', 'model = "nothing"'), "there is no such file"),
        (('"my_rig"', '"my_rig"\ncomponent = "dampr"'), 'no component "dampr"'),
        (('"my_rig"', '"my_rig"\ncomponent = "structure"'), "has no parameter sigma_a"),
        ((MASSES, SIGMA), r'"damper.sigma_a" is drawn by \[identified\].*leave it out of \[vary\]'),
        (
            (MASSES, SIGMA.replace("damper.", "damper.parameters.")),
            r'"damper.parameters.sigma_a" is drawn by \[identified\]',
        ),
        (
            ('"run.stop" = 0.5', '"run.stop" = 0.5\n"damper.sigma_0" = 999.0'),
            r':\d+: "damper.sigma_0" is drawn by \[identified\].*leave it out of \[set\]',
        ),
    ],
)
def test_a_wrong_section_is_refused(
    write: Write, tmp_path: Path, change: tuple[str, str], words: str
) -> None:
    a_study(tmp_path)
    path = with_study(write)
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(BristleError, match=words):
        read_ensemble(path)


def test_what_has_no_errors_to_draw_from_is_refused(write: Write, tmp_path: Path) -> None:
    rig = a_study(tmp_path, new_model("lugre"))
    path = with_study(write)
    with pytest.raises(EnsembleError, match="no covariance of the parameters"):
        read_ensemble(path)
    (rig / "model.toml").write_text(model_text(new_model("bingham")))
    with pytest.raises(EnsembleError, match=r"law is bingham, and damper \(LuGreDamper\)"):
        read_ensemble(path)
