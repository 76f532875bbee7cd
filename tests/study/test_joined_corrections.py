"""A run that a gap cuts into parts is corrected once, by what its parts say together."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write, write_runs

from bristle.cli import main
from bristle.data.corrections import Correction
from bristle.errors import StudyError
from bristle.study.runs import joined_corrections
from bristle.study.study import Study

SIZES = {"odd (1 of 2)": 1500, "odd (2 of 2)": 500}


def with_gap(columns, gains: tuple[float, float] = (1.0, 1.0), zero: float = 0.0):
    """Return a run [N] of another gain in either part of it and another zero, with a gap."""
    force, n = columns["F [N]"], len(columns["F [N]"])
    gain = np.where(np.arange(n) < n // 2, *gains)
    gap = slice(n // 2, n // 2 + 100)
    return {k: np.delete(x, gap) for k, x in {**columns, "F [N]": gain * force + zero}.items()}


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    write_runs(tmp_path / "lab", 6)
    return tmp_path / "lab"


def made(lab: Path) -> Study:
    return Study.create(lab.parent / "rig", sorted(lab.glob("*.csv")), law="bingham")


def test_a_run_in_two_parts_is_corrected_once(lab, capsys):
    write(lab / "odd.csv", with_gap(bench_run(7), (1.5, 1.5)))
    write(lab / "off.csv", with_gap(bench_run(8), zero=1.5))
    study = made(lab)
    capsys.readouterr()
    assert main(["study", "check", str(study.folder), "--correct"]) == 0
    told = capsys.readouterr().out
    assert "  odd: force is divided by 1.5" in told
    assert "  off: 1.5" in told
    assert "taken off force" in told
    now = Study(study.folder)
    found = {run.file: run.corrections for run in now.settings.runs if run.corrections}
    assert sorted(found) == ["data/odd.csv", "data/off.csv"]
    ((gain,), (zero,)) = (found["data/odd.csv"], found["data/off.csv"])
    assert gain == ("force", "gain", pytest.approx(1.5, rel=0.01))
    assert zero == ("force", "bias", pytest.approx(1.5, rel=0.05))
    assert main(["study", "check", str(study.folder), "--correct"]) == 0
    assert Study(study.folder).settings == now.settings  # there is nothing left


def test_parts_that_disagree_are_told_and_left_as_they_are(lab, capsys):
    write(lab / "odd.csv", with_gap(bench_run(7), (1.5, 2.5)))
    study = made(lab)
    before = (study.folder / "study.toml").read_bytes()
    capsys.readouterr()
    assert main(["study", "check", str(study.folder), "--correct"]) == 0
    told = capsys.readouterr().out
    assert "odd is not corrected: by odd (1 of 2) force is divided by 1.5" in told
    assert "by odd (2 of 2) force is divided by 2.5" in told
    assert "No single value is right for all parts. Make a file of each part, or leave it" in told
    assert "From now on" not in told
    assert (study.folder / "study.toml").read_bytes() == before
    assert main(["study", "check", str(study.folder), "--correct", "--json"]) == 0
    assert "odd is not" in json.loads(capsys.readouterr().out)["not_corrected"][0]


@pytest.fixture
def study(lab: Path) -> Study:
    write(lab / "odd.csv", with_gap(bench_run(7)))
    return made(lab)


def of_odd(*values: float, fault: str = "gain") -> dict[str, list[Correction]]:
    pairs = zip(SIZES, values, strict=False)
    return {part: [Correction("force", fault, value)] for part, value in pairs}


def test_parts_count_by_their_samples(study: Study):
    (run,) = joined_corrections(study.folder, study.settings, of_odd(1.5, 1.54), SIZES)
    assert run.corrections == (("force", "gain", pytest.approx(1.51)),)
    assert (run.name, run.place, run.notes) == ("odd", ("data/odd.csv", 0), ())


def test_a_part_that_does_not_show_the_fault_is_told(study: Study):
    (run,) = joined_corrections(study.folder, study.settings, of_odd(1.5), SIZES)
    assert run.corrections == (Correction("force", "gain", 1.5),)
    assert run.notes == ("odd (2 of 2): the check does not find this fault there.",)


def test_lines_of_several_frequencies_are_all_taken_off(study: Study):
    both = [Correction("force", "line", value) for value in (50.0, 150.0)]
    found = {"odd (1 of 2)": both, "odd (2 of 2)": [Correction("force", "line", 50.02)]}
    (run,) = joined_corrections(study.folder, study.settings, found, SIZES)
    assert run.corrections == tuple(both)


def test_python_joins_parts_as_well(study: Study):
    (run,) = [one for one in study.with_corrections(of_odd(1.5, 1.54)).settings.runs
              if one.corrections]  # fmt: skip
    assert run.corrections == (("force", "gain", pytest.approx(1.52)),)
    with pytest.raises(StudyError, match=r"study\.toml: odd is not corrected"):
        study.with_corrections(of_odd(2.0, 4.0, fault="bias"))
