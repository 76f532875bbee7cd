"""`bristle identify FOLDER --structure` on buildings whose response is known in closed form."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made import write

from bristle import cli
from bristle.data.building_file import read_building
from bristle.fmu.catalogue import describe
from bristle.identification.building_fit import StructureFit, building_text
from bristle.physics.building import from_data
from bristle.study.study import Study

DT = 0.004


def chain(masses, stiffnesses):
    """Return M and K (n, n) of masses on springs, written out by hand."""
    n = len(masses)
    K = np.zeros((n, n))
    for i, k in enumerate(stiffnesses):
        ends = np.zeros(n)
        ends[i] = 1.0
        if i:
            ends[i - 1] = -1.0
        K += k * np.outer(ends, ends)
    return np.diag(masses), K


def steady(masses, stiffnesses, ratio, seed, samples):
    """Return the steady response to a sum of sines: amplitudes from (K + i w C - w^2 M)^-1.

    Columns: time, ground, and displacement, absolute acceleration of every level.
    """
    random = np.random.default_rng(seed)
    M, K = chain(masses, stiffnesses)
    root = np.diag(1.0 / np.sqrt(masses))
    squares, shapes = np.linalg.eigh(root @ K @ root)
    back = np.linalg.inv(root)
    C = back @ (shapes * (2.0 * ratio * np.sqrt(squares))) @ shapes.T @ back
    t = np.arange(samples) * DT
    ground = np.zeros(samples)
    x, a = np.zeros((2, len(masses), samples))
    top = min(2.0 * np.sqrt(squares[-1]), 2.0 * np.pi * 30.0)
    for w in np.linspace(0.4 * np.sqrt(squares[0]), top, 60):
        wave = np.exp(1j * (w * t + random.uniform(0.0, 2.0 * np.pi)))
        amplitude = np.linalg.solve(K + 1j * w * C - w**2 * M, -np.asarray(masses))
        ground += wave.real
        x += np.real(amplitude[:, None] * wave)
        a += np.real((1.0 - w**2 * amplitude)[:, None] * wave)
    return t, ground, x, a


def files(folder, masses, stiffnesses, base, samples, ratio=0.03):
    """Write two runs with 1 % noise and a building file that is 30 % off; return their paths."""
    levels = (["base"] if base == "isolated" else []) + [f"floor{i}" for i in range(1, 22)]
    out = []
    for seed, role in enumerate(("train", "holdout")):
        t, ground, x, a = steady(masses, stiffnesses, ratio, seed, samples)
        named = {"time [s]": t, "ground_acceleration [m/s2]": ground}
        for level, own, shaken in zip(levels, x, a, strict=False):
            named[f"{level}_displacement [m]"] = own
            named[f"{level}_acceleration_absolute [m/s2]"] = shaken
        random = np.random.default_rng(seed + 99)
        noisy = {
            name: y + (name != "time [s]") * 0.01 * np.std(y) * random.standard_normal(len(y))
            for name, y in named.items()
        }
        out.append(write(folder / f"{role}.csv", noisy))
    file = folder / "guess.toml"
    file.write_text(
        f'schema = 1\nname = "tower"\nbase = "{base}"\ndamping_ratio = 0.01\n'
        f"masses = {list(masses)}\nstiffnesses = {[1.3 * k for k in stiffnesses]}\n"
    )
    return file, out


def new_study(folder, file, runs):
    data = [str(run) for run in runs]
    arguments = ["--rig", "structure", "--building", str(file), "--data", *data]
    assert cli.main(["study", "new", str(folder), *arguments]) == 0


@pytest.mark.parametrize(
    ("floors", "base", "samples", "within"),
    [
        (1, "fixed", 4000, 0.01),
        (2, "isolated", 5000, 0.01),
        pytest.param(20, "fixed", 6000, 0.03, marks=pytest.mark.slow),  # 2 s: every floor's spring
    ],
)
def test_a_building_comes_back_as_a_file(tmp_path, capsys, floors, base, samples, within):
    random = np.random.default_rng(floors)
    n = floors + (base == "isolated")
    masses = (2.0 + random.uniform(-0.4, 0.4, n)).tolist()
    stiffnesses = (2000.0 * (50.0 if n > 5 else 1.0) * random.uniform(0.8, 1.2, n)).tolist()
    file, runs = files(tmp_path, masses, stiffnesses, base, samples)
    new_study(tmp_path / "rig", file, runs)
    capsys.readouterr()

    assert cli.main(["identify", str(tmp_path / "rig"), "--structure", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    told = [row for row in answer["stiffnesses"] if row["interval95"] is not None]
    truth = dict(zip([row["below"] for row in answer["stiffnesses"]], stiffnesses, strict=True))
    error = np.array([(row["value"] - truth[row["below"]]) / row["interval95"] for row in told])
    assert len(told) >= min(n, 10)
    assert np.mean(np.abs(error) < 1.0) >= 0.75
    assert np.max(np.abs(error)) < 2.5
    M, K = chain(masses, stiffnesses)
    real = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    real = np.sort(real) / (2.0 * np.pi)
    assert answer["modes"][0]["frequency"] == pytest.approx(real[0], rel=within / 3.0)
    first = answer["modes"][0]
    assert abs(first["damping_ratio"] - 0.03) < 2.5 * first["damping_ratio_interval95"]
    assert answer["after"]["z_equilibrium_holdout"] < 1.15 < answer["before"]["z_equilibrium_train"]

    written = read_building(answer["file"])
    assert written.stiffnesses == pytest.approx([row["value"] for row in answer["stiffnesses"]])
    assert describe("Structure", Path(answer["file"])).variables
    study = Study(tmp_path / "rig")
    assert study.model().building == "building_1.toml"

    assert cli.main(["undo", str(tmp_path / "rig")]) == 0
    assert Study(tmp_path / "rig").model().building == "guess.toml"


def test_printed_for_people_and_dry_run_leaves_the_study(tmp_path, capsys):
    file, runs = files(tmp_path, [2.0, 1.5], [1800.0, 2500.0], "isolated", 4000)
    new_study(tmp_path / "rig", file, runs)
    before = sorted((tmp_path / "rig").rglob("*"))
    capsys.readouterr()
    assert cli.main(["identify", str(tmp_path / "rig"), "--structure", "--dry-run"]) == 0
    shown = capsys.readouterr().out
    assert "stiffness below" in shown
    assert "damping ratio" in shown
    assert "held-out runs" in shown
    assert "bristle build" not in shown  # nothing was written
    assert sorted((tmp_path / "rig").rglob("*")) == before
    assert cli.main(["identify", str(tmp_path / "rig"), "--structure"]) == 0
    assert "bristle build Structure --building" in capsys.readouterr().out


def test_what_is_no_building_is_refused(tmp_path, capsys):
    file, runs = files(tmp_path, [2.0, 1.5], [1800.0, 2500.0], "isolated", 1000)
    new_study(tmp_path / "rig", file, runs)
    assert cli.main(["identify", str(tmp_path / "rig"), "--structure", "--law", "lugre"]) == 2
    assert "without one" in capsys.readouterr().err
    t = np.arange(600) * DT
    columns = {"time [s]": t, "displacement [m]": np.sin(t), "force [N]": np.cos(t)}
    bench = write(tmp_path / "bench.csv", columns)
    assert cli.main(["study", "new", str(tmp_path / "b"), "--data", str(bench)]) == 0
    assert cli.main(["identify", str(tmp_path / "b"), "--structure"]) == 2
    assert "no building" in capsys.readouterr().err


def by_hand(data, ratios):
    """Return a fit that found what the data of a building file say."""
    building = from_data(data)
    one = np.ones(building.size)
    return StructureFit(
        building, np.array(building.stiffnesses), one, np.array(ratios), one, one, one, one, one, ()
    )


def test_matrices_are_written_as_matrices():
    M, K = chain([2.0, 1.5], [1800.0, 2500.0])
    M[0, 1] = M[1, 0] = 0.1  # no chain any more
    data = {"schema": 1, "M": M.tolist(), "C": (0.001 * K).tolist(), "K": K.tolist()}
    text = building_text(by_hand(data, [0.02, 0.05]), ["by hand"])
    assert text.startswith("# by hand\n")
    read = from_data(tomllib.loads(text))
    assert np.array(read.M) == pytest.approx(M)
    assert np.array(read.K) == pytest.approx(K)


def test_a_file_that_would_say_something_else_is_not_written():
    data = {
        "schema": 1, "masses": [2.0, 1.5], "stiffnesses": [1800.0, 2500.0], "damping_ratio": 0.02,
    }  # fmt: skip
    found = by_hand(data, [0.02, 0.02])
    assert "modal = [" in building_text(found)
    with pytest.raises(AssertionError, match="otherwise"):
        building_text(replace(found, damping_ratios=np.array([0.02, 0.5])))
