"""Laws of a user's own: they join the library, or are refused with file, line and reason."""

from __future__ import annotations

import json
import re
from math import tanh
from pathlib import Path

import pytest

from bristle.cli import main
from bristle.errors import BuildError, PhysicsError
from bristle.fmu import build, catalogue
from bristle.fmu.controller import invertible
from bristle.identification.histories import DamperForces
from bristle.physics import damper
from bristle.physics.command import Monotone
from bristle.physics.effect import EFFECTS, effects_of
from bristle.physics.law import LAWS, Law
from bristle.physics.laws import law_names
from bristle.physics.parameter import Parameter, Table
from bristle.user_code import load, trial
from bristle.user_code.conformance import usable
from bristle.user_code.templates import file_text

YIELDING = "return p.yield_force * tanh(q.v / p.v_s)"
VISCOUS = "return p.c * q.v"


def written(folder: Path, name: str = "rubbing", **changes: str) -> Path:
    """Write the template's law, some of its text replaced (old to new)."""
    text = file_text("law", name)
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{name}.py"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_law_joins_the_library_with_its_effects(tmp_path: Path) -> None:
    written(tmp_path)
    (loaded,) = usable(load.load(tmp_path, "law"))
    assert loaded.error == ""
    assert LAWS["rubbing"] is loaded.made
    assert "rubbing" in law_names()
    assert load.own_laws() == {"rubbing": (tmp_path / "rubbing.py").resolve()}
    force = damper.DamperModel("rubbing").force(0.004, 0.03, 0.0, 4.0, 0.002, 0.0, 0.0, False)
    assert force == pytest.approx((1.3 + 0.83 * 4.0) * tanh(1.5) + 15.0 * 0.03 + 60.0 * 0.004)
    joined = {effect.name for effect in effects_of("damper", "rubbing")}
    assert "stribeck" in joined
    assert "gas_spring" not in joined, "the law says that it contains a spring"
    assert "rubbing" not in [law.name for law in invertible()], "stock controllers do not know it"
    (tmp_path / "rubbing.py").unlink()
    assert load.load(tmp_path, "law") == []
    assert "rubbing" not in LAWS


NAN = {YIELDING: "return p.yield_force * tanh(q.v / p.v_s) * float('nan')"}
BAD = [
    (NAN, "yielding returns nan", "def yielding"),
    ({YIELDING: "return p.yield_force / (q.v - 0.03)"}, "ZeroDivisionError", YIELDING),
    (
        {YIELDING: "return p.yield_force * (q.v / p.v_s if q.v > 0.0 else -1.0)"},
        "yielding jumps by",
        "def yielding",
    ),
    ({VISCOUS: "return -9.0 * p.c * q.v"}, "it creates energy: a closed cycle", ""),
    # The yield force outweighs it until a fit lets that go to its bound.
    ({VISCOUS: "return -p.c * q.v"}, "0 V, where f_c = 0, gives", ""),
    ({"Parameter(1.3,": "Parameter(10**400,"}, "a dictionary such as", "class Rubbing"),
    ({"Parameter(1.3,": "Parameter(10**5000,"}, "a dict that cannot be written", "class Rubbing"),
    ({"from math import tanh": "import socket"}, "socket is imported", "from math"),
    (
        {"from math import tanh": "from urllib.request import urlopen as tanh"},
        "without clock, chance, file or network",
        "from math",
    ),
    ({'"viscous", "spring")': '"viscous", "charm")'}, "charm", "class Rubbing"),
    ({'name = "rubbing"': 'name = "lugre"'}, "the name is taken by", "class Rubbing"),
    ({'name = "rubbing"': 'name = "other"'}, 'name = "rubbing" is right', "class Rubbing"),
    ({'source = "Gavin': 'source = 7 # "Gavin'}, "source = 7; a text in quotes is right", "class"),
    ({'contains = ("spring",)': "contains = 3"}, "contains = 3; a tuple of texts", "class Rubbing"),
    ({VISCOUS: "return p.c * q.drift"}, "q has no drift", VISCOUS),
    ({VISCOUS: "return 15.0 * q.v"}, "p.c moves nothing", "@staticmethod"),
    ({VISCOUS: "return (p.c, q.v)"}, "a number is right", "def viscous"),
    ({'"c": ': '"stroke": ', "p.c ": "p.stroke "}, "cannot be named", "class Rubbing"),
    ({'Linear("f_c", "f_v")}': 'Linear("f_c", "f_w")}'}, "f_w", "class Rubbing"),
    ({"Shape(0.02, 5.0, 9,": "Shape(5.0, 0.02, 9,"}, "shapes = ", "class Rubbing"),
    (
        {'shapes = {"v_s": Shape(0.02, 5.0, 9, ("f_c", "f_v"))}': "assumed = ()"},
        "not linear in v_s, for it cannot be zero", YIELDING,
    ),
    ({"contains = ": "contain = "}, 'nothing reads "contain": "contains"', "contains = "),
]  # fmt: skip


def named(text: str, k: int) -> str:
    """Return a text about the law rubbing as one about rubbing_k."""
    return text.replace('"rubbing"', f'"rubbing_{k}"')


def test_bad_laws_are_left_out_with_file_line_and_reason(tmp_path: Path) -> None:
    rows = file_text("law", "rubbing").splitlines()
    files = {}
    for k, (changes, _, _) in enumerate(BAD):  # one folder, which one process tries
        mine = {named(old, k): named(new, k) for old, new in changes.items()}
        files[written(tmp_path, f"rubbing_{k}", **mine)] = k
    before = dict(LAWS)
    loaded = load.load(tmp_path, "law")
    assert len(loaded) == len(BAD)
    assert before == LAWS
    for one in loaded:
        _, says, at = BAD[files[one.path]]
        assert one.made is None
        assert named(says, files[one.path]) in one.error
        assert one.error.count("\n") == 0
        line = next(n for n, row in enumerate(rows, 1) if at in row)
        assert one.error.startswith(f"{one.path}, line {line}:" if at else str(one.path))


@pytest.mark.slow  # waits for the time limit
def test_a_hook_that_does_not_end_is_refused_within_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial, "SECONDS", 3.0)
    endless = "return p.c * q.v + 0.0 * float(10 ** (10 ** int(10.0 + q.v)) % 7)"
    file = written(tmp_path, **{VISCOUS: endless})
    written(tmp_path, "sound")
    loaded = {one.name: one for one in load.load(tmp_path, "law")}
    assert "does not end within" in loaded["rubbing"].error
    line = next(k for k, row in enumerate(file.read_text().splitlines(), 1) if endless in row)
    assert f", line {line}:" in loaded["rubbing"].error
    assert loaded["sound"].law is LAWS["sound"], "the files beside it are read all the same"


def test_an_effect_whose_parts_no_law_has_is_refused(tmp_path: Path) -> None:
    parts = '    acts_on = ("sign", "bristle")\n    passive'
    text = file_text("effect", "seal").replace("    passive", parts, 1)
    (tmp_path / "seal.py").write_text(text, encoding="utf-8")
    (loaded,) = load.load(tmp_path)
    assert "no law has the parts that it acts on (sign, bristle)" in loaded.error
    (tmp_path / "seal.py").write_text(text.replace('"bristle"', '"charm"'), encoding="utf-8")
    (loaded,) = load.load(tmp_path)
    assert "acts_on ['charm']" in loaded.error


OWN = '''"""A coefficient of my own law, by the label oil of the runs."""

from bristle.physics.effect import Effect, Parameter


class Thinner(Effect):
    """The coefficient depends on the oil."""

    name = "thinner"
    sites = ("damper",)
    needs = ("value",)
    changes = "c_own"
    passive = True
    source = expect = "-"
    assumed = ("oil",)
    labels = {"oil": "oil"}
    parameters = {
        "slope": Parameter(2.0, "N.s/m", (-9.0, 9.0), "per unit"),
        "oil": Parameter(1.0, "1", (0.0, 9.0), "of the run"),
    }

    @staticmethod
    def changed(q, z, p):
        return q.value + p.slope * p.oil
'''


def test_an_effect_may_change_a_parameter_that_only_an_own_law_has(tmp_path: Path) -> None:
    effects, laws = tmp_path / "effects", tmp_path / "laws"
    effects.mkdir()
    (effects / "thinner.py").write_text(OWN, encoding="utf-8")
    (loaded,) = load.load(effects)
    assert loaded.error.endswith('no law has "c_own", which it changes: it would join none.')
    written(laws, **{VISCOUS: "return p.c_own * q.v", '"c": Parameter': '"c_own": Parameter'})
    load.load(laws, "law")
    (effects / "thinner.py").write_text(OWN.replace("2.0", "3.0"), encoding="utf-8")
    (loaded,) = load.load(effects)
    assert loaded.error == ""
    own = damper.DamperModel("rubbing", {}, ["thinner"])
    plain = damper.DamperModel("rubbing", {}, [])
    forces = [one.force(0.0, 0.03, 0.0, 0.0, 0.002, 0.0, 0.0, False) for one in (own, plain)]
    assert forces[0] - forces[1] == pytest.approx(3.0 * 0.03)


@pytest.mark.parametrize("gap", ["0.012", "0.5", "1e-5"])
def test_what_begins_behind_a_knot_moves_something(gap: str, tmp_path: Path) -> None:
    text = file_text("effect", "stop").replace("from math import tanh\n\n", "")
    text = text.replace(
        '"v_s": Parameter(2e-3, "m/s", (1e-5, 1.0), "speed over which it builds up")',
        f'"gap": Parameter({gap}, "m", (1e-6, 1.0), "free travel")',
    )
    text = text.replace('needs = ("v",)', 'needs = ("x",)').replace('"f_s"', '"k"')
    text = text.replace('Parameter(0.2, "N", (0.0, 1e5)', 'Parameter(2e3, "N/m", (0.0, 1e7)')
    push = "p.k * (max(q.x - p.gap, 0.0) + min(q.x + p.gap, 0.0))"
    text = text.replace("p.f_s * tanh(q.v / p.v_s)", push)
    (tmp_path / "stop.py").write_text(text, encoding="utf-8")
    (loaded,) = load.load(tmp_path)
    assert loaded.error == ""
    assert loaded.made is EFFECTS["stop"]


@pytest.mark.parametrize("bounds", [(-1.0, 5.0), (0.0, 5.0)])
def test_a_table_over_the_command_that_may_fall_is_refused(bounds: tuple[float, float]) -> None:
    def define() -> None:
        class Stepped(Law):
            """Stepped: a yield force from a table over the voltage."""

            name = "stepped"
            parts = ("yield",)
            source = "made for this test, 2026"
            parameters = {"v_s": Parameter(0.02, "m/s", (1e-4, 1.0), "speed")}  # noqa: RUF012
            tables = {  # noqa: RUF012
                "curve": Table((0.0, 4.0, 8.0), (1.0, 2.0, 1.5), "N", bounds, "yield force")
            }
            command = {"yield_force": Monotone("curve")}  # noqa: RUF012

            @staticmethod
            def yielding(q, z, p):
                return p.yield_force * tanh(q.v / p.v_s)

    if bounds[0] < 0.0:
        with pytest.raises(PhysicsError, match="the table curve over the command is not monotone"):
            define()
        assert "stepped" not in LAWS
        return
    define()
    try:
        p = [LAWS["stepped"].at({}, V).yield_force for V in (0.0, 2.0, 4.0, 8.0, 20.0)]
        assert p == [1.0, 2.0, 3.0, 4.5, 4.5]
    finally:
        del LAWS["stepped"]


def test_the_command_starts_checks_and_lists(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "law", "my_damper"]) == 0
    assert "bristle check my_damper.py" in capsys.readouterr().out
    assert main(["new", "law", "my_damper"]) == 2
    assert main(["new", "law", "lugre"]) == 2
    assert "is taken in the library" in capsys.readouterr().err
    assert main(["check", "my_damper.py"]) == 0
    said = capsys.readouterr().out
    assert "my_damper conforms" in said
    assert "FAIL" not in said
    load.unload_effects()
    assert main(["list", "laws", "--json"]) == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    assert set(rows) == {law.name for law in LAWS.values() if law.site == "damper"}
    assert rows["modified_bouc_wen"]["contains"] == ["spring"]
    assert main(["list", "laws", "dahl"]) == 0
    said = capsys.readouterr().out
    assert "Parts: yield, bristle, viscous, command." in said
    assert re.search(r"rho +500 +1/m ", said)
    assert max(map(len, said.splitlines())) <= 100
    assert "Effects that join it: asymmetry, " in said
    assert main(["list", "laws", "dal"]) == 2
    assert 'Did you mean "dahl"?' in capsys.readouterr().err


@pytest.mark.slow  # 2 s: of an effect it is found by default
def test_a_promise_that_does_not_hold_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path, **{"Gavin (2001)": "Gavin", ", 1281-1300": ""})
    assert main(["check", str(file)]) == 2
    assert "lacks a source with its year" in capsys.readouterr().out


def test_its_damper_is_an_fmu_that_carries_the_law(tmp_path: Path) -> None:
    with pytest.raises(BuildError, match="is a damper of the law rubbing"):
        catalogue.component_of_law("rubbing")
    load.load_file(written(tmp_path), "law")
    name = catalogue.component_of_law("rubbing")
    assert name == "OwnRubbingDamper"
    assert catalogue.describe(name).variables["f_c"].unit == "N"
    plan = build.plan(name, name="Mine", starts={"f_c": 2.0})
    assert plan.laws == ((tmp_path / "rubbing.py").resolve(),)
    assert build.plan("LuGreDamper").laws == ()
    path = build.build(plan, tmp_path / "fmus")
    from fmpy import read_model_description

    variables = {v.name: v for v in read_model_description(str(path)).modelVariables}
    assert float(variables["f_c"].start) == 2.0
    assert "stribeck.on" in variables


def test_the_component_of_a_law_is_no_file_that_others_rewrite(tmp_path: Path) -> None:
    load.load_file(written(tmp_path / "mine"), "law")
    mine = catalogue.source("OwnRubbingDamper")
    text = mine.read_text(encoding="utf-8")
    first_line = text.split('    """')[1].splitlines()[0].rstrip('"')
    load.load_file(written(tmp_path / "theirs", **{first_line: "Another law of that name."}), "law")
    theirs = catalogue.source("OwnRubbingDamper")
    assert "Another law of that name." in theirs.read_text(encoding="utf-8")
    assert mine.read_text(encoding="utf-8") == text, "the other project reads its own file"


def test_the_component_of_a_law_is_written_beside_and_put_in_place(tmp_path: Path) -> None:
    load.load_file(written(tmp_path), "law")
    file = catalogue.source("OwnRubbingDamper")
    text = file.read_text(encoding="utf-8")
    file.write_text("half of it", encoding="utf-8")
    (tmp_path / "read").hardlink_to(file)  # sees what is written in place, and no replacement
    assert catalogue.source("OwnRubbingDamper").read_text(encoding="utf-8") == text
    assert (tmp_path / "read").read_text(encoding="utf-8") == "half of it"


def test_compiled_it_is_what_python_gives(tmp_path: Path) -> None:
    import numpy as np

    load.load_file(written(tmp_path), "law")
    t = 0.002 * np.arange(100)
    x, v = 0.006 * np.sin(9.0 * t), 0.054 * np.cos(9.0 * t)
    force = DamperForces("rubbing", []).force(x, v, 0.0 * v, 4.0 + 0.0 * v, 0.002, {})
    expected = 4.62 * np.tanh(v / 0.02) + 15.0 * v + 60.0 * x
    np.testing.assert_allclose(force, expected, rtol=1e-12, atol=1e-12)
