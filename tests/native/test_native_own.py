"""Effects and laws of a user's own run natively with the same numbers; slots do not mix."""

from __future__ import annotations

from pathlib import Path

import pytest
from both_forms import Both, Native, folder, needs_zig

from bristle.cli import main
from bristle.fmu.build import Plan
from bristle.fmu.plan import plan
from bristle.native.build import build
from bristle.native.platforms import here
from bristle.native.prepare import component_of, prepare
from bristle.physics.user import load_effect, load_law

pytestmark = [needs_zig, pytest.mark.slow]


def difference(what: Plan, **values: object) -> float:
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
    assert main(["effects", "new", "my_effect"]) == 0
    file = tmp_path / "my_effect.py"
    what = plan("LuGreDamper", name="Mine", effects=[file])
    assert difference(what, **{"my_effect.on": True, "my_effect.f_s": 1.5}) <= 1e-12
    # A plan that does not name it is prepared without it, though this process has loaded it.
    bare = prepare(plan("LuGreDamper"))
    load_effect(file)
    assert prepare(plan("LuGreDamper")) == bare
    assert prepare(what).functions != bare.functions


def test_a_law_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["laws", "new", "my_law"]) == 0
    load_law(tmp_path / "my_law.py")
    what = plan("OwnMyLawDamper")
    assert what.laws
    assert difference(what, f_c=2.0) <= 1e-12
