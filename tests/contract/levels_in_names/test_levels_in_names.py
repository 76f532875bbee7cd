"""Levels in file names: how decimals are written is settled by all names and the motion."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main

RATE = 100.0


def made(folder: Path, names: dict[str, tuple[float, float]], amplitude: float = 0.01) -> str:
    """Return a folder of sines on a damper: name to frequency [Hz] and current [A]."""
    folder.mkdir()
    for k, (name, (frequency, level)) in enumerate(names.items()):
        rng = np.random.default_rng(k)
        t = np.arange(round(max(6.0, 4.0 / frequency) * RATE)) / RATE
        w = 2.0 * np.pi * frequency
        x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
        force = (
            (50.0 + 800.0 * level) * np.tanh(v / 4e-3) + 900.0 * v + rng.normal(0.0, 2.0, t.size)
        )
        rows = (f"{a:.3f},{1e3 * b:.4f},{c:.3f}" for a, b, c in zip(t, x, force, strict=True))
        (folder / f"{name}.csv").write_text("time [s],x [mm],F [N]\n" + "\n".join(rows) + "\n")
    return str(folder / "*.csv")


def runs(study: Path) -> dict[str, tuple[float | None, float | None]]:
    """Return frequency and current of each run by its file's name."""
    read = tomllib.loads((study / "study.toml").read_text())["runs"]
    return {
        Path(run["file"]).stem: (run.get("frequency"), run.get("current", run.get("voltage")))
        for run in read
    }


def told(name: str, mark: str) -> str:
    return name.replace(".", mark)


CAMPAIGN = {
    f"{f}Hz_{i}A": (float(f), float(i))
    for f, i in (("0.5", "0.0"), ("0.5", "0.5"), ("1.5", "0.5"), ("1.5", "1.5"), ("2.5", "1.0"))
}


@pytest.mark.parametrize(
    "mark",
    [
        "_",
        "-",
        "x",
        "X",
        "d",
        "p",
        "P",
        "pt",
        ",",
        ".",
        "·",
        "point",
        " ",
        "komma",
        "k",
        "c",
        "#",
        "__",
        "÷",
    ],
)
def test_a_decimal_mark_is_settled_by_the_measured_frequency(tmp_path, mark) -> None:
    names = {f"run_{told(name, mark)}": value for name, value in CAMPAIGN.items()}
    data = made(tmp_path / "lab", names)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert runs(tmp_path / "rig") == names


def test_decimals_of_a_number_without_a_unit_begin_no_other(tmp_path) -> None:
    names = {"i0,5_1Hz": (1.0, 0.5), "i1,0_1Hz": (1.0, 1.0), "i1,5_2Hz": (2.0, 1.5)}
    data = made(tmp_path / "lab", names)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert runs(tmp_path / "rig") == {name: (f, None) for name, (f, _) in names.items()}


@pytest.mark.parametrize("mark", ["x", "_"])
def test_numbers_without_a_space_and_a_mark_in_some_names_only(tmp_path, mark, capsys) -> None:
    names = {
        told(f"10mm{f:g}Hz{i:g}A", mark): (f, i) for f in (0.25, 0.5, 1.0) for i in (0.0, 0.25, 1.0)
    }
    data = made(tmp_path / "lab", names)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert f'"{mark}" in the names is a decimal mark' in " ".join(capsys.readouterr().out.split())
    assert runs(tmp_path / "rig") == names
    assert main(["study", "check", str(tmp_path / "rig")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "load cell" not in said
    assert "by its label" not in said


def test_numbers_without_a_mark_have_the_decimals_that_the_motion_tells(tmp_path, capsys) -> None:
    names = {"050Hz_000V": (0.5, 0.0), "150Hz_050V": (1.5, 0.5), "250Hz_150V": (2.5, 1.5)}
    data = made(tmp_path / "lab", names)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert "have 2 decimals, by the measured motion" in " ".join(capsys.readouterr().out.split())
    assert runs(tmp_path / "rig") == names


def test_a_unit_may_stand_for_the_decimal_mark(tmp_path) -> None:
    names = {"s_0Hz5_0A5": (0.5, 0.5), "s_1Hz5_1A0": (1.5, 1.0), "s_2Hz5_1A5": (2.5, 1.5)}
    data = made(tmp_path / "lab", names)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert runs(tmp_path / "rig") == names


@pytest.mark.parametrize(
    ("names", "values"),
    [
        (("run_1_5A", "run_2_10A", "run_3_15A"), (5.0, 10.0, 15.0)),
        (("run_0_0A", "run_1_5A", "run_2_10A"), (0.0, 5.0, 10.0)),
        (("MR2_5A", "MR2_10A", "MR2_0A"), (5.0, 10.0, 0.0)),
        (("oil100_10A", "oil40_10A", "oil40x20A"), (10.0, 10.0, 20.0)),
        (("oil0_10A", "oil5_10A", "oil5_20A"), (10.0, 10.0, 20.0)),
        (("I0_5A", "I1_5A", "I2_5A"), (0.5, 1.5, 2.5)),
        (("run_05_1A", "run_05_2A", "run_06_0A"), (1.0, 2.0, 0.0)),  # of a day
        (("2A1", "2A2", "1A1"), (2.0, 2.0, 1.0)),
        (("500mA", "1000mA", "0mA"), (0.5, 1.0, 0.0)),
        (("I0_5A", "I1A", "I0_25A"), (0.5, 1.0, 0.25)),
        (("20C2A", "40C1A", "60C0A"), (2.0, 1.0, 0.0)),
        (("0.5Amps_a", "1AMP_b", "0AMPS_c"), (0.5, 1.0, 0.0)),
        (("0.8712V_ensaio1_2_2", "0.0000V_ensaio10_1", "3.2120V_A_10"), (0.8712, 0.0, 3.212)),
    ],
)  # fmt: skip
def test_names_alone_settle_what_counts_and_what_is_a_level(tmp_path, names, values) -> None:
    data = made(tmp_path / "lab", {n: (1.0 + 0.1 * k, v) for k, (n, v) in
                                   enumerate(zip(names, values, strict=True))})  # fmt: skip
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    read = runs(tmp_path / "rig")
    assert [read[name][1] for name in names] == pytest.approx(values)


@pytest.mark.parametrize(
    ("names", "label", "values"),
    [
        (("run_0_50psi", "run_1_100psi", "run_2_75psi"), "pressure_psi", (50.0, 100.0, 75.0)),
        (("speed6_100_PSI", "speed1_50_PSI"), "pressure_psi", (100.0, 50.0)),
        (("run1_1bar", "run2_2bar", "run3_3bar"), "pressure_bar", (1.0, 2.0, 3.0)),
        (("bolts20Nm", "bolts40Nm"), "torque_N.m", (20.0, 40.0)),
        (("a_1in", "b_0.5in"), "amplitude", (0.0254, 0.0127)),
        (("run_1", "run_2"), "", ()),
        (("50psi_a", "b"), "", ()),
    ],
)
def test_a_number_with_a_unit_is_a_label_where_all_names_have_one(
    tmp_path, capsys, names, label, values
) -> None:
    data = made(tmp_path / "lab", {name: (1.0 + k, 0.0) for k, name in enumerate(names)}, 0.0127)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    said = capsys.readouterr().out.count("from the names of the files")
    read = tomllib.loads((tmp_path / "rig" / "study.toml").read_text())["runs"]
    told = {Path(run["file"]).stem: {**run.get("labels", {}), **run} for run in read}
    assert [told[name].get(label) for name in names if label] == pytest.approx([*values])
    assert said == (1 if label else 0)
    assert label or not any("labels" in run for run in read)


def test_a_power_of_ten_is_no_level_of_its_own(tmp_path) -> None:
    data = made(tmp_path / "lab", {"5E-1A_1Hz": (1.0, 0.5), "1E0A_2Hz": (2.0, 1.0)})
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert runs(tmp_path / "rig") == {"5E-1A_1Hz": (1.0, None), "1E0A_2Hz": (2.0, None)}


def test_two_names_of_one_level_that_may_be_two_are_not_taken(tmp_path, capsys) -> None:
    data = made(tmp_path / "lab", {"run_0_5A": (1.0, 0.5), "run_1_5A": (2.0, 1.5)})
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    said = [
        line
        for line in " ".join(capsys.readouterr().out.split()).split("Note: ")
        if "nothing settles" in line
    ]
    assert len(said) == 1
    assert "5 A or 0.5 A" in said[0]
    assert "--runs FILE" in said[0]
    assert {level for _, level in runs(tmp_path / "rig").values()} == {None}


def test_a_range_in_a_name_is_no_level(tmp_path, capsys) -> None:
    names = {f"{f}Hz_{i}-{i + 1.0}A": (f, None) for f in (0.5, 1.5) for i in (0.0, 0.5)}
    sines = {name: (f, 0.5) for name, (f, _) in names.items()}
    assert (
        main(["study", "new", str(tmp_path / "rig"), "--data", made(tmp_path / "lab", sines)]) == 0
    )
    assert "is a range: no current is taken" in " ".join(capsys.readouterr().out.split())
    assert runs(tmp_path / "rig") == names


def test_levels_in_the_names_of_folders_are_read(tmp_path) -> None:
    for level in ("0.5", "1.0", "1.5"):
        made(tmp_path / f"{level}A", {f"{f}Hz_{level}A": (f, float(level)) for f in (1.0, 2.0)})
        for file in (tmp_path / f"{level}A").iterdir():
            file.rename(file.with_stem(f"{file.stem.partition('_')[0]}_{tmp_path.name}"))
    data = str(tmp_path / "*A" / "*.csv")
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert sorted({level for _, level in runs(tmp_path / "rig").values()}) == [0.5, 1.0, 1.5]


@pytest.mark.parametrize(
    ("names", "said"),
    [(("1Hz_0.5A", "2Hz_1A", "3Hz_off"), 'are in 2 of 3 names, and not in "3Hz_off.csv"'),
     (("1Hz_0.5A_2V", "2Hz_1A_4V", "3Hz_2A_8V"), "names tell current and voltage: --level '{}A'")],
)  # fmt: skip
def test_levels_that_names_do_not_tell_alone_are_said_and_not_taken(tmp_path, capsys, names, said):
    data = made(tmp_path / "lab", {name: (1.0 + k, k) for k, name in enumerate(names)})
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert said in " ".join(capsys.readouterr().out.split())
    assert {level for _, level in runs(tmp_path / "rig").values()} == {None}


def test_decimals_by_the_frequency_are_not_those_of_milliamperes(tmp_path) -> None:
    names = {"050Hz_10mm_050mA": (0.5, 0.05), "150Hz_10mm_100mA": (1.5, 0.1)}
    data = made(tmp_path / "lab", names)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert runs(tmp_path / "rig") == names


@pytest.mark.parametrize("other", ["0_50V", "0.50V_b", "1p50V"])
def test_a_number_with_a_mark_beside_one_that_may_lack_it_is_not_taken(tmp_path, capsys, other):
    data = made(tmp_path / "lab", {"1Hz_050V": (1.0, 0.5), f"2Hz_{other}": (2.0, 1.5)})
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    assert "no voltage is taken. --runs FILE" in " ".join(capsys.readouterr().out.split())
    assert {level for _, level in runs(tmp_path / "rig").values()} == {None}


def test_a_pattern_takes_a_number_whole_where_it_fits_no_other_way(tmp_path) -> None:
    data = made(tmp_path / "lab", {"run_0_5A": (1.0, 0.5), "run_1_5A": (2.0, 1.5)})
    study = str(tmp_path / "rig")
    assert main(["study", "new", study, "--data", data, "--level", "run_{}A"]) == 0
    assert [level for _, level in runs(tmp_path / "rig").values()] == [0.5, 1.5]


def test_a_label_that_the_motion_contradicts_is_said_and_blames_no_sensor(tmp_path, capsys):
    names = {f"f{f}Hz_I{i}A": (0.3 * f, 0.2 * i) for f in (3, 6) for i in (0, 2, 5)}
    data = made(tmp_path / "lab", names)
    study = str(tmp_path / "rig")
    assert main(["study", "new", study, "--data", data]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "frequency is 3 Hz by its label, and the motion has 0.9" in said
    assert "in 5 more of 6 runs" in said
    assert main(["study", "check", study]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "by its label, and the motion has" in said
    assert "load cell" not in said


def test_two_names_that_say_the_same_of_different_motions(tmp_path, capsys) -> None:
    names = {"a_1Hz_0.5A": (1.0, 0.5), "b_1Hz_0.5A": (2.0, 0.5), "c_1Hz_1A": (1.0, 1.0)}
    data = made(tmp_path / "lab", names)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    said = [
        line
        for line in " ".join(capsys.readouterr().out.split()).split("Note: ")
        if "by its label" in line
    ]
    assert len(said) == 1
    assert said[0].startswith(
        "b_1Hz_0.5A.csv: frequency is 1 Hz by its label, and the motion has 2"
    )


def test_a_stroke_in_the_name_and_a_rig_that_reaches_less_are_no_contradiction(tmp_path, capsys):
    data = made(tmp_path / "lab", {"20mm_1Hz_1A": (1.0, 1.0), "20mm_2Hz_2A": (1.9, 2.0)}, 0.009)
    assert main(["study", "new", str(tmp_path / "rig"), "--data", data]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "by its label" not in said
    assert '"20mm": 10 mm. By the measured motion "20mm" is the stroke, twice of it' in said


def test_two_columns_of_one_command_are_refused(tmp_path, capsys) -> None:
    data = made(tmp_path / "lab", {"a": (1.0, 1.0), "b": (2.0, 0.0)})
    (tmp_path / "runs.csv").write_text("file,current [A],current [mA]\na,1,1000\nb,1,2\n")
    options = ["--data", data, "--runs", str(tmp_path / "runs.csv")]
    assert main(["study", "new", str(tmp_path / "rig"), *options]) == 2
    assert "current [A], current [mA] all tell the current; one is" in capsys.readouterr().err


def test_what_a_table_of_runs_says_is_told_with_its_units(tmp_path, capsys) -> None:
    data = made(tmp_path / "lab", {"a": (1.0, 1.0), "b": (2.0, 0.0)})
    table = tmp_path / "runs.csv"
    for text, told in (
        ("file,current,oil\na.csv,1000,new\nb.csv,0,new\n", "current 1000 A, 0 A; oil new"),
        ("file;current [mA]\na.csv;1,000\nb.csv;0\n", "current 0.001 A, 0 A"),
        ("file;load [kN]\nC:\\lab\\a.csv;5\nC:\\lab\\b.csv;10\n", "load 5 kN, 10 kN"),
    ):
        table.write_text(text)
        study = str(tmp_path / f"rig {len(text)}")
        assert main(["study", "new", study, "--data", data, "--runs", str(table)]) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert f"of each run, from {table}: {told}" in said.replace("Of each", "of each")


def test_one_amplitude_in_names_and_two_in_motions_is_said(tmp_path, capsys) -> None:
    made(tmp_path / "lab_1", {"10mm_1Hz_0A": (1.0, 0.0), "10mm_1Hz_1A": (1.0, 1.0)})
    made(tmp_path / "lab_2", {"10mm_2Hz_0A": (2.0, 0.0)}, 0.005)
    study = str(tmp_path / "rig")
    assert main(["study", "new", study, "--data", str(tmp_path / "lab_*" / "*.csv")]) == 0
    told = "amplitude is 10 mm by its label, and the motion has 4.99 mm"
    assert f"10mm_2Hz_0A.csv: {told}" in " ".join(capsys.readouterr().out.split())
    assert main(["study", "check", study]) == 0
    assert f"10mm_2Hz_0A: {told}" in " ".join(capsys.readouterr().out.split())
