"""The report of a study: one HTML file that is whole, says what the study holds, and stays put."""

from __future__ import annotations

import base64
import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest
from made import write_runs

from bristle.cli import main
from bristle.core.text import with_interval
from bristle.model.model import Fact, Model
from bristle.report.study_page import curves_section, gather, parameter_table, render
from bristle.study import Study, create_study

VALUES = {"f_c": 1.3, "f_v": 0.8, "c_0": 20.0, "c_v": 0.01, "v_n": 5.0, "exponent": 0.0}
VOID = {"meta", "img", "br", "hr", "link", "input"}
VERDICT = {
    "schema": 2,
    "kind": "ambiguous",
    "effects": ["stribeck", "flattening"],
    "ranking": [
        {"effect": "stribeck", "z_holdout": 1.041, "gain": 0.21},
        {"effect": "presliding", "z_holdout": 1.3, "gain": 0.004},
    ],
    "z_holdout_before": 1.31,
    "noise_floor": {"displacement": 4.2e-5, "force": 0.05},
    "untestable": ["temperature"],
    "detectable": 0.02,
    "coordinate": "",
    "sensors": [{"channel": "velocity", "fault": "gain", "value": 1.05}],
    "separate_by": "A sine of 12 mm at 3 Hz & 6 V tells the two apart.",
    "words": "",
}


class Checker(HTMLParser):
    """Raises where tags are not closed in order; keeps what the page refers to."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.seen: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        self.links += [value for name, value in attrs if name in ("src", "href", "srcset")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag, f"</{tag}> out of order"


def checked(page: str) -> Checker:
    checker = Checker()
    checker.feed(page)
    checker.close()
    assert not checker.open
    return checker


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Return a study with three steps, the last of which adds an effect."""
    root = tmp_path_factory.mktemp("report")
    files = write_runs(root / "lab", 4, seconds=6.0)
    study = create_study(root / "rig", files, law="bingham", title='Rig "2" <b>& more</b>').study
    toml = root / "rig" / "study.toml"
    text = toml.read_text().replace('notes = ""', 'notes = "Oil from March <i>.\\nSecond line."')
    toml.write_text(text)
    study = Study(study.folder)
    model = study.model().with_values(VALUES, {"f_c": 0.01, "c_0": 0.2})
    study.add_step(
        "identify bingham", "fit to 3 training runs", model, {"z_holdout": 90.0},
        {"z_train": 4.1, "z_holdout": 4.3, "error_holdout": 0.4, "error_share_holdout": 0.08},
    )  # fmt: skip
    more = model.with_effect("gas_spring").with_values({"gas_spring.k": 1.0}, {"gas_spring.k": 0.5})
    study.add_step(
        "add gas_spring", "verdict: effect", more, {"z_holdout": 4.3},
        {"z_train": 1.5, "z_holdout": 1.6, "error_holdout": 0.2, "error_share_holdout": 0.04},
    )  # fmt: skip
    study.write_verdict(VERDICT)
    return study.folder


@pytest.fixture(scope="module")
def page(folder) -> str:
    return render(gather(Study(folder)))


def text_of(page: str) -> str:
    body = re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", body))


def test_the_page_is_well_formed_and_needs_nothing_else(page):
    checker = checked(page)
    assert page.startswith("<!DOCTYPE html>")
    assert "http" not in page
    assert "//" not in re.sub(r"data:image/png;base64,[A-Za-z0-9+/=]+", "", page)
    assert "script" not in checker.seen
    assert checker.links
    assert all(link.startswith("data:image/png;base64,") for link in checker.links)
    assert "@import" not in page
    assert "url(" not in page
    images = re.findall(r"<img [^>]+>", page)
    assert len(images) == 4  # evidence, staircase, loops, error
    assert any("8.0 % \u2192 4.0 %" in image for image in images)
    assert all(re.search(r'alt="[^"]{10,}"', image) for image in images)


def test_what_the_lab_wrote_is_text_and_no_markup(page):
    assert "Rig &quot;2&quot; &lt;b&gt;&amp; more&lt;/b&gt;" in page
    assert "Oil from March &lt;i&gt;.\nSecond line." in page


def test_the_page_says_what_the_study_holds(page, folder):
    text = text_of(page)
    assert (
        "Missing from the model: Stribeck effect or flattening. These runs cannot tell them apart."
        in text
    )
    assert "A sine of 12 mm at 3 Hz &amp; 6 V tells the two apart." in text
    assert "Sensor: gain of velocity, 1.05." in text
    assert "displacement 42 µm" in text
    for name in Study(folder).model().values:
        assert f" {name} " in text
    assert "1.300 ± 0.020 N identified" in text
    for run in Study(folder).settings.runs:
        assert run.file in text
    assert "the force declines through a run" in text  # what temperature would look like
    assert "bristle add rig_again gas_spring" in text
    for z in ("4.30", "1.60", "1.041"):
        assert z in text


def test_the_sentences_are_those_of_the_comparison(page, folder):
    content = gather(Study(folder))
    assert content.added == "gas spring"
    assert content.before is not None
    text = text_of(page)
    for sentence in content.now.sentences:
        assert sentence.replace("'", "&#x27;").replace(">", "&gt;") in text


def test_a_new_study_has_a_report_too(tmp_path):
    files = write_runs(tmp_path / "lab", 3, seconds=4.0)
    study = create_study(tmp_path / "fresh", files, law="bingham").study
    page = render(gather(study))
    checked(page)
    text = text_of(page)
    assert "No diagnosis has been made of the present model." in text
    assert "bristle diagnose fresh" in text
    assert "begin with bingham" in text


def test_a_single_run_is_said_to_be_weaker(tmp_path):
    files = write_runs(tmp_path / "lab", 1, seconds=8.0)
    page = render(gather(create_study(tmp_path / "one", files, law="bingham").study))
    checked(page)
    assert "weaker than a separate run" in text_of(page)


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        (
            {"kind": "none", "detectable": 0.031},
            "No other effect of the library is above 3.1 % of the force",
        ),
        ({"kind": "effect", "effects": ["gas_spring"]}, "Missing from the model: gas spring"),
        ({"kind": "effect", "effects": ["mine"]}, "mine is an effect of the user&#x27;s own"),
    ],
)
def test_every_kind_of_verdict_is_told(folder, verdict, words):
    from dataclasses import replace

    content = replace(gather(Study(folder)), verdict=verdict, now=None, before=None)
    page = render(content)
    checked(page)
    assert words in text_of(page)


def test_a_verdict_that_is_stale_is_told_to_be_so(folder):
    from dataclasses import replace

    content = replace(gather(Study(folder)), now=None, before=None, notes=("One run.",))
    notes = ["The data are no longer those of this verdict.", "One run."]
    page = render(replace(content, verdict={**VERDICT, "notes": notes}))
    assert notes[0] in text_of(page)
    assert text_of(page).count(notes[1]) == 1


def test_the_command_writes_the_page_and_says_where(folder, tmp_path, capsys):
    other = tmp_path / "elsewhere.html"
    assert main(["report", str(folder), "--out", str(other), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["report"] == str(other)
    assert answer["verdict"] == "ambiguous"
    assert answer["z_holdout"] > 0.0
    checked(other.read_text())
    assert "Stribeck effect or flattening" in text_of(other.read_text())


def test_a_folder_that_is_no_study_is_refused(tmp_path, capsys):
    assert main(["report", str(tmp_path / "nothing")]) == 2
    assert "no study" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("value", "std", "told"),
    [
        (12.3456, 0.5, ("12.35", "± 0.98")),
        (0.018412, 1.6e-5, ("0.018412", "± 0.000031")),
        (1319.0, 52.0, ("1320", "± 100")),
        (340755.0, 1633.0, ("340.8 \u00d7 10³", "± 3.2 \u00d7 10³")),
        (-13.2, 12.8, ("\u221213", "± 25")),
        (1.0, None, ("1", "-")),
    ],
)
def test_values_have_the_digits_that_their_intervals_leave(value, std, told):
    assert with_interval(value, std) == told


@pytest.mark.parametrize(
    ("value", "low", "told"),
    [(721.0, 0.0, False), (0.0, 0.0, True), (1e9, 0.0, True), (1e-4, 0.0, True)],
)
def test_a_value_is_at_the_edge_only_where_it_stands_at_a_bound(value, low, told):
    model = Model("lugre").with_facts({"sigma_a": Fact(value, "N/m", low, 1e9, std=0.9)})
    _, _, notes = parameter_table(model, "voltage")
    assert any("at a bound" in note for note in notes) is told


def test_what_was_learned_is_shown_with_its_picture_and_what_its_formula_leaves(folder, tmp_path):
    study = Study(shutil.copytree(folder, tmp_path / "rig"))
    told = {
        "sentences": ["learned_1 is an added force along displacement.", "It is <nearly> a line."],
        "forms": [{"name": "line", "formula": "c + m s", "values": [0.0, 3.0], "left": 0.042}],
    }
    study.write_report("learned_1.json", json.dumps(told))
    study.write_report("learned_1.png", b"\x89PNG of a curve")
    # Without the effect's file it is gone, and so is what was said of it.
    assert curves_section(study, ()) == ""
    (study.effects_folder / "learned_1.py").write_text("")
    section = curves_section(study, ())
    checked(section)
    assert base64.b64encode(b"\x89PNG of a curve").decode() in section
    said = text_of(section)
    for text in ("It is &lt;nearly&gt; a line.", "g = c + m s", "4 %", "bristle add rig learned_1"):
        assert text in said
    assert "bristle add" not in curves_section(study, ("learned_1",))
    study.write_report("learned_1.json", '{"sentences": ["half a file"]}')
    assert "reports/learned_1.json cannot be read" in text_of(curves_section(study, ("learned_1",)))
