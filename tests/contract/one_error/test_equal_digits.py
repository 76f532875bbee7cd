"""One model and the same runs have one error, whoever prints it."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import bristle
from bristle.cli import main
from bristle.diagnosis import Diagnosis
from bristle.identification.error import ForceError
from bristle.page import study_views
from bristle.study.study import Study

RATE, SECONDS = 250.0, 6.0


def bench_frame(seed: int) -> pd.DataFrame:
    """Return a run of a yield force with a spring that no law below has, noise on every channel."""
    random = np.random.default_rng(seed)
    t = np.arange(round(RATE * SECONDS)) / RATE
    turn = 2.0 * np.pi * np.array([0.6, 1.7, 3.1])[:, None]
    size, phase = np.array([[9e-3], [3e-3], [1e-3]]), random.uniform(0.0, 6.28, (3, 1))
    x = (size * np.sin(turn * t + phase)).sum(axis=0)
    v = (size * turn * np.cos(turn * t + phase)).sum(axis=0)
    force = 6.0 * np.tanh(v / 3e-3) + 80.0 * v + 250.0 * x

    def noisy(values: np.ndarray) -> np.ndarray:
        return values + 0.01 * np.std(values) * random.standard_normal(len(t))

    columns = {"time [s]": t, "x [m]": noisy(x), "v [m/s]": noisy(v), "F [N]": noisy(force)}
    return pd.DataFrame(columns)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an identified study of three runs, a few samples of the held-out one missing."""
    folder = tmp_path_factory.mktemp("one_error")
    for seed in (1, 2, 3):
        frame = bench_frame(seed)
        if seed == 3:
            frame.loc[400:402, "F [N]"] = np.nan
        frame.to_csv(folder / f"run_{seed}.csv", index=False)
    study = folder / "rig"
    new = ["study", "new", str(study), "--data", str(folder / "run_*.csv"), "--law", "bingham"]
    assert main(new) == 0
    roles = ["study", "roles", str(study), "--holdout", "run_3", "--train", "run_1", "run_2"]
    assert main(roles) == 0
    return study


def run(command: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert main(command) == 0
    return capsys.readouterr().out


def test_every_command_and_file_tells_the_same_error(rig: Path, capsys, monkeypatch):
    verdict_of_none = Diagnosis(
        "none", (), ("Nothing was sought.",)
    )  # the search would take a minute
    monkeypatch.setattr(
        "bristle.study.steps.diagnose_rig", lambda *_given, **_named: verdict_of_none
    )
    folder = str(rig)
    order = ["identify", folder, "--starts", "1", "--details"]
    printed = run(order, capsys)
    identified = json.loads((rig / "reports" / "identify.json").read_text())
    told = identified["error"]["holdout"]
    error = ForceError.of(told)
    assert told["left_out"]["missing"] == 3

    # By hand, from the definition.
    found = bristle.identify(Study(rig), write=False)
    (held_out,) = found.holdout.runs
    off = held_out.force - found.holdout.predict(found.at.model, held_out)
    kept = np.arange(len(off)) >= held_out.skip
    kept &= held_out.measured
    rms = np.sqrt(np.mean(off[kept] ** 2))
    again = found.error  # the same data and model give the same values to the optimiser's digits
    assert again.rms == pytest.approx(rms, rel=1e-12)
    assert again.share == pytest.approx(
        rms / np.sqrt(np.mean(held_out.force[kept] ** 2)), rel=1e-12
    )

    text = error.text()
    assert re.search(rf"held-out runs +{re.escape(text)}$", printed, re.MULTILINE)
    assert f"Force error: {text} on the held-out runs" in printed
    assert error.counted() in printed
    assert "3 missing" in error.counted()
    assert "below 18 Hz, held-out runs" in printed

    compared = " ".join(run(["compare", folder], capsys).split())
    assert f"misses the force by {text}, " in compared
    assert error.counted() in compared
    assert json.loads(run(["compare", folder, "--json"], capsys))["total"]["error"] == told
    diagnosed = " ".join(run(["diagnose", folder, "--law", "bingham"], capsys).split())
    assert f"Force error of the study's model on the held-out runs: {text}" in diagnosed
    verdict = json.loads((rig / "verdict.json").read_text())
    assert verdict["error"]["holdout"] == told

    step = Study(rig).steps()[-1]
    assert step.after["error_holdout"] == told["rms"]
    assert step.after["error_share_holdout"] == told["share"]
    assert "error_holdout" not in step.before
    shown = study_views.history_view(rig, {})["steps"][-1]
    assert (shown["rms"], shown["share"]) == (told["rms"], told["share"])

    assert bristle.compare(Study(rig)).error.as_dict() == told
    run(["report", folder], capsys)
    page = html.unescape((rig / "reports" / "report.html").read_text())
    assert f"<b>{text}</b>" in page
    assert f"misses the force by {text}, " in page


def test_adding_an_effect_tells_the_errors_of_both_models_in_the_same_digits(rig: Path, capsys):
    before = ForceError.of(
        json.loads(run(["compare", str(rig), "--json"], capsys))["total"]["error"]
    )
    printed = run(["add", str(rig), "gas_spring"], capsys)
    after = ForceError.of(
        json.loads(run(["compare", str(rig), "--json"], capsys))["total"]["error"]
    )
    assert f"Force error: {before.text()} -> {after.text()} on the held-out runs" in printed
    assert after.rms < 0.5 * before.rms


def test_a_first_fit_shows_no_start_as_progress(rig: Path, capsys):
    first = json.loads((rig / "history" / "001" / "step.json").read_text())
    assert first["before"] == {}
    assert first["after"]["error_holdout"] > 0.0
    lines = run(["report", str(rig)], capsys)
    assert "begin with bingham" not in lines
