"""Effects of a user's own: they join the library, or are refused with file, line and reason."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.diagnosis.conclusion import lookalikes
from bristle.diagnosis.trials import joinable
from bristle.errors import PhysicsError
from bristle.fmu import catalogue
from bristle.identification.problem import REFERENCE, Problem, Run
from bristle.identification.start_grid import initial_guesses
from bristle.model.model import Model
from bristle.physics import damper
from bristle.physics.damper import DamperModel
from bristle.physics.effect import EFFECTS
from bristle.user_code import load
from bristle.user_code.conformance import usable
from bristle.user_code.templates import file_text


@pytest.fixture(autouse=True)
def library(tmp_path: Path) -> Iterator[None]:
    """Leave the library as it was."""
    before = set(EFFECTS)
    yield
    for file in tmp_path.rglob("*.py"):
        file.unlink()
    for folder in [tmp_path, *tmp_path.rglob("*/")]:
        load.load(folder)
    assert set(EFFECTS) == before


def written(folder: Path, name: str = "seal", **changes: str) -> Path:
    """Write the template's effect, some of its text replaced (old to new)."""
    text = file_text("effect", name)
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new)
    file = folder / f"{name}.py"
    file.write_text(text, encoding="utf-8")
    return file


def named(text: str, k: int) -> str:
    """Return a text about the effect seal as one about seal_k."""
    return re.sub(r'"seal"', f'"seal_{k}"', text).replace("class Seal", f"class Seal{k}")


def test_an_effect_joins_the_library_and_the_law(tmp_path: Path) -> None:
    written(tmp_path)
    (loaded,) = load.load(tmp_path)
    assert loaded.error == ""
    assert EFFECTS["seal"] is loaded.made
    assert load.own_effects() == {"seal": (tmp_path / "seal.py").resolve()}
    plain = DamperModel("lugre").force(0.0, 0.1, 0.0, 4.0, 0.002, 0.0, 0.0, False)
    model = DamperModel("lugre", {"seal.f_s": 1.5}, ["seal"])
    force = model.force(0.0, 0.1, 0.0, 4.0, 0.002, 0.0, 0.0, False)
    assert force - plain == pytest.approx(1.5, rel=1e-9)


def test_an_edited_file_replaces_its_effect_and_a_gone_one_takes_it_away(tmp_path: Path) -> None:
    file = written(tmp_path)
    first = load.load(tmp_path)[0].made
    assert load.load(tmp_path)[0].made is first
    written(tmp_path, **{"Parameter(0.2,": "Parameter(0.7,"})
    second = load.load(tmp_path)[0].made
    assert second is not first
    assert second is not None
    assert second.parameters["f_s"].value == 0.7
    file.unlink()
    assert load.load(tmp_path) == []
    assert "seal" not in EFFECTS
    assert "seal.f_s" not in damper.LIBRARY.slots.parameters


def test_of_two_folders_the_one_read_last_stays(tmp_path: Path) -> None:
    for name, value in (("one", "0.3"), ("two", "0.4")):
        (tmp_path / name).mkdir()
        written(tmp_path / name, **{"Parameter(0.2,": f"Parameter({value},"})
        load.load(tmp_path / name)
        assert EFFECTS["seal"].parameters["f_s"].value == float(value)


def test_stock_components_do_not_know_it_unless_they_are_told(tmp_path: Path) -> None:
    file = written(tmp_path)
    load.load(tmp_path)
    assert "seal.on" not in catalogue.describe("LuGreDamper").variables
    told = catalogue.describe("LuGreDamper", effects=[file]).variables
    assert told["seal.f_s"].unit == "N"


FORCE = "return p.f_s * tanh(q.v / p.v_s)"
BAD = [
    ({FORCE: "return p.f_s / q.v"}, "raises ZeroDivisionError", FORCE),
    ({FORCE: "return p.f_s * tanh(q.v / p.v_s) * float('nan')"}, "returns nan", "def force"),
    ({FORCE: "return 'strong'"}, "a number is right", "def force"),
    ({FORCE: "return p.f_s if q.v > 0.0 else -p.v_s"}, "jumps by 0.2", "def force"),
    ({FORCE: "return round(p.f_s, 1) * tanh(q.v / p.v_s)"}, "jumps by 0.1 with p.f_s", "def force"),
    ({FORCE: "return tanh(q.v / p.v_s)"}, "p.f_s moves nothing", "@staticmethod"),
    ({"from math import tanh": "from time import time as tanh"}, "time is imported", "from math"),
    ({"from math import tanh": "import random"}, "random is imported", "from math"),
    ({FORCE: "return open('x')"}, "open is not defined", FORCE),
    ({FORCE: "return p.f_s *"}, "this is no Python", FORCE),
    ({FORCE: "while True: pass"}, "a loop may not end", FORCE),
    ({FORCE: "p.f_s = 1.0"}, "changes nothing", FORCE),
    ({FORCE: "return [1.0][0]"}, "a hook knows numbers and tuples", FORCE),
    ({FORCE: "return q.v.__class__(1)"}, "__class__ has no place", FORCE),
    ({FORCE: "return p.f_s * q.x"}, 'add "x" to needs', FORCE),
    ({FORCE: "return p.f_s * q.colour"}, "q has no colour", FORCE),
    ({'name = "seal"': 'name = "stribeck"'}, "the name is taken by", "class Seal"),
    ({'name = "seal"': 'name = "other"'}, 'name = "seal" is right', "class Seal"),
    ({'sites = ("damper",)': 'sites = ("roof",)'}, "site 'roof'", "class Seal"),
    ({'"N"': '"Nm2"'}, "Nm2", "class Seal"),
    ({'"f_s"': '"on"', "p.f_s": "p.on"}, "cannot be named", "class Seal"),
    ({"class Seal(Effect)": "class Seal"}, "0 effects", ""),
    ({FORCE: "return p.f_s * tanh(q[0] / p.v_s)"}, 'reads q.x: add "x" to needs', "def force"),
    ({'needs = ("v",)': 'needs = ("v", "drift")'}, "needs ['drift']; at the site", "class Seal"),
    (
        {'sites = ("damper",)': 'sites = ("structure",)', "def force(": "def spring("},
        "spring reads q.v, which is 0 there; it may read dt, energy, halt", "def force",
    ),
    ({'amount = "f_s"': 'amout = "f_s"'}, 'nothing reads "amout": "amount"', 'amount = "f_s"'),
    ({'amount = "f_s"': 'amount = "v_s"'}, "no smaller at v_s = 1e-05 than", ""),
    ({"def force(": "def forces("}, 'nothing reads "forces": "force"', "def force"),
    ({'"m/s", (': '"mm/s", ('}, 'hooks compute in SI units; "m/s" is right', "class Seal"),
]  # fmt: skip


def test_bad_effects_are_left_out_with_file_line_and_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = file_text("effect", "seal").splitlines()
    files = {}
    for k, (changes, _, _) in enumerate(BAD, 1):  # one folder, which one process tries
        mine = {named(old, k): named(new, k) for old, new in changes.items()}
        files[written(tmp_path, f"seal_{k}", **mine)] = k
    before = set(EFFECTS)
    loaded = load.load(tmp_path)
    assert len(loaded) == len(BAD)
    assert set(EFFECTS) == before
    for one in loaded:
        k = files[one.path]
        _, says, at = BAD[k - 1]
        assert one.made is None
        assert named(says, k) in one.error
        assert one.error.count("\n") == 0
        line = next((n for n, row in enumerate(rows, 1) if at and at in row), 0)
        assert one.error.startswith(f"{one.path}, line {line}:" if line else f"{one.path}")
        assert load.why_left_out(one.path) == one.error
        assert main(["check", str(one.path)]) == 2
        assert named(says, k) in capsys.readouterr().err


def test_a_bad_effect_leaves_the_good_ones_in(tmp_path: Path) -> None:
    written(tmp_path)
    written(tmp_path, "leaking", **{FORCE: "return p.f_s / q.v"})
    (tmp_path / "no_text.py").write_bytes(b"\xff\xfe\x00")
    loaded = {one.name: one for one in load.load(tmp_path)}
    assert loaded["seal"].made is EFFECTS["seal"]
    assert "cannot be read" in loaded["no_text"].error
    assert "leaking" not in EFFECTS


def test_what_numba_refuses_is_left_out_too(tmp_path: Path) -> None:
    written(tmp_path, **{FORCE: "return float(str(p.f_s)) * tanh(q.v / p.v_s)"})
    loaded = load.load(tmp_path)
    assert loaded[0].made is not None  # Python runs it
    (checked,) = usable(loaded)
    assert checked.made is None
    assert "force cannot be compiled" in checked.error
    assert "seal" not in EFFECTS


@pytest.mark.parametrize(
    ("changes", "falls_short"),
    [
        ({FORCE: "return -p.f_s * tanh(q.v / p.v_s)"}, "a closed cycle gives no energy"),
        *(
            # Two seconds each: other promises that do not hold.
            pytest.param(changes, falls_short, marks=pytest.mark.slow)
            for changes, falls_short in (
                ({FORCE: "return p.f_s * (1.0 + tanh(q.v / p.v_s))"}, "no force at rest"),
                ({"Leaves out": "Lacks"}, "name, texts and source are complete"),
                ({"Parameter(0.2,": "Parameter(1e-6,"}, "changes the force by more than 1 %"),
            )
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_promise_that_does_not_hold_is_found(
    changes: dict[str, str], falls_short: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(written(tmp_path, **changes))]) == 2
    rows = [row for row in capsys.readouterr().out.splitlines() if row.startswith("FAIL")]
    assert len(rows) == 1
    assert falls_short in rows[0]


def test_one_file_is_loaded_by_name_or_refused(tmp_path: Path) -> None:
    assert load.load_file(written(tmp_path)).name == "seal"
    with pytest.raises(PhysicsError, match="there is no such file"):
        load.load_file(tmp_path / "gone.py")


SEARCHED = """    start_grid = {"v_s": (0.3, 1.0, 3.0)}
    start_ties = ("f_s",)
    family = "rubbing"
    lookalikes = {"gas_spring": "at one amplitude both hold the rod back"}
    mimics = ("force_bias",)

    @staticmethod
    def tie(p, sizes):
        return (0.05 * sizes.force,)

    @staticmethod
    def yield_share(p):
        return 1.1

    @staticmethod
    def force("""


def test_the_search_and_the_verdict_take_what_an_effect_says_of_itself(tmp_path: Path) -> None:
    written(tmp_path, **{"    @staticmethod\n    def force(": SEARCHED})
    (loaded,) = load.load(tmp_path)
    assert loaded.error == ""
    t = 0.002 * np.arange(2000)
    x, v = 0.01 * np.sin(6.0 * t), 0.06 * np.cos(6.0 * t)
    force, zero = 40.0 * v + np.sign(v), np.zeros_like(t)
    run = Run("run", 0.002, x, v, -0.36 * x, zero, force, 0.01, np.zeros((2, len(t), 4)))
    problem, base = Problem([run]), Model("bingham", (), {"f_c": 1.1})
    assert "seal" in joinable(base)
    found = initial_guesses("seal", base, problem)
    declared = EFFECTS["seal"].parameters["v_s"].value * problem.size("m/s") / REFERENCE["m/s"]
    begun = {round(model.value("seal.v_s") / declared, 6) for model in found}
    assert begun == {0.3, 1.0, 3.0}
    assert {model.value("seal.f_s") for model in found} == {0.05 * problem.size("N")}
    assert [model.value("f_c") for model in found] == pytest.approx([1.0] * len(found))
    assert list(lookalikes(("seal",))) == ["gas_spring"]


FIELDS = (
    "source", "expect", "needs", "parameters", "states", "passive", "start_grid", "mimics",
)  # fmt: skip
KINDS = ("7", "None", '("a", "b")', '{"a": 1}')
TIE = 'start_ties = ("f_s",)\n\n    @staticmethod\n    def tie(p, sizes):\n        return '
WRONG = [
    ('start_grid = {"v": (1.0,)}', "start_grid names"),
    ('start_grid = {"v_s": 1.0}', "a tuple of numbers"),
    ('start_limits = {"v_s": (1.0, 0.5)}', "start_limits"),
    ('start_ties = ("f_s",)', "tie(p, sizes)"),
    (f"{TIE}0.05 * sizes.force", "a tuple of 1"),
    (f"{TIE}(p.gone,)", "raises AttributeError"),
    ('mimics = ("late",)', "mimics names"),
    ('absorbed_by = "bearing"', "absorbed_by names"),
    ('offset = "v_s"', "a parameter in N is right"),
    ('offset = "f_s"', "all other parameters may be zero"),
    ('mass = "f_s"', "a parameter in kg is right"),
    ('faults = ("delay",)', "sensor's effect"),
    ('lookalikes = {"gas_spring": ""}', "a sentence for each"),
    *((f"{field} = {value}", field) for field in FIELDS for value in KINDS),
]


def test_what_an_effect_says_wrongly_of_itself_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = {}
    for k, (line, word) in enumerate(WRONG):
        place = "    @staticmethod\n    def force("
        words[written(tmp_path, f"seal_{k}", **{place: f"    {line}\n\n{place}"})] = word
    loaded = load.load(tmp_path)
    assert len(loaded) == len(WRONG)
    for one in loaded:
        assert one.made is None, one.path
        word = words[one.path]
        if word in ("needs", "mimics") and one.path.read_text().count('("a", "b")'):
            word = "'b'"  # it names what does not exist
        assert word in one.error
        assert main(["check", str(one.path)]) == 2
        assert capsys.readouterr().err.startswith("PhysicsError: ")
