"""Broken TOML files of every kind: the file, the line, what was found and what was expected."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from bristle.campaign import read_ensemble
from bristle.data.building_file import read_building
from bristle.errors import BristleError
from bristle.planning.bench import read_new_rig
from bristle.planning.folder import read_plan
from bristle.study import read_model
from bristle.study.study_file import read_settings
from bristle.synthesis import read_task
from bristle.system.scenario import load_scenario

FILES: dict[str, tuple[Callable[[Path], object], str]] = {
    "scenario.toml": (load_scenario, """schema = 1
[run]
stop = 0.5
step = 0.002
algorithm = "midpoint"
[components.voltage]
fmu = "ConstantVoltage"
parameters = { level = 4.0 }
"""),
    "ensemble.toml": (read_ensemble, """schema = 1
scenario = "half_sine_pulse"
engine = "compiled"
runs = 12
[vary]
"damper.sigma_a" = { normal = [650.0, 65.0], within = [500.0, 800.0] }
[outputs]
"damper.force" = ["peak", "rms"]
"""),
    "design.toml": (read_task, """schema = 1
kind = "lpv"
tau = 3.0
[weights]
command = { gain = 2.0, zero = 15.0, pole = 50.0 }
noise = 0.05
[damper]
law = "lugre"
parameters = { sigma_a = 700.0 }
[scheduling]
grid = [0.0, 0.1, 0.4]
"""),
    "study.toml": (read_settings, """schema = 1
title = "rig A"
rig = "bench"
cut_off = 18.0
[[runs]]
file = "run_1.csv"
role = "train"
[[runs]]
file = "run_2.csv"
role = "holdout"
correct = [{ channel = "force", fault = "gain", value = 1.25 }]
[channels.displacement]
column = "x [mm]"
[channels.force]
column = "F [N]"
unit = "N"
sign = -1
noise = 0.02
[extra.oil_pressure]
column = "p [bar]"
unit = "bar"
"""),
    "model.toml": (read_model, """schema = 1
law = "bingham"
[parameters.f_c]
value = 1.2
unit = "kN"
std = 0.01
free = true
origin = "identified"
[effects.gas_spring]
parameters = { k = { value = 81.2, unit = "N/m" } }
"""),
    "rig.toml": (read_new_rig, """schema = 1
[limits]
stroke = "20 mm"
speed = "200 mm/s"
command = ["0 V", "5 V"]
motions = ["sine"]
runs = 4
[damper]
max_force = "1.5 kN"
law = "lugre"
"""),
    "plan.toml": (lambda file: read_plan(file.parent), """schema = 1
rig = "bench"
rate = 100.0
[[runs]]
name = "plan_1"
file = "run_1.csv"
role = "train"
[[runs]]
name = "plan_2"
file = "run_2.csv"
"""),
    "building.toml": (read_building, """schema = 1
masses = [2.0, 1.0]
stiffnesses = [900.0, 1000.0]
rayleigh = { ratio = 0.02, modes = [1, 2] }
[[devices]]
name = "low"
between = ["ground", "base"]
"""),
}  # fmt: skip

# (file, what stands in it, what stands there instead, the line that is named, words)
BROKEN = [
    ("scenario", "[run]", "[runn]", 2, 'no key "runn". Did you mean "run"?'),
    ("scenario", "stop = 0.5\n", "", 2, "[run] stop is missing: expected a number above 0 s"),
    ("scenario", "stop = 0.5", 'stop = "0.5"', 3, 'the text "0.5", and a number needs no quotes'),
    ("scenario", "step = 0.002", "step = 0", 4, "[run] step = 0 s: expected a number above 0 s"),
    ("scenario", '"midpoint"', '"midpiont"', 5, 'no algorithm "midpiont". Did you mean'),
    ("scenario", '"midpoint"', "2", 5, "algorithm is 2: expected"),
    ("scenario", '"ConstantVoltage"', "4", 7, "fmu is 4: expected a text in quotes"),
    ("scenario", "parameters = {", "law = 4\nparameters = {", 8, "law is 4: expected a text"),
    ("scenario", "{ level = 4.0 }", "3", 8, "parameters is 3: expected a table"),
    ("scenario", "level", "levle", 8, 'no parameter "levle". Did you mean "level"?'),
    ("ensemble", "runs = 12", "runs = 0", 4, "runs = 0: expected a whole number of 1 to"),
    ("ensemble", "runs = 12", "runs = 2.5", 4, "runs is 2.5: expected a whole number"),
    ("ensemble", '"compiled"', '"gpu"', 3, 'no engine "gpu". There are: compiled, fmu.'),
    ("ensemble", 'scenario = "half_sine_pulse"', "", 0, "scenario is missing: expected"),
    ("ensemble", "[vary]", "[verify]", 5, 'no key "verify". Did you mean "vary"?'),
    ("ensemble", "normal", "gaussian", 6, 'no key "gaussian"'),
    ("ensemble", "[650.0, 65.0]", "650.0", 6, "normal is 650.0: expected a list"),
    ("ensemble", "[500.0, 800.0]", '["a"]', 6, "within holds more than numbers: expected"),
    ("ensemble", '["peak", "rms"]', '"peak"', 8, "expected a list of texts (peak, rms"),
    ("ensemble", '"rms"', '"rsm"', 8, 'no statistic "rsm". Did you mean "rms"?'),
    ("design", '"lpv"', '"lpw"', 2, 'no kind "lpw". Did you mean "lpv"?'),
    ("design", "tau = 3.0", "tua = 3.0", 3, 'no key "tua". Did you mean "tau"?'),
    ("design", "tau = 3.0", "tau = true", 3, "tau is true, not a number: expected a number"),
    ("design", "tau = 3.0", "tau = 0.5", 3, "tau = 0.5 must be at least 1"),
    ("design", "tau = 3.0", "order = 2.5", 3, "order is 2.5: expected a whole number"),
    ("design", "gain = 2.0, ", "", 5, "expected a weight, one of { corner, gain }"),
    ("design", "noise = 0.05", "noise = 0.0", 6, "[weights] noise = 0.0 makes the problem"),
    ("design", "700.0", '"stiff"', 9, 'sigma_a is the text "stiff", not a number: expected'),
    ("design", "[0.0, 0.1, 0.4]", '[0.0, "a"]', 11, 'grid holds the text "a": expected a list'),
    ("design", "[scheduling]\ngrid = [0.0, 0.1, 0.4]", "[lqg]", 10, 'no key "lqg"'),
    ("study", 'title = "rig A"', 'titel = "x"', 2, 'no key "titel". Did you mean "title"?'),
    ("study", 'title = "rig A"', "title = 5", 2, "title is 5: expected a text in quotes"),
    ("study", '"bench"', '"bensch"', 3, 'no rig "bensch". Did you mean "bench"?'),
    ("study", "cut_off = 18.0", "cut_off = -1", 4, "cut_off = -1 Hz: expected a number of 0 Hz"),
    ("study", '"holdout"', '"seen"', 10, 'no role "seen". There are: train, holdout'),
    ("study", "run_2.csv", "run_9.csv", 9, "there is no file"),
    ("study", "run_2.csv", "run_1.csv", 9, "listed twice"),
    ("study", 'file = "run_2.csv"\n', "", 8, "[[runs]] file is missing: expected"),
    ("study", '"gain"', '"gian"', 11, 'no fault "gian". Did you mean "gain"?'),
    ("study", "[channels.force]", "[channels.forse]", 14, 'Did you mean "force"?'),
    ("study", 'column = "F [N]"\n', "", 14, "[channels.force] column is missing: expected"),
    ("study", 'unit = "N"', 'unit = "mm"', 16, 'unit = "mm": expected N'),
    ("study", 'unit = "N"', 'unit = "Newt"', 16, 'unit "Newt" is not known'),
    ("study", "sign = -1", "sign = 0", 17, "sign = 0: expected 1 or -1"),
    ("study", "noise = 0.02", "noise = nan", 18, "noise is nan, not a finite number: expected"),
    ("study", 'column = "x [mm]"', 'column = "x [mm]"\nstep = 0.1', 14, "step belongs to"),
    ("study", "oil_pressure", "force", 19, 'cannot be called "force"'),
    ("study", 'unit = "bar"', "", 19, 'unit is missing: expected a text in quotes (that of the'),
    ("study", 'unit = "bar"', 'unit = "bar"\nnoise = 0.1', 22, 'no key "noise"'),
    ("model", 'law = "bingham"', "", 0, "law is missing: expected"),
    ("model", '"bingham"', '"binghm"', 2, 'no law "binghm". Did you mean "bingham"?'),
    ("model", "parameters.f_c", "parameters.f_z", 3, 'no parameter "f_z". Did you mean "f_'),
    ("model", "value = 1.2", 'value = "x"', 4, 'value is the text "x", not a number: expected'),
    ("model", "value = 1.2", "value = 900.0", 4, "f_c = 900 is outside 0 to 100 kN"),
    ("model", '"kN"', '"kg"', 5, "they differ in dimension"),
    ("model", "std = 0.01", "std = -1.0", 6, "std = -1: expected a number of 0 or more"),
    ("model", "free = true", "free = 1", 7, "free is 1: expected true or false"),
    ("model", '"identified"', '"guessed"', 8, 'no origin "guessed". There are: reconstructed'),
    ("model", "gas_spring", "gas_sprin", 9, 'no effect "gas_sprin". Did you mean'),
    ("model", '{ value = 81.2, unit = "N/m" }', "81.2", 10, "k is 81.2: expected { value = ... }"),
    ("rig", '"20 mm"', '"20 s"', 3, '"20 s": expected a number with its unit, such as "20 mm"'),
    ("rig", 'stroke = "20 mm"', 'strok = "20 mm"', 3, 'Did you mean "stroke"?'),
    ("rig", '"1.5 kN"', '"2 mm"', 9, "max_force"),
    ("rig", '["0 V", "5 V"]', '["0 V"]', 5, "command is a list of 1: expected a list of 2"),
    ("rig", '["sine"]', '["sin"]', 6, 'no motion "sin". Did you mean "sine"?'),
    ("rig", '["sine"]', "[]", 6, "motions is empty: expected a list"),
    ("rig", "runs = 4", 'runs = "4"', 7, 'runs is the text "4": expected a whole number'),
    ("rig", '"1.5 kN"', '"0 kN"', 9, 'max_force = the text "0 kN": expected more than 0 N'),
    ("rig", 'max_force = "1.5 kN"\n', "", 8, "[damper] lacks max_force: expected"),
    ("rig", '"lugre"', '"lugree"', 10, 'no law "lugree". Did you mean "lugre"?'),
    ("rig", 'law = "lugre"', 'law = "lugre"\n[noise]\nforce = "5 m"', 12, "expected a number with"),
    ("plan", 'rig = "bench"\n', "", 0, 'rig is missing: expected "bench" or "structure"'),
    ("plan", '"bench"', '"tower"', 2, 'no rig "tower". There are: bench, structure.'),
    ("plan", "rate = 100.0", "rate = -1.0", 3, "rate = -1: expected a number above 0"),
    ("plan", "rate = 100.0", "rate = 100.0\ncommand = 'speed'", 4, 'no command "speed"'),
    ("plan", "rate = 100.0", "rate = 100.0\nstudie = 'x'", 4, 'no key "studie". Did you mean'),
    ("plan", '"plan_2"', '"plan_1"', 9, "listed twice"),
    ("plan", '"plan_2"', '"../plan_2"', 9, "expected letters, digits"),
    ("plan", 'role = "train"', 'role = "test"', 7, 'no role "test". There are: train, holdout.'),
    ("plan", "run_2.csv", "../run_2.csv", 10, "expected a file beside plan.toml"),
    ("plan", "run_2.csv", "run_3.csv", 10, "there is no file"),
    ("building", "masses", "massses", 2, "unknown key 'massses'"),
    ("building", "[2.0, 1.0]", "2.0", 2, "masses must be a list of numbers"),
    ("building", "900.0", "-900.0", 3, "stiffnesses[0] = -900.0 must be positive"),
    ("building", "900.0, ", "", 2, "2 masses need as many stiffnesses, found 1"),
    ("building", "[1, 2]", "[1, 9]", 4, "rayleigh.modes must be two different numbers"),
    ("building", '"base"]', '"roof"]', 5, "there is no level 'roof'"),
]  # fmt: skip


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str | bytes], Path]:
    def writer(name: str, text: str | bytes) -> Path:
        for run in ("run_1.csv", "run_2.csv"):
            (tmp_path / run).write_text("time [s],displacement [mm]\n0,0\n", encoding="utf-8")
        path = tmp_path / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return writer


def told(name: str, path: Path) -> str:
    with pytest.raises(BristleError) as caught:
        FILES[name][0](path)
    assert caught.value.exit_code == 2
    return str(caught.value)


@pytest.mark.parametrize(("kind", "old", "new", "line", "words"), BROKEN)
def test_a_mistake_is_told_with_file_line_and_what_was_expected(
    write: Callable[..., Path], kind: str, old: str, new: str, line: int, words: str
) -> None:
    text = FILES[f"{kind}.toml"][1]
    assert old in text
    path = write(f"{kind}.toml", text.replace(old, new, 1))
    place = f"{path}:{line}: " if line else f"{path}: "
    lines = [one.strip() for one in told(f"{kind}.toml", path).splitlines()]
    assert any(one.startswith(place) and words in one for one in lines), lines


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize(
    ("change", "line", "words"),
    [
        (lambda text: text + "x = = 1\n", -1, "not TOML: Invalid value in column 5"),
        (lambda text: "schema = 1\n" + text, 2, '"schema" is written twice, first in line 1'),
        (lambda text: text.replace("schema = 1", "schema = 2"), 1, "schema is 2, of another"),
        (lambda text: text.replace("schema = 1", "schema = true"), 1, "schema is true, of another"),
        (lambda text: text.replace("schema = 1\n", ""), 0, "schema is missing: expected schema"),
        (lambda text: text.encode("utf-16"), 1, "is not UTF-8 text"),
        (lambda text: text + "a = " + "[" * 9000, 0, "nested too deeply"),
        (lambda text: text + "a = " + "9" * 9000, -1, "not TOML"),
        (lambda text: text + "#" * 5 * 1024**2, 0, "is larger than 4 MB"),
    ],
    ids=["syntax", "twice", "version", "true", "none", "UTF-16", "deep", "digits", "large"],
)
def test_what_is_no_file_of_ours_is_told_at_its_line(
    write: Callable[..., Path], name: str, change: Callable[[str], str | bytes], line: int,
    words: str,
) -> None:  # fmt: skip
    text = FILES[name][1]
    path = write(name, change(text))
    number = len(text.splitlines()) + 1 if line < 0 else line
    first = told(name, path).splitlines()[0]
    assert first.startswith(f"{path}:{number}: " if line else f"{path}: "), first
    assert words in first


@pytest.mark.parametrize("name", [name for name in FILES if name != "building.toml"])
def test_all_mistakes_are_told_at_once_in_the_order_of_the_file(
    write: Callable[..., Path], name: str
) -> None:
    text = FILES[name][1]
    path = write(name, text.replace("schema = 1", "schema = 1\nsecond = 2\nfirst = 1"))
    places = [line.strip().partition(": ")[0] for line in told(name, path).splitlines()]
    assert places[:2] == [f"{path}:2", f"{path}:3"]
