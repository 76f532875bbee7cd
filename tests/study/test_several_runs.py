"""Files of several runs, fast files and spikes, from `study new` to the measurement."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from made import RATE, bench_run, write

from bristle.cli import main
from bristle.data.decimate import Finer, decimated
from bristle.data.noise import find_spikes
from bristle.data.sampling import Even, Sampling
from bristle.errors import RecordError, StudyError
from bristle.study.data_check import check_data
from bristle.study.run_facts import RunChoices
from bristle.study.steps import create_study
from bristle.study.study import Study
from bristle.study.study_file import with_mask


def joined(path: Path, count: int = 4) -> Path:
    """Write one file of several runs whose times restart, numbered by a column."""
    runs = [
        bench_run(k) | {"test": np.full(round(6.0 * RATE), float(k))} for k in range(1, count + 1)
    ]
    whole = {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}
    return write(path, whole)


@pytest.mark.parametrize("split", ["restart", "column test"])
def test_a_study_of_one_file_with_several_runs(tmp_path, split) -> None:
    choices = RunChoices(split=split)
    if split == "restart":
        code = main(["study", "new", str(tmp_path / "rig"), "--split", split, "--data",
                     str(joined(tmp_path / "all.csv"))])  # fmt: skip
        assert code == 0
    else:
        with pytest.raises(RecordError, match="time goes back"):
            create_study(tmp_path / "none", [joined(tmp_path / "all.csv")])
        create_study(tmp_path / "rig", [joined(tmp_path / "all.csv")], runs=choices)
    study = Study(tmp_path / "rig")
    assert [(run.piece, run.role) for run in study.settings.runs] == [
        (1, "train"), (2, "holdout"), (3, "train"), (4, "train"),
    ]  # fmt: skip
    runs = study.runs()
    assert [run.name for run in runs.train] == ["all run 1", "all run 3", "all run 4"]
    assert [run.name for run in runs.holdout] == ["all run 2"]
    np.testing.assert_allclose(
        runs.holdout[0]["force"], bench_run(2)["F [N]"], rtol=1e-6, atol=1e-8
    )
    path = tmp_path / "rig" / "study.toml"
    path.write_text(path.read_text().replace("piece = 4", "piece = 9"))
    with pytest.raises(StudyError, match="holds 4 runs, and piece = 9 is none"):
        Study(tmp_path / "rig").read()


def test_time_that_goes_back_names_the_remedy(tmp_path, capsys) -> None:
    assert (
        main(["study", "new", str(tmp_path / "rig"), "--data", str(joined(tmp_path / "a.csv"))])
        == 2
    )
    assert "--split restart" in capsys.readouterr().err


def fast(seed: int, every: int = 4) -> dict[str, np.ndarray]:
    """Return a run of 2 kHz that holds the slower one, with noise."""
    slow = bench_run(seed, noise=0.0)
    t = np.arange(every * (len(slow["time [s]"]) - 1) + 1) / (RATE * every)
    out = {name: np.interp(t, slow["time [s]"], y) for name, y in slow.items()}
    out["U [V]"] = slow["U [V]"][(np.arange(len(t)) // every)]
    out["time [s]"] = t
    noise = np.random.default_rng(seed).normal(0.0, 0.1, len(t))
    return out | {"F [N]": out["F [N]"] + noise}


def test_fast_runs_are_decimated_and_that_is_said(tmp_path, capsys) -> None:
    files = [write(tmp_path / f"run_{k}.csv", fast(k)) for k in (1, 2)]
    args = ["study", "new", str(tmp_path / "rig"), "--data", *map(str, files)]
    assert main(args) == 0
    assert "2000 samples per second: runs are decimated to about 500 Hz" in " ".join(
        capsys.readouterr().out.split()
    )
    assert "rate = 500.0" in (tmp_path / "rig" / "study.toml").read_text()
    run = Study(tmp_path / "rig").read()[0]
    assert run.step == pytest.approx(0.002)
    assert any("anti-alias filter" in note for note in run.notes)
    slow = bench_run(1, noise=0.0)
    np.testing.assert_allclose(run.time, slow["time [s]"], atol=1e-9)
    np.testing.assert_array_equal(np.unique(run["voltage"]), np.unique(slow["U [V]"]))
    np.testing.assert_allclose(run["displacement"], 1e-3 * slow["x [mm]"], atol=2e-5)
    # What the short filter leaves of white noise of 0.1 N.
    assert run.noise["force"] == pytest.approx(0.1 * 6.0**0.5 / 4.0 / 2.0**0.5, rel=0.2)
    assert run.measured.all()
    assert run.parts == 4
    main(["study", "new", str(tmp_path / "all"), "--rate", "0", "--data", *map(str, files)])
    assert Study(tmp_path / "all").read()[0].step == pytest.approx(0.0005)


def even_run(rate: float = 2000.0, seconds: float = 40.0, **channels) -> Even:
    n = round(rate * seconds)
    measured = np.ones(n, dtype=bool)
    measured[400] = False
    return Even([(np.arange(n) / rate, channels, measured)], Sampling(1.0 / rate, n), [])


def test_a_motion_keeps_white_noise_and_loses_what_would_fold() -> None:
    rng, n = np.random.default_rng(3), 80_000
    t = np.arange(n) / 2000.0
    kept = np.sin(2.0 * np.pi * 40.0 * t)
    given = even_run(
        displacement=rng.normal(size=n),
        velocity=np.sin(2.0 * np.pi * 700.0 * t),
        base_velocity=kept,
    )
    found = decimated(given, 500.0)
    time, y, known = found.even.pieces[0]
    assert len(found.notes) == 1
    assert found.even.sampling.step == pytest.approx(0.002)
    power = np.abs(np.fft.rfft(y["displacement"])) ** 2
    edge = power[int(0.9 * len(power)) :].mean() / power[: len(power) // 2].mean()
    assert 0.8 < edge < 1.25
    assert np.std(y["displacement"]) == pytest.approx(0.5, rel=0.05)
    assert found.gain["displacement"] == pytest.approx(0.5, rel=0.05)
    assert np.max(np.abs(y["velocity"][50:-50])) < 5e-3
    np.testing.assert_allclose(y["base_velocity"], np.sin(2.0 * np.pi * 40.0 * time), atol=5e-3)
    assert np.flatnonzero(~known).tolist() == [100]
    same = decimated(given, 1500.0)
    assert same.even is given
    assert not same.notes


def test_a_force_does_not_ring_where_it_jumps_and_a_model_passes_its_filter() -> None:
    rng, t = np.random.default_rng(4), np.arange(80_000) / 2000.0
    clean = 5.0 * np.sign(np.sin(2.0 * np.pi * 1.3 * t)) + np.sin(2.0 * np.pi * 2.0 * t)
    given = even_run(force=clean + rng.normal(0.0, 0.05, t.size), voltage=np.floor(t % 3.0))
    found = decimated(given, 500.0)
    _, y, _ = found.even.pieces[0]
    assert np.max(np.abs(y["force"])) < 6.2
    finer = Finer(found.parts, found.since[0]["voltage"])
    error = y["force"] - finer.filtered(clean[: 4 * len(y["force"]) - 3])
    assert np.std(error) == pytest.approx(found.gain["force"] * 0.05, rel=0.05)
    assert np.max(np.abs(error)) < 6.0 * found.gain["force"] * 0.05
    assert found.noise[0]["force"].std == pytest.approx(0.05, rel=0.1)
    np.testing.assert_array_equal(y["voltage"], np.floor(t % 3.0)[::4])


@pytest.mark.parametrize(("rate", "parts"), [(1000.0, 2), (3500.0, 7), (5500.0, 5), (12000.0, 8)])
def test_a_command_jumps_between_the_samples_where_it_did(rate: float, parts: int) -> None:
    t = np.arange(round(20.0 * rate)) / rate
    levels = np.random.default_rng(5).choice([0.0, 1.0, 4.0], 60)[(t / 0.3511).astype(int)]
    slow = np.sin(2.0 * np.pi * 0.5 * t)
    given = Even(
        [(t, {"voltage": levels, "current": slow}, np.ones(len(t), dtype=bool))],
        Sampling(1.0 / rate, len(t)), [],
    )  # fmt: skip
    found = decimated(given, 500.0)
    _, y, _ = found.even.pieces[0]
    stride = round(found.even.sampling.step * rate / found.parts)
    for name, whole in (("voltage", levels), ("current", slow)):
        made = Finer(found.parts, found.since[0][name]).command(y[name])
        off = np.abs(made - whole[::stride][: len(made)])
        assert np.max(off[: -found.parts]) < (1e-4 if name == "current" else 2.0 + 1e-9)
        if stride == 1 and name == "voltage":
            np.testing.assert_array_equal(made, whole[: len(made)])
    assert found.parts == parts


def test_too_few_samples_are_not_decimated() -> None:
    t = np.arange(100) / 2000.0
    even = Even([(t, {"x": np.sin(t)}, np.ones(100, dtype=bool))], Sampling(1 / 2000.0, 100), [])
    with pytest.raises(RecordError, match="A higher rate"):
        decimated(even, 500.0)


def spiky(seed: int) -> dict[str, np.ndarray]:
    columns = bench_run(seed)
    columns["F [N]"][700] += 60.0
    columns["F [N]"][2001:2003] -= 45.0
    return columns


def test_spikes_are_told_with_time_and_size_and_masked_on_request(tmp_path, capsys) -> None:
    files = [write(tmp_path / "a.csv", spiky(1)), write(tmp_path / "b.csv", bench_run(2))]
    create_study(tmp_path / "rig", files)
    main(["study", "check", str(tmp_path / "rig")])
    said = " ".join(capsys.readouterr().out.split())
    assert "a: force has 2 isolated spikes: 60 N at 1.4 s, -45 N at 4" in said
    assert "b: force has" not in said
    before = Study(tmp_path / "rig").read()[0]
    assert before.measured.all()
    assert [round(one.size) for one in before.spikes] == pytest.approx([60, -45], abs=2)
    assert main(["study", "check", str(tmp_path / "rig"), "--mask"]) == 0
    assert "masked" in " ".join(capsys.readouterr().out.split())
    text = (tmp_path / "rig" / "study.toml").read_text()
    assert "mask = true" in text
    assert text.index("mask = true") < text.index("[[runs]]")
    for long in ('# ours\nschema = 1\nnotes = """\n[a list]\n"""\n', "", "[channels.time]\n"):
        assert tomllib.loads(with_mask(long)) == {**tomllib.loads(long), "mask": True}
    after = Study(tmp_path / "rig").read()[0]
    assert np.flatnonzero(~after.measured).tolist() == [700, 2001, 2002]
    assert np.max(np.abs(after["force"] - bench_run(1)["F [N]"])) < 8.0
    assert not [one for one in check_data(Study(tmp_path / "rig")).findings if one.kind == "spikes"]


def test_what_is_no_spike() -> None:
    rng = np.random.default_rng(2)
    t = np.arange(4000) / 500.0
    v = np.cos(9.0 * t) + 0.5 * np.cos(31.0 * t)
    noise = rng.normal(0.0, 0.02, t.size)
    for force in (
        np.sign(v),
        np.tanh(v / 0.02) + v,
        np.repeat([0.0, 3.0, 1.0, 2.0], 1000),
        v * 0.0,
    ):
        assert not find_spikes(force + noise)
    assert not find_spikes(np.repeat([0.0, 3.0], 2000))
    assert not find_spikes(np.full(4000, np.nan))
    y = np.sign(v) + noise
    y[1234] += 5.0
    y[50] = np.nan
    assert find_spikes(y) == [(1234, 1235)]
