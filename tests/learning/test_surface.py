"""Surfaces over two signals: which one promises most, its effect, where it continues."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from bingham_runs import VALUES, T, runs
from scipy.interpolate import RegularGridInterpolator
from scipy.signal import savgol_filter

from bristle.cli import main
from bristle.data.extra_channels import Extra
from bristle.identification.fit import fit
from bristle.identification.problem import Problem
from bristle.learning.closed_forms import closed_forms
from bristle.learning.curve import Curve
from bristle.learning.effect_file import effect_text
from bristle.learning.normal import residual_of
from bristle.learning.rule import LEARN
from bristle.learning.screen import promises
from bristle.learning.signals import ALONG
from bristle.learning.surface import PARTS_OF_SURFACE, continued, continues, surfaces
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS, Q
from bristle.user_code.conformance import examine
from bristle.user_code.load import defined

KNOTS, LEVELS = (-0.01, -0.004, 0.0, 0.006, 0.01), (0.0, 1.5, 4.0, 8.0)

HIDDEN = {
    "an edge that the command moves": (
        lambda x, v, V, F: F + np.tanh((x - 0.002 * (V - 3.0)) / 0.004),
        ("force", "displacement", "voltage"),
    ),
    "a ripple of the yield force at low speed": (
        lambda x, v, V, F: F * (1.0 + 0.5 * np.sin(300.0 * x) * np.exp(-np.abs(v) / 0.03)),
        ("fluid", "displacement", "speed"),
    ),
    "a friction that differs with place and speed": (
        lambda x, v, V, F: F + 0.5 * np.tanh(x / 0.003) * np.tanh(v / 0.02),
        ("friction", "displacement", "speed"),
    ),
}


def residual(problem: Problem):
    base = fit(problem, Model("bingham", (), VALUES), with_std=False).model
    return residual_of(problem, base)


def grid(f) -> Curve:
    """Return an added force over displacement and the command."""
    values = tuple(f(x, V) for V in LEVELS for x in KNOTS)
    return Curve("force", "displacement", (), KNOTS, values, across="voltage", levels=LEVELS)


@pytest.mark.parametrize(
    "hidden",
    # More than a second each; two by default, one of them with a command.
    [one if k < 2 else pytest.param(one, marks=pytest.mark.slow) for k, one in enumerate(HIDDEN)],
)
def test_the_surface_that_is_there_promises_most_and_more_than_any_curve(hidden):
    force, kind = HIDDEN[hidden]
    left = residual(runs(force))
    best = surfaces(left)[0]
    assert best.curve.kind == kind
    assert LEARN.weighed(best.loss, best.curve) < promises(left)[0].loss


def test_what_depends_on_one_signal_is_no_surface():
    left = residual(runs(lambda x, v, V, F: F + np.tanh(x / 0.004)))
    found = surfaces(left)
    assert found
    assert LEARN.weighed(found[0].loss, found[0].curve) > promises(left)[0].loss


def test_only_what_is_asked_for_is_looked_at():
    left = residual(runs(HIDDEN["an edge that the command moves"][0]))
    found = surfaces(left, ["friction", "force"], ["displacement", "voltage", "recent_speed"])
    kinds = {one.curve.kind for one in found}
    assert ("force", "displacement", "voltage") in kinds
    signals = {"displacement", "voltage", "recent_speed"}
    assert all(part in ("friction", "force") and {a, b} <= signals for part, a, b in kinds)
    assert surfaces(left, ["command"], ["displacement", "voltage"]) == []


def test_of_two_signals_with_a_memory_there_is_no_surface():
    left = residual(runs(HIDDEN["an edge that the command moves"][0]))
    assert surfaces(left, along=["recent_displacement", "recent_speed"]) == []


def test_a_channel_besides_is_the_second_signal():
    warm = 20.0 + 10.0 * np.sin(1.3 * T)
    plain = runs(lambda x, v, V, F: F + (warm - 20.0) / 10.0 * np.tanh(x / 0.003))
    problem = Problem([replace(run, extra={"oil": Extra(warm, "degC")}) for run in plain.runs])
    best = surfaces(residual(problem), ["force"])[0].curve
    assert best.kind == ("force", "displacement", "oil")
    assert (best.measured, best.across_unit) == ("degC", "degC")
    assert best.words() == "an added force over displacement and oil"
    text = effect_text("learned_1", best, "a trial")
    assert 'channels = {"signal": "oil"}' in text
    with defined({"learned_1": text}):
        assert EFFECTS["learned_1"].assumed[-1] == "signal"
        assert problem.tells(EFFECTS["learned_1"])
        assert not plain.tells(EFFECTS["learned_1"])


@pytest.mark.slow  # each is examined for 3 s; curves are by default
@pytest.mark.parametrize(
    ("part", "second"),
    [
        ("friction", "speed"), ("force", "voltage"), ("viscous", "slowing"),
        ("fluid", "acceleration"), *((part, "travel") for part in PARTS_OF_SURFACE),
    ],
)  # fmt: skip
def test_a_surface_of_every_part_is_an_effect(part, second):
    made = grid(lambda x, V: 0.3 * np.sin(200.0 * x) * (1.0 + 0.1 * V))
    levels = LEVELS if second == "voltage" else (0.0, 0.02, 0.05, 0.1)
    made = replace(made, part=part, across=second, levels=levels, held=(3, 9))
    with defined({"learned_9": effect_text("learned_9", made, "made for a test, 2026")}):
        effect = EFFECTS["learned_9"]
        assert effect.assumed == ("row_1[4]", "row_2[5]")
        assert {*ALONG[second].needs, "x"} <= set(effect.needs)
        assert [check for check in examine(effect) if not check.holds] == []


def test_the_effect_is_bilinear_between_its_knots_and_constant_beyond():
    made = grid(lambda x, V: 3.0 * np.sin(300.0 * x) * (1.0 + V) + V)
    table = np.array(made.values).reshape(4, 5)
    exact = RegularGridInterpolator((LEVELS, KNOTS), table)
    rng = np.random.default_rng(3)
    with defined({"learned_9": effect_text("learned_9", made, "made for a test, 2026")}):
        effect = EFFECTS["learned_9"]
        p = effect.values_of({name: one.value for name, one in effect.parameters.items()})
        for x, V in zip(rng.uniform(-0.02, 0.02, 50), rng.uniform(-2.0, 12.0, 50), strict=True):
            q = Q(*(0.0 for _ in Q._fields))._replace(x=x, V=V)
            inside = float(np.clip(V, 0.0, 8.0)), float(np.clip(x, -0.01, 0.01))
            assert effect.force(q, (), p) == pytest.approx(float(exact(inside)), abs=1e-4)


def test_knots_without_data_continue_those_beside_them():
    flat = replace(grid(lambda x, V: 2.0), held=(0, 19))
    gone = replace(flat, values=(99.0, *flat.values[1:-1], -99.0))
    assert continued(gone).values == pytest.approx(flat.values)
    known = grid(lambda x, V: 100.0 * x + V)
    assert continued(known) == known
    # What the law has already stays zero, and is no knot without data.
    level = replace(grid(lambda x, V: 0.1 * V), part="yield", held=(0, 5))
    assert continues(level) == (5,)
    assert continued(level).values[0] == 0.0


def test_a_surface_has_no_closed_form():
    assert closed_forms(grid(lambda x, V: float(np.tanh(500.0 * x - V + 3.0))), [0.1] * 20) == []


@pytest.mark.slow  # a study learns a surface, by default a curve
def test_a_study_learns_a_surface_draws_it_and_takes_it(tmp_path, capsys):
    folder = tmp_path / "rig"
    assert main(["example", "bench", str(folder), "--quiet"]) == 0
    for file in sorted((folder / "data").glob("*.csv")):
        with file.open() as text:
            titles, *rows = list(csv.reader(text))
        table = np.array(rows, dtype=float)
        x, V = savgol_filter(table[:, 1], 15, 3), savgol_filter(table[:, 3], 15, 2)
        table[:, 4] += 6.0 * np.sin(x / 8.0 + 0.4 * V)  # N, mm, V
        with file.open("w", newline="") as text:
            csv.writer(text).writerows([titles, *table.tolist()])
    assert main(["identify", str(folder), "--quiet"]) == 0
    capsys.readouterr()
    asked = ["--as", "force", "--along", "displacement,voltage", "--quiet"]
    assert main(["learn", str(folder), *asked, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["part"], told["along"], told["across"]) == ("force", "displacement", "voltage")
    assert told["across_unit"] == "V"
    assert len(told["values"]) == len(told["levels"]) * len(told["knots"])
    assert told["z"] < 0.35 * told["z_before"]
    assert all(one["z"] > told["z"] for one in told["others"])
    assert (folder / "reports" / "learned_1.png").stat().st_size > 10_000
    assert main(["add", str(folder), "learned_1", "--quiet"]) == 0
    assert "learned_1" in (folder / "model.toml").read_text()
