"""The best constant voltage against the published table, and what is refused."""

from __future__ import annotations

import json
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bristle.campaign.best_constant import Passive, ScaledMotion, optimise_passive
from bristle.cli import main
from bristle.errors import BristleError

MODEL = Path(__file__).parents[1] / "reference" / "model.toml"


@cache
def published() -> Passive:
    """Return the optimum over the first 8 s of El Centro, which hold all peaks of the table."""
    return optimise_passive(overrides={"run.stop": 8.0}, grid=9)


def table() -> dict[str, list[float]]:
    with MODEL.open("rb") as file:
        data: dict[str, list[float]] = tomllib.load(file)["passive"]
    return data


def test_the_grid_is_the_published_table() -> None:
    found = published()
    assert found.grid.tolist() == table()["voltages"]
    for values, row in zip(found.values, table()["y"], strict=True):
        assert values.tolist() == pytest.approx(row, rel=0.002, abs=0.005)


def test_the_papers_voltages_are_within_2_percent_of_the_least() -> None:
    found = published()
    for best, values, voltage in zip(
        found.best, found.values, table()["text_optimum"], strict=True
    ):
        assert values[found.grid.tolist().index(voltage)] < 1.021 * best.value


def test_a_minimum_is_one() -> None:
    found = published()
    assert [m.intensity for m in found.motions] == table()["intensities"]
    for best, values in zip(found.best, found.values, strict=True):
        assert best.value <= values.min()
        k = int(values.argmin())
        assert abs(best.voltage - found.grid[k]) <= 1.0
    assert [round(best.voltage) for best in found.best] == [2, 3, 5, 8]


def test_goals_of_the_set_are_no_worse_than_on_the_grid() -> None:
    found = published()
    own = np.array([best.value for best in found.best])
    on_grid = {
        "worst": found.values.max(axis=0).min(),
        "mean": found.values.mean(axis=0).min(),
        "regret": (found.values / own[:, None]).max(axis=0).min(),
    }
    assert set(found.goals) == set(on_grid)
    for goal, least in on_grid.items():
        assert found.goals[goal].value <= least
        assert found.goals[goal].value > 0.98 * least
    assert found.goals["regret"].value >= 1.0
    assert found.goals["worst"].value >= own.max()


def test_a_notebook_shows_table_and_figure() -> None:
    found = published()
    shown = found._repr_html_()
    assert shown.startswith('<div class="bristle">')
    for motion, best in zip(found.motions, found.best, strict=True):
        assert f">{motion.name}</td>" in shown
        assert f">{best.voltage:.2f}</td>" in shown
    assert "least excess over each motion&#x27;s own best" in shown
    assert "data:image/png;base64," in shown
    (axes,) = found.plot().axes
    assert axes.get_title(loc="left") or axes.get_title()
    curves = [line for line in axes.lines if len(line.get_xdata()) == len(found.grid)]
    assert len(curves) == len(found.motions)
    for curve, values in zip(curves, found.values, strict=True):
        assert list(curve.get_ydata()) == values.tolist()


def test_rms_of_another_output() -> None:
    found = optimise_passive(
        [ScaledMotion("el_centro_1940_ns", 0.4)],
        overrides={"run.stop": 6.0},
        output="structure.drift1",
        statistic="rms",
        grid=5,
    )
    assert found.unit == "m"
    assert 1.0 < found.best[0].voltage < 8.0
    assert found.goals["worst"] == found.best[0]


def test_a_record_as_recorded_and_another_v_max(tmp_path: Path) -> None:
    record = tmp_path / "shake.csv"
    record.write_text("time [s],acceleration [m/s2]\n0.0,0.0\n0.1,1.5\n0.2,0.0\n")
    found = optimise_passive(
        [ScaledMotion(str(record), 0.0)], overrides={"run.stop": 1.0, "damper.v_max": 2.0}, grid=3
    )
    assert found.grid.tolist() == [0.0, 1.0, 2.0]
    assert found.motions[0].name == "shake"
    assert found.notes == ()


def test_a_record_that_goes_on_after_the_runs_is_told() -> None:
    (note,) = published().notes  # one for four intensities
    assert "The runs end at 8 s, the record el_centro_1940_ns at 31.18 s" in note
    assert "--set run.stop=32" in note


def test_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["optimise", "passive", "--intensities", "0.2", "0.4"]
    assert main([*command, "--grid", "3", "--set", "run.stop=1"]) == 0
    said = capsys.readouterr().out
    assert "el_centro_1940_ns 0.4 g" in said
    assert "for all of them" in said
    for name in ("passive.csv", "passive.json", "passive.png"):
        assert (tmp_path / "results" / "optimise" / name).stat().st_size > 100
    more = ["--grid", "5", "--set", "run.stop=5", "--json", "--no-figure"]
    assert main([*command, *more]) == 0
    assert not (tmp_path / "results" / "optimise" / "passive.png").exists(), "of another optimum"
    answer = json.loads(capsys.readouterr().out)
    assert [round(motion["voltage"]) for motion in answer["motions"]] == [2, 3]
    assert set(answer["set"]) == {"worst", "mean", "regret"}
    kept = json.loads((tmp_path / "results" / "optimise" / "passive.json").read_text())
    assert kept == {"schema": 1, **{name: answer[name] for name in kept if name != "schema"}}
    assert kept["motions"] == answer["motions"]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--scenario", "no_damper"], "ConstantVoltage"),
        (["--scenario", "el_centro_0p6g_lpv"], "0 components ConstantVoltage"),
        (["--scenario", "nothing"], "no scenario file"),
        (["--motions", "el_centro_1941_ns"], "el_centro_1940_ns"),
        (["--intensities", "-0.2"], "0 or more"),
        (["--intensities", "nan"], "0 or more"),
        (["--output", "structure.floor3_acceleration_absolute"], "no output"),
        (["--grid", "2"], "too coarse"),
        (["--set", "damper.sigma_x=2"], "sigma_x"),
        (["--set", "damper.v_max=0"], "v_max"),
        (["--set", "ground.record=near_fault_pulse"], "--motions"),
        (["--set", "ground.parameters.peak=2"], "--intensities"),
        (["--set", "voltage.level=3"], "tries every voltage"),
    ],
)
def test_bad_input_is_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], message: str
) -> None:
    assert main(["optimise", "passive", "--out", str(tmp_path), *more]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


def test_too_coarse_a_grid_is_named() -> None:
    with pytest.raises(BristleError, match="too coarse"):
        optimise_passive(grid=1)
