"""`study auto` keeps each law that it fitted and each step; Ctrl-C tells what is there."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bristle.cli import main
from bristle.diagnosis import joint_search, law_trials, rig_runs, site
from bristle.study.forms import NAME
from bristle.study.study import Study


@pytest.fixture(scope="module")
def new(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of two short runs whose law nobody chose."""
    t = np.arange(800) / 200.0
    where = tmp_path_factory.mktemp("new")
    for seed in (1, 2):
        random = np.random.default_rng(seed)
        x = 8e-3 * np.sin(2 * np.pi * (0.9 + 0.3 * seed) * t) + 2e-3 * np.sin(19.0 * t + seed)
        v = np.gradient(x, t)
        force = 6.0 * np.tanh(v / 5e-3) + 70.0 * v + 0.05 * random.standard_normal(len(t))
        x = x + 2e-5 * random.standard_normal(len(t))
        run = pd.DataFrame({"time [s]": t, "x [m]": x, "F [N]": force})
        run.to_csv(where / f"run_{seed}.csv", index=False)
    assert main(["study", "new", str(where / "rig"), "--data", str(where / "run_*.csv")]) == 0
    return where / "rig"


@pytest.fixture
def rig(new: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(new, tmp_path / "rig"))


def interrupt(*_given: object, **_named: object) -> None:
    raise KeyboardInterrupt


def auto(rig: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Return what an interrupted command tells."""
    capsys.readouterr()
    assert main(["study", "auto", str(rig)]) == 130
    return capsys.readouterr().err.splitlines()[-1]


@pytest.fixture(scope="module")
def fitted(new: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """Return a study that was stopped before the search for effects, and the laws fitted."""
    rig = Path(shutil.copytree(new, tmp_path_factory.mktemp("fitted") / "rig"))
    laws: list[str] = []
    whole = law_trials.refine

    def refine(model, *given, **named):
        laws.append(model.law)
        return whole(model, *given, **named)

    with pytest.MonkeyPatch.context() as stopped:
        stopped.setattr(law_trials, "refine", refine)
        stopped.setattr(joint_search, "search", interrupt)
        assert main(["study", "auto", str(rig)]) == 130
    return rig, laws


def test_what_stops_before_the_first_fit_leaves_the_study_as_it_was(rig, capsys, monkeypatch):
    monkeypatch.setattr(rig_runs, "sensor_faults", interrupt)
    told = auto(rig, capsys)
    assert told == "interrupted. The study is as it was. The same command begins anew."
    assert not (rig / "reports" / NAME).exists()


def test_the_laws_that_were_fitted_are_kept_and_not_fitted_again(
    fitted, tmp_path, capsys, monkeypatch
):
    rig = Path(shutil.copytree(fitted[0], tmp_path / "rig"))
    again: list[str] = []
    whole = law_trials.refine

    def refine(model, *given, **named):
        again.append(model.law)
        return whole(model, *given, **named)

    monkeypatch.setattr(law_trials, "refine", refine)
    monkeypatch.setattr(joint_search, "search", interrupt)  # the search for effects
    told = auto(rig, capsys)
    assert again == []
    known = json.loads((rig / "reports" / NAME).read_text())["fits"]
    assert len(known) == len(fitted[1]) > 5
    assert told.startswith("interrupted. Nearest so far: "), told
    assert f" on held-out runs (bristle identify {rig} --law " in told
    assert told.endswith(
        f" takes the law). The fits of {len(known)} laws are kept, no effects were tried: the same "
        "command goes on there."
    )
    assert len(Study(rig).steps()) == 1  # no step was made, and none is claimed

    path = rig / "reports" / NAME
    content = json.loads(path.read_text())
    del content["fits"]["bingham"]
    path.write_text(json.dumps(content))
    auto(rig, capsys)
    assert again == ["bingham"]
    path.write_text("{}")  # damaged: all are fitted anew
    monkeypatch.setattr(law_trials, "refine", interrupt)
    assert "Nearest so far" not in auto(rig, capsys)


def test_the_effects_that_were_tried_of_a_law_are_kept_and_not_searched_again(
    fitted, tmp_path, capsys, monkeypatch
):
    rig = Path(shutil.copytree(fitted[0], tmp_path / "rig"))
    searched: list[tuple[str, ...]] = []
    whole = site.try_all

    def try_all(base, *given, **named):
        if len(searched) == 2:
            raise KeyboardInterrupt
        searched.append((base.law, *base.effects))
        return whole(base, *given, **named)

    with monkeypatch.context() as stopped:
        stopped.setattr(site, "try_all", try_all)
        told = auto(rig, capsys)
    assert " and the effects tried of 2 of them: the same command goes on there." in told
    kept = json.loads((rig / "reports" / NAME).read_text())["fits"]
    tried = [(own[0]["law"], of.split(" + ")[1:-1]) for of, own in kept.items() if " + " in of]
    first = [(law, *before) for law, before in tried]
    assert first == searched

    def go_on(base, *_given, **_named):
        assert (base.law, *base.effects) not in first
        raise KeyboardInterrupt

    monkeypatch.setattr(site, "try_all", go_on)
    assert told == auto(rig, capsys)


def test_a_step_is_there_when_it_is_told(rig, capsys, monkeypatch):
    monkeypatch.setattr("bristle.study.auto.diagnose_study", interrupt)
    capsys.readouterr()
    assert main(["study", "auto", str(rig), "--law", "bingham"]) == 130
    told = capsys.readouterr().err.splitlines()[-1]
    assert told == (
        "interrupted. 1 step was made and is kept in the study's history: the same command goes on "
        "there, a search for effects that was under way begins anew."
    )
    assert [step.what for step in Study(rig).steps()][1:] == ["identify bingham"]
