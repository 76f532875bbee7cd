"""MAT files as Simulink, dSPACE and scripts write them: signals, names and units, runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from bristle.cli import main
from bristle.data.guess import guess_channels
from bristle.data.measurement import measurements_of
from bristle.data.pieces import pieces_of
from bristle.data.read import read_table

N = 1500
T = 0.002 * np.arange(N)


def path(t):
    return 10.0 * np.sin(2.0 * np.pi * 1.3 * t)


def force(t):
    return 400.0 * np.tanh(4.0 * np.cos(2.0 * np.pi * 1.3 * t))


X, F, U = path(T), force(T), np.where(T < 1.5, 1.0, 2.0)


def column(values: Any) -> Any:
    return np.reshape(values, (-1, 1))


def cell(*items: Any) -> Any:
    out = np.empty((len(items), 1), dtype=object)
    out[:, 0] = items
    return out


def structures(*items: dict[str, Any]) -> Any:
    out = np.zeros((1, len(items)), dtype=[(key, object) for key in items[0]])
    for k, item in enumerate(items):
        for key, value in item.items():
            out[0, k][key] = value
    return out


def with_time(values: Any, label: str, time: Any = T) -> dict[str, Any]:
    signals = {"values": column(values), "dimensions": 1.0, "label": label}
    return {"time": column(time), "signals": signals, "blockName": f"rig/{label}"}


def named(name: str, values: Any, unit: str, **more: Any) -> dict[str, Any]:
    return {"Name": name, "Data": values[None], "Unit": unit, **more}


SIGNALS = (("displacement", X, "mm"), ("voltage", U, "V"), ("force", F, "N"))
DSPACE = structures(*(named(n, v, u, XIndex=1.0) for n, v, u in SIGNALS))
LABELLED = structures(
    *({"values": column(v), "dimensions": 1.0, "label": f"{n} [{u}]"} for n, v, u in SIGNALS)
)
NAMES, UNITS = ([one[k] for one in SIGNALS] for k in (0, 2))
HEADS = np.array([["time", *NAMES], ["s", *UNITS]], object)
TABLE = np.column_stack([T, X, U, F])

HELD: dict[str, dict[str, Any]] = {
    "structure with time": {"Scope": {"time": column(T), "signals": LABELLED}},
    "structure, the time apart": {
        "tout": column(T), "Scope": {"time": np.zeros((0, 0)), "signals": LABELLED},
    },
    "structure with time per signal": {
        "disp_mm": with_time(X, "disp_mm"), "coil_V": with_time(U, ""), "force_N": with_time(F, ""),
    },
    "matrix per signal": {
        "disp_mm": np.column_stack([T, X]), "coil_V": np.column_stack([T, U]),
        "force_N": np.column_stack([T, F]),
    },
    "row matrix per signal": {
        "disp_mm": np.array([T, X]), "coil_V": np.array([T, U]), "force_N": np.array([T, F]),
    },
    "time and data per signal": {
        name: {"time": column(T), "data": column(v), "units": unit} for name, v, unit in SIGNALS
    },
    "time series of even steps in ms": {
        n: {
            "Name": n, "Data": column(v), "DataInfo": {"Units": {"Name": unit}},
            "TimeInfo": {"Units": "milliseconds", "Start": 0.0, "Increment": 2.0},
        }
        for n, v, unit in SIGNALS
    },
    "dSPACE, names as paths": {
        "rec_001": {
            "X": named("'HostService'", T, "s"),
            "Y": structures(*(
                named(f'"Model Root"/"Sensors"/"{n}"/"Out1"', v, u, XIndex=1.0)
                for n, v, u in (("path", X, "mm"), ("coil", U, "V"), ("load", F, "N"))
            )),
        },
    },
    "dSPACE": {"rec": {"X": named("time", T, "s"), "Y": DSPACE}},
    "channels": {
        "ch": structures(*({"name": n, "values": column(v), "units": u} for n, v, u in SIGNALS)),
        "fs": 500.0,
    },
    "names and units": {
        "data": TABLE, "names": cell("time", *NAMES), "units": cell("s", *UNITS),
    },
    "names of all but the time": {"data": TABLE, "labels": cell(*NAMES), "units": cell(*UNITS)},
    "names in a line": {"data": TABLE, "header": ",".join(["time", *NAMES]), "units": "s,mm,V,N"},
    "names above units": {"data": TABLE, "header": HEADS},
    "names beside units": {"data": TABLE, "header": HEADS.T},
    "headers with units": {
        "A": {"data": TABLE, "colheaders": cell("t [s]", "x [mm]", "u [V]", "F [N]")},
    },
}  # fmt: skip


@pytest.mark.parametrize("kind", HELD)
def test_signals_are_read_with_their_units_and_times(tmp_path: Path, kind: str) -> None:
    savemat(tmp_path / "run.mat", HELD[kind])
    table = read_table(tmp_path / "run.mat")
    assert not table.remarks
    (run,) = measurements_of(table, estimate=False)
    np.testing.assert_allclose(run.time, T, atol=1e-9)
    np.testing.assert_allclose(1e3 * run["displacement"], X, atol=1e-9)
    np.testing.assert_allclose(run["voltage"], U)
    np.testing.assert_allclose(run["force"], F, atol=1e-9)
    assert not [one for one in guess_channels(table) if one.doubt and one.channel != "time"]


@pytest.mark.parametrize(
    "held",
    [
        {"disp_mm": with_time(X, ""), "force_N": with_time(force(T + 0.3), "", T + 0.3)},
        {"disp_mm": np.column_stack([T, X]),
         "force_N": np.column_stack([T + 0.3, force(T + 0.3)])[::2]},
        {"ch": structures(
            {"name": "displacement", "data": X, "unit": "mm", "dt": 0.002, "t0": 0.0},
            {"name": "force", "data": force(T + 0.3), "unit": "N", "dt": 0.002, "t0": 0.3},
        )},
        {"rec": {
            "X": structures(named("time", T, "s"), named("time", T[::2] + 0.3, "s")),
            "Y": structures(named("displacement", X, "mm", XIndex=1.0),
                            named("force", force(T[::2] + 0.3), "N", XIndex=2.0)),
        }},
    ],
    ids=["structures", "matrices", "steps and starts", "dSPACE"],
)  # fmt: skip
def test_signals_of_other_times_are_put_on_one(tmp_path: Path, held: dict[str, Any]) -> None:
    savemat(tmp_path / "run.mat", held)
    table = read_table(tmp_path / "run.mat")
    assert any("begins 300 ms" in remark for remark in table.remarks)
    (run,) = measurements_of(table, estimate=False)
    np.testing.assert_allclose(1e3 * run["displacement"], path(run.time), atol=1e-6)
    np.testing.assert_allclose(np.abs(run["force"]), np.abs(force(run.time)), atol=10.0)


RUN = {"time": column(T), "disp_mm": column(X), "force_N": column(F)}
TWICE = {"time": column(T), "disp_mm": column(2.0 * X), "force_N": column(2.0 * F)}


@pytest.mark.parametrize(
    "held",
    [
        {"test": structures(RUN, TWICE)},
        {"exp": {"by": "me", "test": structures(RUN, TWICE)}, "info": "words"},
        {"run1": RUN, "run2": TWICE},
    ],
)
def test_runs_are_no_channels_of_each_other(tmp_path: Path, capsys, held: dict[str, Any]) -> None:
    file = tmp_path / "runs.mat"
    savemat(file, held)
    table = read_table(file)
    assert [column.text for column in table.columns] == ["time", "disp_mm", "force_N", "run"]
    first, second = pieces_of(table, "column run", {})
    np.testing.assert_allclose(second.values["force_N"], 2.0 * first.values["force_N"])
    new = ["study", "new", str(tmp_path / "s"), "--data", str(file), "--quiet"]
    assert main(new) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "a study of 2 runs" in said
    assert "it holds 2 runs" in said


def test_an_array_of_runs_of_version_7_3(tmp_path: Path) -> None:
    file = tmp_path / "runs.mat"
    with h5py.File(file, "w", userblock_size=512) as out:
        group, kept = out.create_group("test"), out.create_group("#refs#")
        for key in RUN:
            refs = []
            for k, run in enumerate((RUN, TWICE)):
                refs.append([kept.create_dataset(f"{key}{k}", data=run[key].T).ref])
            group.create_dataset(key, data=np.array(refs, dtype=h5py.ref_dtype))
    content = bytearray(file.read_bytes())
    content[:26] = b"MATLAB 7.3 MAT-file, Platf"
    file.write_bytes(content)
    first, second = pieces_of(read_table(file), "column run", {})
    np.testing.assert_allclose(second.values["disp_mm"], 2.0 * first.values["disp_mm"])


def test_a_list_of_names_that_does_not_fit_is_said(tmp_path: Path) -> None:
    savemat(tmp_path / "run.mat", {"data": TABLE, "names": cell("a", "b")})
    table = read_table(tmp_path / "run.mat")
    assert table.remarks == ("names has 2 texts, and data 4 columns: it is not used",)
    (time,) = guess_channels(table)
    assert time.doubt == "no unit is given, s is assumed: 500 Hz"


@pytest.mark.parametrize(
    "content",
    [
        {"test": {"time": T, "x": X, "F": F, "units": {"time": "s", "x": "mm", "F": "kN"}}},
        {"time": T, "x": X, "F": F, "x_unit": "mm", "F_unit": "kN"},
        {"Channel_1_Data": T, "Channel_1_Header": {"SignalName": "Time", "Unit": "s"},
         "Channel_2_Data": X, "Channel_2_Header": {"SignalName": "Weg", "Unit": "mm"},
         "Channel_3_Data": F, "Channel_3_Header": {"SignalName": "Kraft", "Unit": "kN"}},
        {"x": {"Time": T, "Data": X, "DataInfo": {"Units": "mm"}},
         "F": {"Time": T, "Data": F, "DataInfo": {"Units": "kN"}}},
    ],
)  # fmt: skip
def test_units_that_stand_beside_vectors(tmp_path: Path, content: dict[str, Any]) -> None:
    savemat(tmp_path / "run.mat", content)
    found = {one.channel: one.unit for one in guess_channels(read_table(tmp_path / "run.mat"))}
    assert found == {"time": "s", "displacement": "mm", "force": "kN"}


@pytest.mark.parametrize("ending", ["mat", "h5"])
def test_counts_beside_a_scale_are_told(tmp_path: Path, capsys, ending: str) -> None:
    file, counts = tmp_path / f"run.{ending}", np.round(F / 0.05).astype(np.int16)
    if ending == "mat":
        savemat(file, {"t": T, "disp_mm": X, "force_N": counts, "scale": 0.05})
    else:
        with h5py.File(file, "w") as out:
            out.update({"t": T, "disp_mm": X, "force_N": counts})
            out["force_N"].attrs["scale"] = 0.05
    assert main(["study", "new", str(tmp_path / "s"), "--data", str(file)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"run.{ending}: force_N holds int16, and scale beside it is not applied" in said
    assert "expected values in a unit, such as force_N * scale" in said


STATED = {
    "a step in ms": {"x_mm": X, "u_V": U, "F_N": F, "dt_ms": 2.0},
    "a rate in kHz": {"x_mm": X, "u_V": U, "F_N": F, "fs_kHz": 0.5},
    "value and unit": {
        key: {"value": one, "unit": unit, "dx": 0.002}
        for key, one, unit in (("disp", X, "mm"), ("coil", U, "V"), ("force", F, "N"))
    },
}


@pytest.mark.parametrize("kind", [*STATED, "NPZ"])
def test_steps_and_units_that_are_stated_beside_the_values(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "run.mat"
    if kind == "NPZ":
        file = tmp_path / "run.npz"
        np.savez(
            file, data=np.column_stack([T, X, U, F]), names=["t [s]", "x [mm]", "u [V]", "F [N]"]
        )
    else:
        savemat(file, STATED[kind])
    (run,) = measurements_of(read_table(file), estimate=False)
    assert run.step == pytest.approx(0.002)
    np.testing.assert_allclose(run["displacement"], 1e-3 * X, atol=1e-9)
    np.testing.assert_allclose(run["force"], F, atol=1e-9)
    np.testing.assert_allclose(run["voltage"], U)


@pytest.mark.parametrize("named", [True, False])
def test_a_frame_in_parquet_keeps_its_index_and_its_units(tmp_path: Path, named: bool) -> None:
    index = pd.to_timedelta(T, unit="s")
    frame = pd.DataFrame({"disp": X, "force": F}, index=index.rename("time") if named else index)
    frame.attrs["units"] = {"disp": "mm", "force": "N"}
    frame.to_parquet(tmp_path / "run.parquet")
    (run,) = measurements_of(read_table(tmp_path / "run.parquet"), estimate=False)
    assert run.step == pytest.approx(0.002)
    np.testing.assert_allclose(run["force"], F)
