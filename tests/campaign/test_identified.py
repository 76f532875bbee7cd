"""Ensembles with a damper as a study has it: drawn together, and with what limits leave open."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bristle
from bristle.campaign import read_ensemble
from bristle.campaign.ensemble_file import Places
from bristle.campaign.table import LEVELS, VARIES, notes, quantiles
from bristle.cli import main
from bristle.engine.coupled import Coupled
from bristle.engine.results import RunTable
from bristle.errors import BristleError, EnsembleError, RunError
from bristle.model.model import Model, new_model
from bristle.model.model_file import model_text
from bristle.system.model import System

Write = Callable[..., Path]
MASSES = '"structure.building.masses.2" = { uniform = [1.1, 1.4] }\n'
SIGMA = '"damper.sigma_a" = { normal = [650.0, 65.0], within = [500.0, 800.0] }\n'
STEADY = '"voltage.level" = { each = [0.0, 4.0] }\n'
STD = {"sigma_a": 20.0, "sigma_0": 10.0}
COVARIANCE = np.array([[400.0, -180.0], [-180.0, 100.0]])
NAMES = ("damper.sigma_a", "damper.sigma_0")
PEAK = "peak structure.floor2_acceleration_absolute"
SPRING = {
    "effect": "gas_spring", "parameter": "k", "unit": "N/m", "side": "below", "limit95": 200.0,
    "others": {}, "moved": {"sigma_a": -5.0},
}  # fmt: skip
TINY = {**SPRING, "effect": "quadratic_damping", "parameter": "c_2", "limit95": 1e-9, "moved": {}}
HIDDEN = {"effect": "coil_lag", "why": "the command is constant"}


def a_model(*effects: str) -> Model:
    model = new_model("lugre", effects).with_values({"sigma_a": 640.0, "sigma_0": 400.0}, STD)
    return model.with_covariance(list(STD), COVARIANCE)


def a_study(folder: Path, model: Model | None = None, *limits: dict[str, Any]) -> Path:
    """Write what an ensemble reads of a study."""
    rig = folder / "my_rig"
    rig.mkdir()
    (rig / "model.toml").write_text(model_text(model or a_model()))
    if limits:
        found = [{"site": "damper", "limits": list(limits)}]
        verdict = {"schema": 2, "kind": "none", "effects": [], "findings": found}
        (rig / "verdict.json").write_text(json.dumps(verdict))
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
    plan = read_ensemble(write())
    assert plan.identified is None
    assert not plan.left
    assert plan.columns == [output.name for output in plan.outputs]


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


def test_limits_widen_the_quantiles_and_their_share_is_told(write: Write, tmp_path: Path) -> None:
    a_study(tmp_path, None, SPRING, TINY, HIDDEN)
    path = with_study(write, (MASSES, ""), (STEADY, ""))
    plain = bristle.ensemble(path, runs=12, workers=1)
    found = bristle.ensemble(path, runs=12, workers=1, with_limits=True)
    assert plain.parts == {}
    assert found.runs[PEAK].tolist() == plain.runs[PEAK].tolist()
    assert set(found.runs["effect left open"]) == {"gas_spring", "quadratic_damping"}
    changes = found.runs[f"{PEAK} with it"] - found.runs[PEAK]
    sprung = found.runs["effect left open"] == "gas_spring"
    assert changes[sprung].abs().max() > 1e3 * changes[~sprung].abs().max()
    parts = found.parts[PEAK]
    assert sum(parts.values()) == pytest.approx(1.0)
    assert parts["gas_spring"] > 0.5 > parts[VARIES]
    levels = [f"{100 * level:g} %" for level in LEVELS]
    before, after = (one.quantiles.loc[PEAK, levels].astype(float) for one in (plain, found))
    assert after["50 %"] == before["50 %"]
    assert after["95 %"] - after["5 %"] > 1.3 * (before["95 %"] - before["5 %"])
    cannot = "the runs cannot show coil_lag"
    assert [note[: len(cannot)] for note in found.notes] == [cannot]
    first = found.runs.index[sprung][0]
    found.runs.loc[first, [f"{one.name} with it" for one in found.plan.outputs]] = np.nan
    found.runs.loc[first, "reason"] = "it stops"
    assert notes(found.plan, found.runs)[0] == (
        "with gas_spring not every run could be made (it stops): the quantiles are without it"
    )
    assert "gas_spring" not in found.parts[PEAK]
    assert quantiles(found.plan, found.runs).loc[PEAK, "done"] == 12


COARSE = {**TINY, "effect": "backlash", "parameter": "gap", "limit95": 3e-6, "coarse": True}


def test_a_limit_of_the_sampling_joins_no_run(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    a_study(tmp_path, None, TINY, COARSE)
    path = with_study(write, (MASSES, ""), (STEADY, ""))
    plan = read_ensemble(path, 4, with_limits=True)
    assert plan.identified is not None
    assert [one.name for one in plan.identified.left] == ["quadratic_damping"]
    asked = ["ensemble", str(path), "--with-limits", "--no-figure", "--workers", "1"]
    assert main([*asked, "--runs", "4", "--out", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "the limit of backlash is only the smallest size that the sampling" in said
    assert "No effect that the runs do not exclude widens them by much." in said
    assert "--see" not in said


def failing(monkeypatch: pytest.MonkeyPatch, above: float, error: Exception) -> None:
    """Let runs with a gas spring stiffer than `above` [N/m] fail."""
    made = Coupled.run

    def run(self: Coupled, system: System, on_rows: Any = None) -> RunTable:
        if float(system.components["damper"].values.get("gas_spring.k", 0.0)) > above:
            raise error
        return made(self, system, on_rows)

    monkeypatch.setattr(Coupled, "run", run)


def test_why_an_effect_could_not_be_simulated_is_kept(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_study(tmp_path, None, SPRING)
    path = with_study(write, (MASSES, ""), (STEADY, ""))
    made = Coupled.run
    failing(monkeypatch, 80.0, RunError("it stops.\n  A shorter step would be right."))
    asked: dict[str, Any] = {"out": tmp_path / "out", "workers": 1, "with_limits": True}
    for _ in range(2):  # the second time from the table
        found = bristle.ensemble(path, runs=8, **asked)
        assert (found.runs["status"] == "done").all()
        assert set(found.runs["reason"]) == {"", "it stops"}
        assert found.failures == []
        assert found.parts[PEAK] == {VARIES: 1.0}
        assert "(it stops)" in found.notes[0]
        assert found.notes[0] in repr(found)
    monkeypatch.setattr(Coupled, "run", made)
    found = bristle.ensemble(path, runs=8, retry=True, **asked)
    assert 0 < found.continued < 8
    assert set(found.runs["reason"]) == {""}


def test_what_an_effect_raises_costs_only_the_run_with_it(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_study(tmp_path, None, SPRING)
    failing(monkeypatch, 0.0, ZeroDivisionError("somebody's effect"))
    plan = read_ensemble(with_study(write, (MASSES, ""), (STEADY, "")), 4, with_limits=True)
    found = plan.campaign().outcome(1)
    assert (found.reason, found.lost) == ("", "ZeroDivisionError: somebody's effect")


def test_the_command_tells_the_parts_and_continues(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    a_study(tmp_path, None, SPRING, HIDDEN)
    path = with_study(write, (MASSES, ""), (STEADY, ""))
    out = tmp_path / "out"
    asked = ["ensemble", str(path), "--with-limits", "--no-figure", "--out", str(out)]
    asked += ["--workers", "1", "--runs"]
    assert main([*asked, "4"]) == 0
    said = capsys.readouterr().out
    assert f"  {PEAK}  gas_spring" in said
    assert "--see gas_spring" in said
    assert "the runs cannot show coil_lag" in said
    assert main([*asked, "6", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["continued"] == 4
    assert answer["parts"][PEAK]["gas_spring"] > 0.0


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


def test_limits_that_are_not_there_are_refused(write: Write, tmp_path: Path) -> None:
    with pytest.raises(EnsembleError, match=r"--with-limits needs \[identified\]"):
        read_ensemble(write(), with_limits=True)
    a_study(tmp_path)
    path = with_study(write)
    with pytest.raises(BristleError, match="there is no verdict"):
        read_ensemble(path, with_limits=True)
    (tmp_path / "other").mkdir()
    rig = a_study(tmp_path / "other", None, SPRING, TINY)
    path.write_text(path.read_text().replace('"my_rig"', f'"{rig.relative_to(tmp_path)}"'))
    with pytest.raises(EnsembleError, match="2 effects in turn: 8 runs or more are right, and 7"):
        read_ensemble(path, 7, with_limits=True)
