"""An effect that damper and layer may both have: named, refused, fitted, offered by its site."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made import write

from bristle.cli import main
from bristle.diagnosis.conclusion import lookalikes
from bristle.diagnosis.effect_limits import untestable
from bristle.diagnosis.trials import joinable
from bristle.errors import StudyError
from bristle.identification.building_sites import StructureProblem, structure_run
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.identification.rig import Rig, Site, at_site
from bristle.identification.rig_fit import fit_site
from bristle.model.model import Model, new_model
from bristle.model.model_file import read_model, write_model
from bristle.physics.building import paper_building
from bristle.study.steps import add_effects
from bristle.study.study import Study
from bristle.synthesis.design_file import damper_from_model as read_damper

BOTH = ("end_stop", "end_stop@damper")
VALUES = {
    "end_stop.clearance": 0.004, "end_stop.k": 3e3, "end_stop.c": 0.0,
    "end_stop@damper.clearance": 0.006, "end_stop@damper.k": 8e3, "end_stop@damper.c": 0.0,
}  # fmt: skip
DT = 0.002


def motion(phase: float, size: float = 0.009, samples: int = 1500):
    """Return x, v, a, V (n,) of a swelling motion."""
    t = DT * np.arange(samples)
    x = size * np.sin(9.0 * t + phase) * (0.5 + 0.5 * np.sin(0.9 * t + phase))
    v = np.gradient(x, DT)
    return x, v, np.gradient(v, DT), 3.0 + 2.0 * np.sin(3.0 * t)


def bench_run(effects, values, phase: float = 0.0, noise: float = 0.03) -> Run:
    x, v, a, V = motion(phase)
    force = DamperForces("lugre", list(effects)).force(x, v, a, V, DT, values)
    force = force + noise * np.random.default_rng(1).standard_normal(len(x))
    return Run("run", DT, x, v, a, V, force, noise, np.zeros((1, len(x), 4)))


def layer_and_damper(reconstructed: bool = False) -> StructureProblem:
    x, v, a, V = motion(0.0)
    none = np.zeros((1, len(x), 4))
    run = structure_run("run", DT, (x, v, a, V), np.zeros(len(x)), 0.03, none)
    return StructureProblem([run], 0, reconstructed)


# -- files


def test_a_model_holds_the_stop_of_the_layer_and_that_of_the_damper(tmp_path: Path) -> None:
    model = new_model("bingham", BOTH).with_values(VALUES)
    path = tmp_path / "model.toml"
    write_model(path, model)
    assert '[effects."end_stop@damper"]' in path.read_text()
    again = read_model(path)
    assert again == model
    assert again.values["end_stop@damper.clearance"] == 0.006
    inside, layer = again.at("damper", bench=False), again.at("structure", bench=False)
    assert list(inside.effects) == list(layer.effects) == ["end_stop"]
    assert inside.values["end_stop.clearance"] == 0.006
    assert layer.values["end_stop.clearance"] == 0.004


def test_a_file_of_before_means_what_it_meant(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text('schema = 1\nlaw = "lugre"\n\n[effects.end_stop]\nparameters = {}\n')
    model = read_model(path)
    assert list(model.at("structure", bench=False).effects) == ["end_stop"]
    assert model.at("damper", bench=False).effects == ()
    assert list(model.at("damper", bench=True).effects) == ["end_stop"]


def test_a_site_that_an_effect_has_not_is_refused_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text('schema = 1\nlaw = "lugre"\n\n[effects."end_stop@roof"]\n')
    with pytest.raises(StudyError, match=r":4: .*end_stop@roof"):
        read_model(path)


def test_a_design_takes_the_dampers_own_stop(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    model = new_model("bingham", BOTH, "building.toml").with_values(VALUES)
    (tmp_path / "building.toml").touch()  # a model is refused without its building
    write_model(path, model)
    inside = read_damper(path)
    assert inside.effects == ("end_stop",)
    assert inside.values["end_stop.clearance"] == 0.006
    alone = {name: value for name, value in VALUES.items() if "@" not in name}
    write_model(path, new_model("bingham", ("end_stop",)).with_values(alone))
    assert read_damper(path).values["end_stop.clearance"] == 0.004


# -- a model at its sites


def test_each_stop_acts_at_its_site_under_its_plain_name() -> None:
    model = Model("lugre", BOTH, VALUES)
    sites = ("damper", "layer", "storey1")
    assert at_site(model, "layer", sites).effects == ("end_stop",)
    assert at_site(model, "damper", sites).effects == ("end_stop@damper",)
    problem = layer_and_damper()
    (run,) = problem.runs
    x, v, a, V = motion(0.0)
    own = {name.replace("@damper", ""): value for name, value in list(VALUES.items())[3:]}
    expected = DamperForces("lugre", ["end_stop"]).force(x, v, a, V, DT, own)
    damper = at_site(model, "damper", sites)
    np.testing.assert_allclose(problem.predict(damper, run), expected, atol=1e-9)
    # Of a reconstructed force both are a part.
    whole = problem.predict(at_site(model, "damper", ("damper",)), run)
    push = 3e3 * np.sign(x) * np.maximum(np.abs(x) - 0.004, 0.0)
    np.testing.assert_allclose(whole - expected, push, atol=1e-9)


def test_what_has_no_site_on_a_bench_is_refused() -> None:
    bench, building = Rig(lambda _model: {"damper": None}), paper_building()  # type: ignore[dict-item]
    assert list(bench.sites(Model("lugre", ("end_stop",)))) == ["damper"]
    with pytest.raises(StudyError, match="storey_softening: of a structure, and on a bench"):
        bench.sites(Model("lugre", ("storey_softening",)))
    with pytest.raises(StudyError, match=r"end_stop@damper: on a bench .* is right: end_stop"):
        bench.sites(Model("lugre", ("end_stop@damper",)))
    inside = Rig(lambda _model: {"damper": None}, building)  # type: ignore[dict-item]
    assert inside.sites(Model("lugre", BOTH))


@pytest.fixture
def study(tmp_path: Path) -> Study:
    """Return a bench's study, its damper with a stop."""
    for k, role in enumerate(("train", "holdout")):
        run = bench_run(["end_stop"], {"end_stop.clearance": 0.006, "end_stop.k": 4e3}, 0.5 * k)
        columns = {"displacement [m]": run.x, "velocity [m/s]": run.v, "voltage [V]": run.V}
        time = DT * np.arange(len(run.x))
        write(tmp_path / f"{role}_1.csv", {"time [s]": time, **columns, "force [N]": run.force})
    return Study.create(tmp_path / "rig", sorted(tmp_path.glob("*.csv")))


def test_adding_a_structures_effect_on_a_bench_is_refused(
    study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (study.folder / "model.toml").read_bytes()
    with pytest.raises(StudyError, match="storey_softening acts in a structure, and on a test"):
        add_effects(study, ["storey_softening"])
    assert main(["add", str(study.folder), "storey_softening"]) == 2
    assert "on a test bench there is none" in capsys.readouterr().err
    with pytest.raises(StudyError, match="end_stop@structure: a test bench has no structure"):
        add_effects(study, ["end_stop@structure"])
    assert (study.folder / "model.toml").read_bytes() == before


def test_a_stop_is_added_on_a_bench_by_its_plain_name(study: Study) -> None:
    added = add_effects(study, ["end_stop@damper"])
    assert added.effects == ("end_stop",)
    assert "[effects.end_stop]" in (study.folder / "model.toml").read_text()
    values = study.model().values
    assert values["end_stop.clearance"] == pytest.approx(0.006, rel=0.02)
    assert values["end_stop.k"] == pytest.approx(4e3, rel=0.1)
    with pytest.raises(StudyError, match="end_stop is in the model already"):
        add_effects(study, ["end_stop"])


# -- fits and candidates


def test_a_stop_is_fitted_from_where_the_runs_come() -> None:
    true = {"end_stop.clearance": 0.007, "end_stop.k": 5e3, "end_stop.c": 20.0}
    problem = Problem([bench_run(["end_stop"], true, phase) for phase in (0.0, 1.0)])
    site = Site("damper", lambda _role: problem)
    found = fit_site(Model("lugre", ("end_stop",)), site, {"damper": site}, 2, {})
    assert found.model.value("end_stop.clearance") == pytest.approx(0.007, rel=0.01)
    assert found.model.value("end_stop.k") == pytest.approx(5e3, rel=0.1)


def test_what_each_rig_is_offered() -> None:
    names = joinable(Model("lugre"))
    assert {"end_stop", "duffing", "gas_spring"} <= set(names)
    # What the law's own yield force absorbs entirely is not offered: it is told as untestable.
    assert "base_friction" not in names
    inside = joinable(Model("lugre"), problem=layer_and_damper())
    assert {"end_stop@damper", "duffing@damper", "gas_spring"} <= set(inside)
    assert not {"end_stop", "base_friction@damper"} & set(inside)
    # A reconstructed force has the layer's share in it: one stop is enough.
    reconstructed = joinable(Model("lugre"), problem=layer_and_damper(reconstructed=True))
    assert not [name for name in reconstructed if "@" in name]
    assert "end_stop@damper" not in joinable(
        Model("lugre", ("end_stop@damper",)), problem=layer_and_damper()
    )


def test_friction_of_the_seals_is_told_as_untestable() -> None:
    problem = Problem([bench_run([], {})])
    model = Model("lugre")
    found = untestable(model, problem, problem.expectation(model), 0.01)
    assert "base_friction" in found


def test_without_a_load_cell_the_layers_and_the_dampers_are_alike() -> None:
    twins = lookalikes(("end_stop",))
    assert list(twins) == ["end_stop@damper"]
    assert "end stop of the isolation layer and one of the damper" in twins["end_stop@damper"]
    assert list(lookalikes(("duffing",))) == ["gas_spring"]
    assert list(lookalikes(("base_friction",))) == ["f_c of the damper"]
