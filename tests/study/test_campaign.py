"""The usual campaign: one motion per file, the level of the command in the file's name."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write

import bristle
from bristle.cli import main
from bristle.comparison.conditions import LabelError, label_sentence
from bristle.data.channels import ChannelSpec
from bristle.errors import StudyError
from bristle.fmu.description import read_description
from bristle.physics.drive import DRIVES, VOLTAGE, declared_for, text_for, unit_for
from bristle.physics.effect import EFFECTS
from bristle.prediction.export import export_study
from bristle.study.run_facts import RunChoices, facts_of, rows_of_table
from bristle.study.steps import create_study
from bristle.study.study import Study

RATE = 200.0
FREQUENCIES, LEVELS = (0.5, 1.0, 2.0, 3.0, 4.0), (0.0, 0.5, 1.0, 1.5)


def one_run(frequency: float, level: float, spring: float = 0.0) -> dict[str, np.ndarray]:
    """Return a sine on a damper of 20 N + 100 N/A and 800 N s/m, with a spring beside it."""
    t = np.arange(round(4.0 * RATE)) / RATE
    rng = np.random.default_rng(round(10 * frequency + 100 * level))
    w = 2.0 * np.pi * frequency
    x = 0.01 / max(frequency, 1.0) * np.sin(w * t)
    v = 0.01 / max(frequency, 1.0) * w * np.cos(w * t)
    force = (20.0 + 100.0 * level) * np.tanh(v / 4e-3) + 800.0 * v + spring * x
    return {
        "time [s]": t,
        "x [mm]": 1e3 * x + rng.normal(0.0, 2e-3, t.size),
        "F [N]": force + rng.normal(0.0, 1.0, t.size),
    }


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of 20 files, f1Hz_A10mm_I1A.csv and the like; at 1 A a spring acts."""
    folder = tmp_path_factory.mktemp("lab")
    for f in FREQUENCIES:
        for level in LEVELS:
            spring = 6000.0 if level == 1.0 else 0.0
            name = f"f{f:g}Hz_A{10.0 / max(f, 1.0):.3g}mm_I{level:g}A.csv"
            write(folder / name, one_run(f, level, spring))
    return folder


def files(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.csv"))


def test_levels_and_labels_are_offered_from_the_names(lab, tmp_path, capsys) -> None:
    assert main(["study", "new", str(tmp_path / "rig"), "--data", str(lab)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "No column holds a command. --level 'I{}A' says the same" in said
    assert "0 A, 0.5 A, 1 A, 1.5 A" in said
    study = Study(tmp_path / "rig")
    runs = study.settings.runs
    assert len(runs) == 20
    run = next(run for run in runs if "f2Hz_A5mm_I1.5A" in run.file)
    assert dict(run.levels) == {"current": 1.5}
    assert run.labels == {"frequency": 2.0, "amplitude": pytest.approx(0.005)}
    read = next(one for one in study.read() if one.name == "f2Hz_A5mm_I1.5A")
    assert read.drive == "current"
    assert read.units["current"] == "A"
    assert np.all(read["current"] == 1.5)
    assert study.drive == "current"


def test_compare_says_on_which_runs_the_error_is(lab, tmp_path) -> None:
    study = Study.create(tmp_path / "rig", files(lab), law="tanh")
    found = bristle.identify(study)
    comparison = bristle.compare(study)
    told = " ".join(comparison.sentences)
    # The spring acts at 1 A, and most where the amplitude is largest: either label is right.
    assert "The error is largest in the runs at amplitude 10 mm" in told or "runs at 1 A" in told, (
        told
    )
    worst = max((one for one in comparison.labels if one.name == "current"), key=lambda one: one.z)
    assert (worst.value, worst.text) == (1.0, "1 A")
    assert comparison.as_dict()["labels"][0].keys() == {"label", "value", "z", "runs"}
    from bristle.comparison.view import run_table

    header, rows = run_table(comparison)[:2]
    assert set(header[-3:]) == {"amplitude", "frequency", "current"}
    assert rows[0][-1].endswith(" A")
    # A model of data in ampere names no volt.
    text = (tmp_path / "rig" / "model.toml").read_text()
    assert 'drive = "current"' in text
    assert '"N/A"' in text
    assert '/V"' not in text
    units = {row["name"]: row["unit"] for row in found.parameters()}
    assert units["f_v"] == "N/A"
    answer = json.dumps([found.as_dict(), units]) + told
    assert not re.search(r"\bvolts?\b|\bvoltage\b", answer, re.IGNORECASE)


def test_the_exported_fmu_takes_a_current(lab, tmp_path) -> None:
    study = Study.create(tmp_path / "rig", files(lab)[:4])
    exported = export_study(study)
    ports = read_description(exported.fmu).variables
    assert (ports["current"].causality, ports["current"].unit) == ("input", "A")
    assert ports["current_max"].unit == "A"
    assert ports["sigma_0"].unit == "N/(m.A)"
    with zipfile.ZipFile(exported.fmu) as archive:
        text = archive.read("modelDescription.xml").decode()
    assert not re.search(r"volt|v_max|unit=\"V|/V\b", text, re.IGNORECASE)
    wire = '"damper.current" = { from = "drive.value", factor = 1.0 }'
    assert wire in exported.scenario.read_text()
    results = bristle.run(exported.scenario)
    assert np.std(results["damper.force"]) > 0.0


def test_a_pattern_gives_the_level(lab, tmp_path) -> None:
    data = tmp_path / "data"
    for k, file in enumerate(files(lab)[:3]):
        (data / f"run_c{k}_oil{'AB'[k % 2]}.csv").parent.mkdir(exist_ok=True)
        (data / f"run_c{k}_oil{'AB'[k % 2]}.csv").write_bytes(file.read_bytes())
    choices = RunChoices(levels=["current=_c{}"], labels=["oil=oil{}"])
    created = create_study(tmp_path / "rig", files(data), runs=choices)
    assert [run.levels["current"] for run in created.study.settings.runs] == [0.0, 1.0, 2.0]
    assert "current of each run: from the names of the files, by 'current=_c{}': 0 A, 1 A, 2 A" in (
        created.notes
    )
    assert [run.labels["oil"] for run in created.study.settings.runs] == ["A", "B", "A"]
    assert [one.labels["oil"] for one in created.study.read()] == ["A", "B", "A"]


def test_a_table_beside_the_files_gives_level_role_and_labels(lab, tmp_path) -> None:
    chosen = files(lab)[:3]
    table = tmp_path / "runs.csv"
    roles = ("train", "holdout", "train")
    rows = [
        f"{f.stem};{r};{400 * k};{20 + k},5;B{k}"
        for k, (f, r) in enumerate(zip(chosen, roles, strict=True))
    ]
    table.write_text("\n".join(["file;role;current [mA];temperature [degC];batch", *rows]))
    created = create_study(tmp_path / "rig", chosen, runs=RunChoices(table=table))
    runs = created.study.settings.runs
    assert [run.levels["current"] for run in runs] == pytest.approx([0.0, 0.4, 0.8])
    assert [run.role for run in runs] == list(roles)
    assert runs[1].labels["temperature"] == 21.5
    assert runs[1].labels["batch"] == "B1"


@pytest.mark.parametrize(
    ("names", "values"),
    [
        (["T=-10degC_a", "T=20degC_b"], [-10.0, 20.0]),
        (["cold_-10C", "warm 40C"], [-10.0, 40.0]),
        (["-1p5C", "a -5 C"], [-1.5, -5.0]),
        (["run-10C", "run_1-20C"], [10.0, 20.0]),
        (["LRB--10C-2MPa", "LRB-10C-2MPa"], [-10.0, 10.0]),
        (["oil--10C--2A", "oil--20C--2A"], [10.0, 20.0]),
        (["oil_minus10C", "oil_neg_5C"], [-10.0, -5.0]),
        (["oil--10C", "oil--20C"], [None, None]),
        (["oil_m10C", "oil_10C"], [None, None]),
    ],
)
def test_a_minus_in_a_name_is_a_sign_where_no_word_stands_before_it(names, values) -> None:
    found, _ = facts_of([Path(f"{name}.csv") for name in names], RunChoices(), commanded=True)
    assert [one.labels.get("temperature") for one in found] == values


@pytest.mark.parametrize(
    ("pattern", "name", "value"),
    [("{}A", "run-1A", 1.0), ("{}A", "run_-1A", -1.0), ("run{}A", "run-1A", -1.0)],
)
def test_a_pattern_without_words_reads_the_sign_as_names_are_read(pattern, name, value) -> None:
    (found,), _ = facts_of([Path(f"{name}.csv")], RunChoices(levels=[pattern]), commanded=False)
    assert dict(found.levels) == {"current": value}


def test_numbers_that_count_files_are_no_levels(tmp_path) -> None:
    runs = [write(tmp_path / f"run_{k}A.csv", one_run(1.0, k / 2)) for k in (1, 2, 3)]
    created = create_study(tmp_path / "rig", runs)
    assert not created.study.drive
    assert any("may count the files; --level '{}A' takes them" in note for note in created.notes)
    taken = create_study(tmp_path / "two", runs, runs=RunChoices(levels=["{}A"]))
    assert taken.study.drive == "current"


def test_the_report_tells_what_is_known_of_runs_and_how_to_make_them_again(lab, tmp_path) -> None:
    from bristle.report.study_page import commands, data_table

    study = Study.create(tmp_path / "rig", files(lab)[:4])
    header, rows = data_table(study, study.read())
    assert header[-1] == "known"
    assert rows[0][-1] == "current 0.5 A, frequency 0.5 Hz, amplitude 10 mm"
    assert "--split" not in commands(study)[0]


@pytest.mark.parametrize(
    ("choices", "what"),
    [
        (RunChoices(levels=["U{}V"]), 'it fits no part of "'),
        (RunChoices(levels=["I{}"]), "a unit must follow"),
        (RunChoices(levels=["IA"]), "is the value"),
        (RunChoices(levels=["voltage=I{}A"]), '--level "voltage=I{}A": voltage: '),
        (RunChoices(labels=["oil{}"]), "is right, where {} is the value"),
        (RunChoices(levels=["I{}A"], labels=["batch=Q{}"]), "it fits no part of"),
        (RunChoices(table=Path("nowhere.csv")), "cannot be read"),
    ],
)
def test_what_is_wrong_with_a_pattern_is_one_clear_word(lab, tmp_path, choices, what) -> None:
    with pytest.raises(StudyError, match=re.escape(what)):
        create_study(tmp_path / "rig", files(lab)[:3], runs=choices)
    assert not (tmp_path / "rig").exists()


@pytest.mark.parametrize("rate", ["-5", "nan", "inf"])
def test_a_rate_that_is_none_is_refused(lab, tmp_path, capsys, rate) -> None:
    new = ["study", "new", str(tmp_path / "rig"), "--data", str(lab), f"--rate={rate}"]
    assert main(new) == 2
    assert f"is {rate} Hz (--rate); 0 keeps all samples" in capsys.readouterr().err
    assert not (tmp_path / "rig").exists()


@pytest.mark.parametrize(
    ("rows", "what"),
    [
        ("# a comment", "a line of titles and a line per run are right"),
        ("a.csv,1\nlab/a.csv,2", "row 3: there is a row of a.csv above; one is right"),
        ("a.csv,nan", 'row 2: current is "nan"; a finite number is right'),
    ],
)
def test_a_row_that_cannot_count_is_refused(tmp_path, rows, what) -> None:
    table = tmp_path / "runs.csv"
    table.write_text(f"file,current [A]\n{rows}\n")
    with pytest.raises(StudyError, match=re.escape(what)):
        rows_of_table(table, [Path("a.csv")])


def test_a_table_of_runs_with_two_columns_of_one_name_is_refused(tmp_path) -> None:
    table = tmp_path / "runs.csv"
    table.write_text("file;current [A];current [A]\na.csv;1;2\n")
    with pytest.raises(StudyError, match=r'2 columns are called "current \[A\]"'):
        rows_of_table(table, [Path("a.csv")])


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_a_table_of_runs_in_the_words_of_the_lab(tmp_path, encoding) -> None:
    table = tmp_path / "runs.csv"
    table.write_text("Datei;I [mA];T (°C);gap [mm]\na.csv;500;23,5;1\n", encoding=encoding)
    (found,) = rows_of_table(table, [Path("a.csv")])
    assert found.levels == pytest.approx({"current": 0.5})
    assert found.labels == {"temperature": 23.5, "gap_mm": 1.0}
    (beside,) = rows_of_table(table, [Path("a.csv")], commanded=True)
    assert not beside.levels  # the files hold the command: the nominal one is a label
    table.write_text("file;I [A];supply voltage [V];oil [degC];room [degC]\na.csv;1;2;3;4\n")
    (several,) = rows_of_table(table, [Path("a.csv")])
    assert not several.levels
    assert "temperature" not in several.labels


@pytest.mark.parametrize(
    ("title", "right"),
    [("current [mAmp]", "current [A]"), ("temperature [°R]", "temperature [degC]")],
)
def test_a_table_of_runs_in_a_unit_that_is_not_known_is_refused(tmp_path, title, right) -> None:
    table = tmp_path / "runs.csv"
    table.write_text(f"file,{title}\na.csv,500\n", encoding="utf-8")
    with pytest.raises(StudyError, match=re.escape(f"{right} is right")):
        rows_of_table(table, [Path("a.csv")])


def test_a_table_of_runs_in_fahrenheit(tmp_path) -> None:
    table = tmp_path / "runs.csv"
    table.write_text("file,temperature [°F]\na.csv,77\n", encoding="utf-8")
    (found,) = rows_of_table(table, [Path("a.csv")])
    assert found.labels == {"temperature": pytest.approx(25.0)}


def test_a_speed_in_the_name_of_a_file_is_no_amplitude() -> None:
    names = [Path("v50mm_s_I1A.csv"), Path("v100mm-s_I2A.csv")]
    found, _ = facts_of(names, RunChoices(), commanded=False)
    assert [dict(one.labels) for one in found] == [{}, {}]
    assert [one.levels["current"] for one in found] == [1.0, 2.0]
    (first, _), _ = facts_of([Path("10mm_s1.csv"), Path("20mm_s2.csv")], RunChoices(), False)
    assert first.labels == {"amplitude": pytest.approx(0.01)}


def test_a_table_of_runs_that_is_no_text_is_refused(tmp_path) -> None:
    table = tmp_path / "runs.xlsx"
    with zipfile.ZipFile(table, "w") as book:
        book.writestr("xl/workbook.xml", "<workbook/>")
    with pytest.raises(StudyError, match="Save the table of runs as CSV"):
        rows_of_table(table, [Path("a.csv")])


def test_a_level_and_a_channel_exclude_each_other(tmp_path) -> None:
    one = write(tmp_path / "a_1A.csv", bench_run(1))
    two = write(tmp_path / "b_2A.csv", bench_run(2))
    created = create_study(tmp_path / "quiet", [one, two])  # the channel counts, unasked
    assert not created.study.settings.runs[0].levels
    with pytest.raises(StudyError, match="One of the two"):
        create_study(tmp_path / "rig", [one, two], runs=RunChoices(levels=["{}A"]))


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("current = 0.5", 'current = "much"', "expected a number [A]"),
        ("current = 0.5", "", "no current, which other runs have"),
        ("frequency = 0.5", "oil = 3", 'key "oil"'),
        ("frequency = 0.5", "labels = { current = 2 }", "stands beside file and role"),
        ("frequency = 0.5", "piece = 2", "split and piece go together"),
    ],
)
def test_mistakes_in_runs_have_their_line(lab, tmp_path, old, new, what) -> None:
    Study.create(tmp_path / "rig", files(lab)[:4])
    path = tmp_path / "rig" / "study.toml"
    path.write_text(re.sub(rf"{old} #.*", new, path.read_text(), count=1))
    with pytest.raises(StudyError, match=re.escape(what)) as error:
        Study(tmp_path / "rig")
    assert "study.toml" in str(error.value)


@pytest.mark.parametrize(
    ("title", "drive", "unit"),
    [
        ("Current (amp)", "current", "A"),
        ("current_mA", "current", "mA"),
        ("Duty (%)", "duty", "%"),
        ("PWM [%]", "duty", "%"),
        ("Flux density [mT]", "field", "mT"),
        ("Coil voltage (Volts)", "voltage", "V"),
    ],
)
def test_the_title_tells_the_command(tmp_path, title, drive, unit) -> None:
    runs = []
    for k in (1, 2):
        columns = bench_run(k)
        columns[title] = columns.pop("U [V]")
        runs.append(write(tmp_path / f"run_{k}.csv", columns))
    study = Study.create(tmp_path / "rig", runs)
    assert study.drive == drive
    assert study.settings.channels[drive].unit == unit
    model = study.model()
    assert model.drive == drive
    assert model.facts["sigma_0"].unit == unit_for("N/(m.V)", DRIVES[drive])
    assert model.with_effect("saturation").facts["saturation.V_s"].unit == DRIVES[drive].unit


def test_a_model_made_for_volts_takes_the_unit_of_its_study(tmp_path) -> None:
    columns = bench_run(1)
    columns["I [A]"] = columns.pop("U [V]")
    study = Study.create(tmp_path / "rig", [write(tmp_path / "run.csv", columns)])
    path = tmp_path / "rig" / "model.toml"
    old = path.read_text()
    path.write_text(old.replace('drive = "current"\n', "").replace("m.A)", "m.V)"))
    model = Study(tmp_path / "rig").model()
    assert model.facts["sigma_0"].unit == "N/(m.A)"
    assert model.values == study.model().values
    path.write_text(old.replace('"current"', '"pressure"'))
    with pytest.raises(StudyError, match='drive "pressure"'):
        Study(tmp_path / "rig").model()


def test_words_and_units_of_a_command() -> None:
    assert unit_for("N.s/(m.V)", DRIVES["current"]) == "N.s/(m.A)"
    assert unit_for("N/V", DRIVES["duty"]) == "N/%"
    assert unit_for("N/A", VOLTAGE, "A") == "N/V"
    assert text_for("yield force per volt", DRIVES["field"]) == "yield force per tesla"
    assert text_for("the voltage V", VOLTAGE) == "the voltage V"


def test_a_field_that_is_the_command_is_told_from_the_one_in_the_damper() -> None:
    texts = {name: text_for(EFFECTS[name].first_line(), DRIVES["field"]) for name in ABOUT_FIELD}
    assert texts["coil_lag"].startswith("Coil lag: the field in the damper follows the field with")
    assert texts["saturation"].endswith(
        "the field in the damper grows less and less with the field."
    )
    assert texts["remanence"].startswith("Remanence: the field in the damper lags behind the field")
    core = declared_for(EFFECTS["saturation"].parameters["V_s"], DRIVES["field"])
    assert (core.unit, core.text) == ("T", "field at which the field in the damper saturates")
    assert "in the damper" not in text_for(EFFECTS["coil_lag"].first_line(), DRIVES["current"])


ABOUT_FIELD = ("coil_lag", "saturation", "remanence")


def test_a_verdict_speaks_of_its_own_command() -> None:
    from bristle.diagnosis.view import verdict_view
    from bristle.diagnosis.words import about, drive_of
    from bristle.view.blocks import Table

    floor = {"force": 1.0, "current": 0.0}
    verdict = {"kind": "none", "noise_floor": floor, "untestable": ["coil_lag"]}
    assert drive_of(verdict) == DRIVES["current"]
    assert drive_of({}) == VOLTAGE
    (table,) = verdict_view(verdict).every(Table)
    told = " ".join(table.rows[0]) + about("remanence", DRIVES["current"])
    assert "current" in told
    assert "volt" not in told


def test_labels_part_the_runs_or_they_are_not_told() -> None:
    def errors(*z: float) -> list[LabelError]:
        return [LabelError("temperature", 20.0 + 10.0 * k, one, 2) for k, one in enumerate(z)]

    assert label_sentence(errors(1.0, 1.02, 0.99)) == ""
    assert label_sentence(errors(1.0, 1.02, 4.0)).startswith("Only the runs at temperature 40 °C")
    assert label_sentence(errors(2.0, 2.1, 5.0)).startswith("The error is largest in the runs at")
    assert label_sentence(errors(5.0, 5.1, 5.2)) == ""
    assert label_sentence([]) == ""


def test_a_given_channel_of_the_command_keeps_names_out(lab, tmp_path) -> None:
    columns = one_run(1.0, 1.0) | {"c": np.full(round(4.0 * RATE), 1.0)}
    runs = [
        write(tmp_path / f"r{k}_I{k}A.csv", columns | {"F [N]": columns["F [N]"] * k})
        for k in (1, 2)
    ]
    spec = {"current": ChannelSpec("c", "A")}
    created = create_study(tmp_path / "rig", runs, channels=spec)
    assert not created.study.settings.runs[0].levels
    assert created.study.drive == "current"


def test_a_column_of_words_is_told_with_the_first_of_them(tmp_path) -> None:
    columns = one_run(1.0, 0.0)
    path = write(tmp_path / "a.csv", columns)
    at = list(columns).index(next(title for title in columns if "F" in title))
    lines = path.read_text().splitlines()
    for k in range(1, len(lines)):
        fields = lines[k].split(",")
        fields[at] = '"12,34.5"'
        lines[k] = ",".join(fields)
    path.write_text("\n".join(lines))
    with pytest.raises(StudyError, match=r'Not used: .* \(line 2: "12,34.5" is no number\)'):
        create_study(tmp_path / "rig", [path])
