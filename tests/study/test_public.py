"""The API takes what a researcher has, answers the same for all of it, and shows its answers."""

from __future__ import annotations

import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made import bench_run, write_runs
from matplotlib.figure import Figure
from studies import house_study

import bristle
from bristle.core.finding import Finding
from bristle.data.measurement import read_measurements
from bristle.errors import (
    BristleError,
    DesignError,
    EnsembleError,
    RecordError,
    RunError,
    StudyError,
)
from bristle.model.equations import equations
from bristle.study.data_check import check_data

NAMED = {"time": "s", "displacement": "m", "velocity": "m/s", "force": "N", "voltage": "V"}


def arrays(seed: int) -> dict[str, np.ndarray]:
    """Return a run as channels in SI by their names."""
    factors = 1.0, 1e-3, 1e-3, 1.0, 1.0
    values = bench_run(seed).values()
    return {n: f * y for n, f, y in zip(NAMED, factors, values, strict=True)}


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> list[Path]:
    return write_runs(tmp_path_factory.mktemp("lab"), 3)


@pytest.fixture(scope="module")
def study(files, tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "rig"
    study = bristle.Study.create(folder, files, law="bingham", title="A <rig> & its model")
    bristle.identify(study)
    return study


@pytest.fixture(scope="module")
def found(files):
    return bristle.identify([files[0], files[2]], "bingham", holdout=files[1])


def values(found: bristle.Identified) -> dict[str, float]:
    return found.model.values


def test_files_frames_arrays_and_measurements_give_the_same(files, found, study):
    runs = [arrays(seed) for seed in (1, 2, 3)]
    titled = [
        {f"{name} [{unit}]": run[name] for name, unit in NAMED.items()} for run in runs
    ]  # fmt: skip
    kilo = [
        {**{n: y for n, y in run.items() if n != "force"}, "force [kN]": 1e-3 * run["force"]}
        for run in runs
    ]
    measured = read_measurements(files)
    frames = [pd.DataFrame(run) for run in titled]
    given = [
        (str(files[0].parent / "*.csv"), None),
        ([runs[0], runs[2]], runs[1]),
        ({"a": kilo[0], "b": kilo[2]}, {"c": kilo[1]}),
        ([frames[0], frames[2]], frames[1]),
        (tuple(measured), None),
    ]
    for data, holdout in given:
        other = bristle.identify(data, "bingham", holdout=holdout)
        assert values(other) == pytest.approx(values(found), rel=1e-4)
        assert other.after["z_holdout"] == pytest.approx(found.after["z_holdout"], rel=1e-3)
    assert study.model().values == pytest.approx(values(found), rel=1e-4)
    by_folder = bristle.identify(str(study.folder), write=False)
    assert values(by_folder) == pytest.approx(values(found), rel=1e-2)
    assert by_folder.step is None


def test_channels_are_told_or_guessed_and_guesses_are_told(files, found):
    assert any(note.startswith("guessed: force is") for note in found.notes)
    strange = {"a": 1e3 * arrays(1)["time"], "b": arrays(1)["velocity"], "c": -arrays(1)["force"]}
    channels = {"time": "a@ms", "velocity": "b@m/s", "force": "-c@N"}
    told = bristle.identify(strange, "bingham", channels=channels)
    plain = {name: arrays(1)[name] for name in ("time", "velocity", "force")}
    same = bristle.identify(plain, "bingham")
    assert values(told) == pytest.approx(values(same), rel=1e-6)
    assert not any("guessed" in note for note in told.notes)


def test_results_of_a_run_are_a_measurement():
    values = {"voltage.level": 0.0, "run.stop": 6.0}
    results = bristle.run("bench_sine_bingham", values, engine="fmu")
    found = bristle.identify(results, "bingham")
    assert any(note.startswith("guessed: force is") for note in found.notes)
    assert found.after["z_holdout"] < 2.0


def test_which_runs_are_held_out_is_said():
    runs = [arrays(seed) for seed in (1, 2, 3)]
    several = bristle.identify(runs, "bingham")
    assert several.notes[0] == "Every third run is held out: run 2. holdout=... names others."
    one = bristle.identify(runs[0], "bingham")
    assert "There is one run. It is split in time" in one.notes[0]


@pytest.mark.slow  # two diagnoses; by default of a building
def test_a_model_is_compared_and_diagnosed_without_a_study(files, found, study):
    compared = bristle.compare(files[1], found)
    assert compared.z == pytest.approx(found.after["z_holdout"], rel=0.1)
    assert compared.seen is None
    assert bristle.compare(files[1], "bingham").z > 2.0 * compared.z
    run = arrays(2)
    run["force"] = run["force"] + 200.0 * run["displacement"]
    stiff = bristle.compare(run, found)
    assert stiff.first is not None
    assert stiff.first.coordinate == "displacement"
    verdict = bristle.diagnose([files[0], files[2]], found, holdout=files[1])
    of_study = bristle.diagnose(study, write=False)
    assert (verdict.kind, verdict.effects) == (of_study.kind, of_study.effects)
    assert verdict.z_after == pytest.approx(of_study.z_after, rel=0.01)
    assert bristle.Study(study.folder).verdict() is None


def test_a_model_file_is_a_model(study, files):
    model = study.folder / "model.toml"
    by_file = bristle.compare(files[1], model)
    assert by_file.z == pytest.approx(bristle.compare(study).z, rel=0.1)


def test_a_building_needs_no_study(building_study):
    study = bristle.Study(building_study)
    runs = [str(path) for path in study.files("train")]
    held_out, house = str(study.files("holdout")[0]), study.folder / "house.toml"
    of_study = bristle.identify(study)
    found = bristle.identify(runs, "bingham", holdout=held_out, building=house)
    assert found.after == pytest.approx(of_study.after, rel=1e-6)
    assert found.at.site.name == "layer"  # the picture is of what errs the most
    compared = bristle.compare(held_out, found, train=runs, building=house)
    assert compared.site == bristle.compare(study).site == "layer"
    verdict = bristle.diagnose(runs, found, holdout=held_out, building=house)
    assert (verdict.kind, verdict.effects) == ("effect", ("duffing",))
    for shown in (found, compared, verdict):
        page = Page(shown._repr_html_())
        assert {"table", "img"} <= set(page.tags)
        assert isinstance(shown.plot(), Figure)


def test_a_buildings_channels_are_guessed_too(tmp_path):
    study = house_study(tmp_path)
    house = study.folder / "house.toml"
    frames = [pd.read_csv(path) for path in study.files()]
    other = [
        frame.rename(columns=lambda title: title.replace("base_", "base ")) for frame in frames
    ]
    runs, held_out = other[:2], other[2]
    found = bristle.identify(runs, "bingham", holdout=held_out, building=house)
    assert found.after == pytest.approx(bristle.identify(study).after, rel=1e-6)
    assert any(note.startswith("guessed: base_displacement is") for note in found.notes)


RUN = arrays(1)
SHORT = {name: y[:50] for name, y in RUN.items()}
WRONG = {
    "law": (lambda: bristle.identify(RUN, "lugr"), StudyError, 'Did you mean "lugre"'),
    "effect": (
        lambda: bristle.identify(RUN, "bingham", effects="gas_sprng"), StudyError, '"gas_spring"',
    ),
    "effect twice": (
        lambda: bristle.identify(RUN, "bingham", effects=["gas_spring"] * 2), StudyError, "already",
    ),
    "effects": (lambda: bristle.identify(RUN, effects=3), StudyError, "a list of names"),
    "a number": (lambda: bristle.identify(3), RecordError, "run is 3; a file, a pattern"),
    "numbers": (lambda: bristle.identify([3, 4]), RecordError, "run 1 is 3"),
    "a matrix": (lambda: bristle.diagnose(np.zeros((9, 3))), RecordError, "of the type ndarray"),
    "nothing": (lambda: bristle.identify([]), RecordError, "one run or more"),
    "no channel": (lambda: bristle.identify({}), RecordError, "no channel"),
    "no file": (lambda: bristle.identify("gone.csv"), RecordError, "there is no such file"),
    "no match": (lambda: bristle.identify("gone/*.csv"), RecordError, "of this pattern"),
    "a folder": (lambda: bristle.identify(str(Path(__file__).parent)), RecordError, "no study"),
    "NaN": (
        lambda: bristle.identify({**RUN, "force": np.full(3000, np.nan)}), RecordError, "no number",
    ),
    "infinite": (
        lambda: bristle.identify({**RUN, "force": RUN["force"] * np.inf}), RecordError, "inf",
    ),
    "no time": (
        lambda: bristle.identify({n: RUN[n] for n in ("velocity", "force")}), RecordError,
        r"no column is the time.*channels=",
    ),
    "no force": (
        lambda: bristle.identify({n: RUN[n] for n in ("time", "velocity")}), RecordError,
        "no force was measured",
    ),
    "no motion": (
        lambda: bristle.identify({n: RUN[n] for n in ("time", "force")}), RecordError,
        "neither displacement nor velocity",
    ),
    "a table": (
        lambda: bristle.identify({**RUN, "force": np.zeros((3000, 2))}), RecordError, "shape",
    ),
    "lengths": (
        lambda: bristle.identify({**RUN, "force": RUN["force"][1:]}), RecordError, "force 2999",
    ),
    "words": (lambda: bristle.identify({**RUN, "force": ["a"] * 3000}), RecordError, "no numbers"),
    "a mass": (
        lambda: bristle.identify({"time": RUN["time"], "force [kg]": RUN["force"]}), RecordError,
        "differ in dimension",
    ),
    "no unit": (
        lambda: bristle.identify({**RUN, "force [blub]": RUN["force"]}), RecordError,
        r'its unit is not known; "force \[N\]" is right',
    ),
    "short": (lambda: bristle.identify(SHORT), RecordError, "50 samples"),
    "channels": (lambda: bristle.identify(RUN, channels="force"), StudyError, "a mapping such as"),
    "a channel": (
        lambda: bristle.identify(RUN, channels={"forze": "force@N"}), StudyError, '"force"',
    ),
    "a column": (
        lambda: bristle.identify(RUN, channels={"time": "time@s", "force": "gone@N"}),
        RecordError, 'called "gone"',
    ),
    "a column's type": (
        lambda: bristle.identify(RUN, channels={"force": 3}), StudyError, "force is 3",
    ),
    "a model": (lambda: bristle.identify(RUN, 3), StudyError, "a model is 3"),
    "a model's file": (lambda: bristle.identify(RUN, "gone.toml"), StudyError, "no such file"),
    "no model": (lambda: bristle.compare(RUN), StudyError, "compare needs a model"),
    "role": (lambda: bristle.compare(RUN, "bingham", role="test"), StudyError, "train or holdout"),
    "twins": (lambda: bristle.identify(RUN, holdout=RUN), StudyError, "it tests nothing"),
    "building": (lambda: bristle.identify(RUN, building=3), StudyError, "a building's file"),
    "scenario": (lambda: bristle.run(3), RunError, "the scenario is 3"),
    "overrides": (lambda: bristle.run("no_damper", ["a"]), RunError, "a mapping such as"),
    "out": (lambda: bristle.run("no_damper", out=3), RunError, "a folder is right"),
    "results": (lambda: bristle.load_results(3), RunError, "takes a file or a folder"),
    "task": (lambda: bristle.design(3), DesignError, "a task, a design file"),
    "kind": (lambda: bristle.design({"kind": "pid"}), DesignError, "hinf, lpv, lqg"),
    "ensemble": (lambda: bristle.ensemble(3), EnsembleError, "takes a file"),
    "runs": (
        lambda: bristle.ensemble("el_centro_lpv_sensors", runs="a"), EnsembleError, "whole number",
    ),
    "workers": (
        lambda: bristle.ensemble("el_centro_lpv_sensors", workers=1.5), EnsembleError, "workers is",
    ),
    "study": (lambda: bristle.Study(3), StudyError, "a study is a folder"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_told(case):
    call, error, text = WRONG[case]
    with pytest.raises(error, match=text) as raised:
        call()
    assert isinstance(raised.value, BristleError)
    assert raised.value.exit_code == 2


def test_a_study_says_itself_what_its_files_say(study, files):
    with pytest.raises(StudyError, match=r"^holdout: study\.toml and model\.toml"):
        bristle.identify(study, holdout=files[0])
    with pytest.raises(StudyError, match=r"^channels, building: "):
        bristle.compare(study, channels={"force": "F@N"}, building="house.toml")
    with pytest.raises(StudyError, match="identify the other one first"):
        bristle.diagnose(study, "lugre")
    with pytest.raises(StudyError, match="no law"):
        bristle.identify(study, "lugr")


class Page(HTMLParser):
    """Counts tags, and refuses one that is closed out of turn."""

    VOID = ("img", "meta", "br", "hr")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in self.VOID:
            self.open.append(tag)
        elif tag == "img":
            assert str(dict(attrs)["src"]).startswith("data:image/png;base64,iVBOR")
            assert dict(attrs)["alt"]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def shown(found, study, files, tmp_path_factory):
    """Return one of each that a notebook shows."""
    run = arrays(2)
    run["force"] = run["force"] + 200.0 * run["displacement"]
    fresh = tmp_path_factory.mktemp("fresh") / "rig"
    fault = Finding(
        "gain", "warning", "The force is 5 % too large.", channel="force", value=1.05, std=0.01
    )
    nothing = bristle.Diagnosis("insufficient", (), "Too short.", sensors=(fault,))
    return {
        "results": bristle.run("bench_sine_bingham", {"run.stop": 0.2}),
        "identified": found,
        "with kilonewtons": replace(found, notes=("a < b & c",)),
        "comparison": bristle.compare(run, found),
        "diagnosis": bristle.diagnose([files[0], files[2]], "tanh", holdout=files[1]),
        "no verdict": nothing,
        "study": bristle.Study(study.folder),
        "data check": check_data(bristle.Study(study.folder)),
        "fresh study": bristle.Study.create(fresh, files, law="bingham"),
        "ensemble": bristle.ensemble("el_centro_damper_and_building", runs=3, workers=1),
        "lqg": bristle.design({"kind": "lqg"}),
        "hinf": bristle.design({"kind": "hinf"}),
    }


KINDS = (
    "results", "identified", "with kilonewtons", "comparison", "diagnosis", "no verdict", "study",
    "data check", "fresh study", "ensemble", "lqg", "hinf",
)  # fmt: skip


@pytest.fixture(scope="module")
def html(shown):
    """Return what a notebook shows of each."""
    return {kind: shown[kind]._repr_html_() for kind in KINDS}


@pytest.mark.parametrize("kind", KINDS)
def test_a_notebook_shows_a_table_and_a_picture(html, kind):
    page = Page(html[kind])
    assert page.open == []
    assert {"table", "img"} <= set(page.tags)
    assert "script" not in page.tags


def test_a_notebook_shows_the_equations_with_numbers(found, html):
    shown = html["identified"]
    assert shown.count('<div class="formula"><code>') == len(equations(found.model)) > 0
    assert "sgn(v)" in shown


@pytest.mark.parametrize("kind", KINDS)
def test_plot_returns_a_figure_that_nobody_else_holds(shown, kind):
    figure = shown[kind].plot()
    assert isinstance(figure, Figure)
    assert kind != "results" or figure._repr_png_().startswith(b"\x89PNG")
    if "matplotlib.pyplot" in sys.modules:
        assert sys.modules["matplotlib.pyplot"].get_fignums() == []
    if kind != "ensemble":  # its right column has one label for all, below
        for axes in figure.axes:  # what is drawn says what it is
            assert axes.get_title("left") or axes.get_xlabel() or axes.get_ylabel()


def test_names_of_a_user_are_escaped(html):
    assert "A &lt;rig&gt; &amp; its model" in html["study"]
    assert "a &lt; b &amp; c" in html["with kilonewtons"]


def test_what_is_made_of_results_is_a_plain_frame(shown):
    results = shown["results"]
    assert isinstance(results, pd.DataFrame)
    part = results[["damper.force"]]
    assert type(part) is pd.DataFrame
    assert part.attrs["units"]["damper.force"] == "N"
    assert type(results.loc[:0.1]) is pd.DataFrame
    assert float(results["damper.force"].abs().max()) > 1.0
