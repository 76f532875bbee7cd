"""Effects and laws of a user's own run natively with the same numbers; slots do not mix."""

from __future__ import annotations

from pathlib import Path

import pytest
from both_forms import Both, Native, folder, needs_zig

from bristle.cli import main
from bristle.fmu.build import BuildPlan, plan
from bristle.native.build import build
from bristle.native.entrance import component_of, prepare
from bristle.native.zig import here
from bristle.user_code.load import load_file

pytestmark = [needs_zig, pytest.mark.slow]  # dampers with own laws and effects are compiled


def difference(what: BuildPlan, **values: object) -> float:
    """Return the largest difference between both forms of what is planned."""
    pair = Both(Native(build(what, folder() / "own", [here()])), component_of(what), **values)
    pair.begin()
    found = pair.largest_difference()
    mine, other = pair.said()
    assert mine == other
    pair.end()
    return found


def test_an_effect_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "effect", "my_effect"]) == 0
    file = tmp_path / "my_effect.py"
    what = plan("LuGreDamper", name="Mine", effects=[file])
    assert difference(what, **{"my_effect.on": True, "my_effect.f_s": 1.5}) <= 1e-12
    # A plan that does not name it is prepared without it, though this process has loaded it.
    bare = prepare(plan("LuGreDamper"))
    load_file(file)
    assert prepare(plan("LuGreDamper")) == bare
    assert prepare(what).functions != bare.functions


def test_a_law_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "law", "my_law"]) == 0
    load_file(tmp_path / "my_law.py", "law")
    what = plan("OwnMyLawDamper")
    assert what.laws
    assert difference(what, f_c=2.0) <= 1e-12


GROWING = '''
"""An effect whose exponential overflows."""

from math import exp, sqrt

from bristle.physics.effect import Effect, Parameter


class {name}(Effect):
    """{title}: an exponential of the displacement.

        F = {formula}

    Leaves out everything else.
    """

    name = "{key}"
    sites = ("damper",)
    needs = ("x",)
    passive = False
    zero_at_rest = False
    source = "made for a test"
    expect = "a force that depends on displacement"
    parameters = {{
        "k": Parameter(0.5, "N", (-10.0, 10.0), "size"),
        "d": Parameter(0.01, "m", (0.005, 1.0), "travel over which it grows"),
    }}

    @staticmethod
    def force(q, z, p):
        return {source}
'''
OVERFLOWS = {
    "growing": ("p.k * exp(q.x / p.d)", 10.0, "OverflowError: math range error"),
    "bounded": ("p.k / (1.0 + exp(q.x / p.d))", 10.0, "OverflowError: math range error"),
    "rooted": ("p.k * sqrt(50.0 * p.d - q.x)", 10.0, "ValueError: math domain error"),
    "divided": ("p.k / (100.0 * p.d - q.x)", 1.0, "ZeroDivisionError: float division by zero"),
}
"""Effects that Python refuses at a displacement [m], and what it says."""


def test_what_python_refuses_is_infinite_natively_and_a_fault_once_an_output_is(
    tmp_path: Path,
) -> None:
    files = []
    for key, (source, _, _) in OVERFLOWS.items():
        file = tmp_path / f"{key}.py"
        title = key.capitalize()
        named = {"key": key, "name": title, "title": title, "formula": "..."}
        file.write_text(GROWING.format(source=source, **named))
        files.append(file)
    what = plan("LuGreDamper", name="Overflowing", effects=files)
    form = Native(build(what, folder() / "own", [here()]))
    for key, (_, far, says) in OVERFLOWS.items():
        pair = Both(form, component_of(what), **{f"{key}.on": True})
        pair.begin()
        pair.set("displacement", 0.01)
        assert pair.step(0.0, 0.002) == (True, 0)
        mine, other = pair.shown()
        assert mine == other
        pair.set("displacement", far)
        stops = key != "bounded"  # 1 / (1 + inf) is 0
        assert pair.step(0.002, 0.002) == (False, 3 if stops else 0)
        assert pair.faults() == (4, 4 if stops else 0)
        told, natively = pair.said()
        assert says in told[-1]
        if stops:
            assert "fault 4, a state or output is not finite" in natively[-1]
            assert "not finite: force" in natively[-1]
            assert pair.shown()[1] == other  # held
        else:
            assert natively == []
        pair.end()
