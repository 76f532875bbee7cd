"""The FMUs in other tools, and the files of the FMI cross-check."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv, read_ref_opt_file

from benchmarks import _hosts, compatibility
from benchmarks.compatibility import Result
from bristle.fmu import catalogue
from bristle.fmu.description import read_description


@pytest.mark.parametrize("name", ["BinghamDamper", "SignalSource"])
def test_files_of_the_cross_check_are_read_and_give_the_reference(
    name: str, tmp_path: Path
) -> None:
    folder = compatibility.cross_check(name, tmp_path)
    assert folder.relative_to(tmp_path).parts[:3] == ("fmus", "2.0", "cs")
    names = {file.name.replace(name, "NAME") for file in folder.iterdir()}
    assert names - {"NAME_in.csv"} == {"NAME.fmu", "NAME_ref.csv", "NAME_ref.opt", "README.md"}
    fmu = folder / f"{name}.fmu"
    assert fmpy.supported_platforms(str(fmu))
    options = read_ref_opt_file(folder / f"{name}_ref.opt")
    wanted = read_csv(folder / f"{name}_ref.csv")
    given = folder / f"{name}_in.csv"
    about = read_description(fmu)
    assert given.exists() == any(not v.optional for v in about.of("input"))
    outputs = [v.name for v in about.of("output") if v.kind == "Real"]
    assert wanted.dtype.names == ("time", *outputs)
    found = fmpy.simulate_fmu(
        str(fmu), validate=True, start_time=options["StartTime"], stop_time=options["StopTime"],
        step_size=options["StepSize"], output_interval=options["StepSize"],
        input=read_csv(given) if given.exists() else None, output=outputs,
    )  # fmt: skip
    assert len(found) == len(wanted)
    for column in wanted.dtype.names:
        largest = np.abs(wanted[column]).max()
        assert largest > 0.0, column
        off = np.abs(found[column] - wanted[column]).max()
        assert off <= options["RelTol"] * largest, column


def test_an_fmu_in_a_tool_gives_the_rows_of_its_object(tmp_path: Path) -> None:
    path = compatibility.built("LuGreDamper", tmp_path)
    result = compatibility.try_host("FMPy", "LuGreDamper", path)
    assert (result.good, result.steps) == (True, compatibility.STEPS)


def test_a_host_that_fails_says_why(tmp_path: Path) -> None:
    path = compatibility.built("ConstantVoltage", tmp_path)
    job = {"path": str(path), "inputs": {}, "outputs": ["current"], "steps": 1, "step": 0.1}
    with pytest.raises(_hosts.HostError, match="exit 1: KeyError: 'current'"):
        _hosts.play("FMPy", job)


@pytest.mark.parametrize("name", catalogue.component_names())
def test_references_move(name: str) -> None:
    about = catalogue.describe(name)
    given = [compatibility.held(about)] * 101
    rows = np.array(compatibility.reference(name, given, 0.002))
    assert rows.shape[0] == 101
    assert np.isfinite(rows).all()
    assert np.abs(rows).max() > 0.0


def test_what_was_seen_is_told() -> None:
    seen = [
        Result("One", "FMPy", 200, 0.0),
        Result("One", "Ecos", 200, 2e-6),
        Result("Two", "FMPy", 200, 3e-12),
        Result("Two", "Ecos", 200, None, "exit -11: without a word"),
    ]
    first, second = compatibility.rows(seen)
    assert (first.measured, first.ratio) == ("2 of 2", 1.0)
    assert second.measured == "0 of 2"
    assert second.note == "One differs within 2e-06; Two fails: exit -11: without a word"
    text = compatibility.tables(seen, date(2026, 1, 2))
    assert "| 2 of 2 FMUs give equal rows within 3e-12 |" in text
    assert "- `One` in Ecos: differs within 2e-06." in text
    assert "- `Two` in Ecos: fails: exit -11: without a word." in text
    assert "| libcosim | | " in text
    assert "2026-01-02 |" in text


def test_rows_of_another_shape_differ() -> None:
    assert compatibility.difference([[1.0]], [[1.0], [2.0]]) == float("inf")
    assert compatibility.difference([[1.0, float("nan")]], [[1.0, 1.0]]) == float("inf")
    assert compatibility.difference([[1.0, 3.0]], [[2.0, 3.0]]) == 0.5
