"""`bristle run X.ssp` says all that `bristle import-ssp X.ssp` says, and runs the same."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from described import component, port, write_fmu, write_scenario, write_ssp

import bristle
from bristle.cli import main
from bristle.system.scenario import load_scenario

STOP = '<d:DefaultExperiment startTime="0" stopTime="0.5"/>'
STEP = (
    '<d:DefaultExperiment startTime="0" stopTime="0.5"><d:Annotations><c:Annotation '
    'type="com.opensimulationplatform"><o:FixedStepAlgorithm xmlns:o="urn:o" '
    'baseStepSize="0.1"/></c:Annotation></d:Annotations></d:DefaultExperiment>'
)


def bound(values: str, mapping: str = "") -> str:
    return (
        "<d:ParameterBindings><d:ParameterBinding><d:ParameterValues><v:ParameterSet>"
        f"<v:Parameters>{values}</v:Parameters></v:ParameterSet></d:ParameterValues>{mapping}"
        "</d:ParameterBinding></d:ParameterBindings>"
    )


def value(name: str, number: float = 3.0) -> str:
    return f'<v:Parameter name="{name}"><v:Real value="{number}"/></v:Parameter>'


MAPPING = (
    '<d:ParameterMapping><m:ParameterMapping><m:MappingEntry source="a" target="gain"/>'
    '<m:MappingEntry source="c" target="offset"/></m:ParameterMapping></d:ParameterMapping>'
)
ASSUMED = ["The package names no step: 0.0005 s is taken."]
NOTES = {
    "nothing to say": (value("gain"), "", STEP, []),
    "a misspelt parameter": (value("gian"), "", STEP, ['nothing is called "gian": left aside.']),
    "a value for an output": (value("y"), "", STEP, ['"y" is output, which takes no value']),
    "a mapping of other names": (
        value("a") + value("b"), MAPPING, STEP,
        ['no parameter is called "c": left aside.', "the mapping does not name it: left aside."],
    ),
    "a connector of another kind": (
        "", "", STEP, ['calls the connector "u" output; in its FMU it is input.',
                       'calls the connector "u" Integer; in its FMU it is Real.'],
    ),
    "another variant": ("", "", STEP, ["B.ssd: is another variant and not read; System"]),
    "another form of FMU": ("", "", STEP, ['asks for "ModelExchange", and is run as co-sim']),
    "no step": (value("gain"), "", STOP, ASSUMED),
    "no stop": ("", "", "", ["The package names no stop: 1 s", "names no step: 0.001 s is taken"]),
    "a stop that is no whole number of steps": (
        "", "", STEP.replace("0.5", "0.55"), ["no whole number of steps: a step of 0.0916667 s"]
    ),
    "an algorithm that there is not": (
        "", "", STEP.replace("</d:Annotations>", '<c:Annotation type="bristle.run"><b:Run '
        'xmlns:b="urn:b" algorithm="newton"/></c:Annotation></d:Annotations>'),
        ['There is no algorithm "newton": gauss-seidel is taken.'],
    ),
}  # fmt: skip


@pytest.fixture
def gain(toys: dict[str, Path]) -> Path:
    return toys["Gain"]


@pytest.mark.parametrize("case", NOTES)
def test_run_check_and_import_say_the_same(
    case: str, gain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    values, mapping, experiment, notes = NOTES[case]
    inner = bound(values, mapping) if values else ""
    if "connector" in case:
        one = '<d:Connector name="u" kind="output"><c:Integer/></d:Connector>'
        inner = f"<d:Connectors>{one}</d:Connectors>"
    body = f"<d:Elements>{component('g', inner)}</d:Elements>"
    if "form" in case:
        body = body.replace("<d:Component ", '<d:Component implementation="ModelExchange" ')
    texts = {"B.ssd": "<a/>"} if "variant" in case else {}
    package = write_ssp(tmp_path / "my.ssp", body, {"g": gain}, more=experiment, texts=texts)
    for _ in range(2):  # what is in the cache says it as well
        out = str(tmp_path / "run")
        assert main(["run", str(package), "--no-figure", "--out", out]) == 0
        shown = capsys.readouterr().err.splitlines()
        said = [line.removeprefix("note: my.ssp: ") for line in shown if line.startswith("note")]
        log = Path(out, "log").read_text()
        assert all(f"note: my.ssp: {line}" in log for line in said)
    assert main(["check", "--json", str(package)]) == 0
    checked = json.loads(capsys.readouterr().out)["files"][0]["findings"]
    assert [(one["line"], one["level"]) for one in checked] == [(0, "note")] * len(said)
    assert [one["text"] for one in checked] == said
    command = ["import-ssp", str(package), "-o", str(tmp_path / "out")]
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["notes"] == said
    assert len(said) == len(notes)
    for line, words in zip(said, notes, strict=True):
        assert words in line


def test_what_an_override_sets_is_not_assumed(
    gain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    body = f"<d:Elements>{component('g', bound(value('gian')))}</d:Elements>"
    package = write_ssp(tmp_path / "my.ssp", body, {"g": gain})
    options = ["--no-figure", "--out", str(tmp_path / "run"), "--set", "run.step=0.1"]
    assert main(["run", str(package), *options]) == 0
    said = capsys.readouterr().err
    assert "names no stop: 1 s is taken" in said
    assert "names no step" not in said
    assert main(["run", str(package), *options, "--set", "run.stop=0.2"]) == 0
    said = capsys.readouterr().err
    assert "names no" not in said
    assert 'nothing is called "gian"' in said


def test_a_step_of_an_fmu_that_is_longer_than_the_run_is_not_taken(tmp_path: Path, capsys) -> None:
    fmu = write_fmu(tmp_path / "a.fmu", port(0, "y", "output"), experiment='stepSize="0.5"')
    body = f"<d:Elements>{component('a')}</d:Elements>"
    package = write_ssp(tmp_path / "my.ssp", body, {"a": fmu}, more=STOP.replace("0.5", "0.02"))
    assert main(["import-ssp", str(package), "-o", str(tmp_path / "out")]) == 0
    assert "names no step: 2e-05 s is taken" in capsys.readouterr().out


def test_a_text_that_nothing_feeds_is_held_at_its_start(
    toys: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    body = f"<d:Elements>{component('t')}</d:Elements>"
    package = write_ssp(tmp_path / "my.ssp", body, {"t": toys["Texts"]}, more=STEP)
    frame = bristle.run(package)
    assert frame["t.number"].iloc[-1] == len("nothing")
    assert main(["import-ssp", str(package), "-o", str(tmp_path / "out")]) == 0
    assert "check" not in capsys.readouterr().out
    scenario = load_scenario(tmp_path / "out" / "my.toml")
    assert scenario.components["t"].values == {"heard": "nothing"}
    assert scenario.findings == ()


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_inputs_of_all_types_are_held_and_those_without_a_start_are_told(
    version: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = "Integer" if version == "2.0" else "Int64"
    start = 'start="on"' if version == "2.0" else ""
    ports = [
        port(0, "x", "input", more='start="1.5"', version=version),
        port(1, "n", "input", whole, 'start="4"', version),
        port(2, "b", "input", "Boolean", 'start="true"', version),
        port(3, "s", "input", "String", start, version),
        port(4, "bare", "input", "Real", version=version).replace('start="0"', ""),
    ]
    fmu = write_fmu(tmp_path / "a.fmu", "".join(ports), version=version)
    body = f"<d:Elements>{component('a')}</d:Elements>"
    package = write_ssp(tmp_path / "my.ssp", body, {"a": fmu}, more=STEP)
    assert main(["import-ssp", str(package), "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert 'The input "a.bare" has neither source nor start value: 0.0 is taken.' in said
    found = load_scenario(tmp_path / "out" / "my.toml").components["a"].values
    assert found == {"x": 1.5, "n": 4, "b": True, "s": "on", "bare": 0.0}


def test_one_parameter_twice_in_a_set_is_refused(gain: Path, tmp_path: Path, capsys) -> None:
    body = f"<d:Elements>{component('g', bound(value('gain') + value('gain', 4.0)))}</d:Elements>"
    package = write_ssp(tmp_path / "my.ssp", body, {"g": gain}, more=STEP)
    assert main(["import-ssp", str(package), "-o", str(tmp_path / "out")]) == 2
    assert '<Parameter "gain">: stands twice in its set' in capsys.readouterr().err


def test_a_package_whose_scenario_has_a_mistake_is_written_and_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run speaks of the package; the lines of a file that nobody has are no help."""
    fmu = write_fmu(tmp_path / "a.fmu", port(0, "u", "input", more='max="1"'))
    inner = bound(value("u", 7.0))
    package = write_ssp(
        tmp_path / "my.ssp", f"<d:Elements>{component('a', inner)}</d:Elements>", {"a": fmu},
        more=STEP,
    )  # fmt: skip
    assert main(["import-ssp", str(package), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().out
    assert re.search(r"my\.toml:\d+: error: a\.u = 7 lies above 1", said)
    assert "Run it" not in said
    assert main(["run", str(package)]) == 2
    error = capsys.readouterr().err
    assert error == f"ScenarioError: {package}: a.u = 7 lies above 1; 1 or less is right.\n"


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize(
    ("experiment", "begins"),
    [('startTime="0.2" stopTime="1.2"', "0.2"), ('startTime="-5"', "-5"),
     ('startTime="1e3" stepSize="0.01"', "1e3"), ('startTime="now"', "now"),
     ('startTime="0.0" stopTime="1"', ""), ('stopTime="1"', ""), ("", "")],
)  # fmt: skip
def test_a_default_experiment_that_begins_elsewhere_is_told(
    experiment: str, begins: str, version: str, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    ports = port(0, "y", "output", version=version)
    fmu = write_fmu(tmp_path / "a.fmu", ports, experiment=experiment, version=version)
    scenario = write_scenario(tmp_path / "my.toml", {"a": (fmu, "")})
    body = f"<d:Elements>{component('a')}</d:Elements>"
    package = write_ssp(tmp_path / "my.ssp", body, {"a": fmu}, more=STEP)
    words = f"default experiment of its FMU begins at {begins} s; a run begins at 0 s."
    for file in (scenario, package):
        assert main(["check", str(file)]) == 0
        assert (words in capsys.readouterr().out) == bool(begins)
    assert main(["import-ssp", str(package), "-o", str(tmp_path / "out")]) == 0
    assert (words in capsys.readouterr().out) == bool(begins)
