"""The generator of hidden effects stands alone, and gives what it was asked for."""

from __future__ import annotations

import ast
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.independent.effects import BOTH, CROSSED, FORMS, FURTHER, forms
from tests.independent.generate import make_case
from tests.independent.kernel import _accumulator
from tests.independent.rigs import draw_rig
from tests.independent.specimen import Specimen

HERE = Path(__file__).parent


@pytest.mark.parametrize("path", sorted(HERE.glob("*.py")), ids=lambda path: path.name)
def test_shares_no_code_with_the_package(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert not any(name.split(".")[0] == "bristle" for name in names)


def test_reaches_the_share_that_was_asked_for():
    case = make_case(1, "gas_spring", None, 0.15, 0.01, "bench_10N", "lugre")
    assert case.truth["share"] == pytest.approx(0.15, abs=0.005)
    assert len(case.runs) == 7


def test_a_seed_gives_the_same_case_again():
    first, second = (make_case(3, "none", None, 0.15, 0.01, "bench_10N", "lugre") for _ in "ab")
    for one, other in zip(first.runs, second.runs, strict=True):
        assert np.array_equal(one["force"], other["force"])


@pytest.mark.parametrize("bed", ["bench_10N", "structure_10N"])
@pytest.mark.parametrize("name", [name for name in FORMS if name != "none"])
def test_every_form_gives_its_parameters_on_every_rig_that_carries_it(name, bed):
    size = {"travel": 0.01, "drift": 0.002}
    for law in BOTH:
        rig = draw_rig(bed, law, np.random.default_rng(1))
        for one in forms(name, rig):
            fields = one.fields(0.3, np.random.default_rng(2), rig, size)
            assert fields
            assert all(np.all(np.isfinite(value)) for value in fields.values())


@pytest.mark.parametrize(
    ("name", "form", "law"),
    [
        # Half a second each: the generator's other laws take the same form of the effect.
        pytest.param(n, f, law, marks=[] if law == one.laws[0] else pytest.mark.slow)
        for n in (*FURTHER, *CROSSED)
        for f, one in FORMS[n].items()
        for law in one.laws
    ],
)
def test_a_further_effect_changes_a_bench_by_what_was_asked_for_or_by_its_most(name, form, law):
    case = make_case(11, name, form, 0.05, 0.01, "bench_10N", law, duration=6.0)
    assert case.truth["kind"] == "outside"
    assert case.truth["share"] == pytest.approx(0.05, abs=0.005)


def test_a_contact_on_one_side_pushes_there_alone():
    case = make_case(5, "one_sided_contact", "bumper", 0.15, 0.01, "bench_10N", "bingham")
    side = case.truth["effects"][0]["parameters"]["one_side"]
    gap = case.truth["effects"][0]["parameters"]["one_gap"]
    with_it = case.specimen.answer(case.plan[0])
    without = Specimen(case.specimen.rig, {}).answer(case.plan[0])
    more, x = with_it["force"] - without["force"], side * with_it["displacement"]
    assert np.all(more[x <= gap] == 0.0)
    assert np.all(side * more[x > gap] > 0.0)


def test_a_breakaway_fades_with_the_way_since_the_last_reversal():
    case = make_case(5, "breakaway", "fall", 0.15, 0.01, "bench_10N", "bingham")
    fields = case.truth["effects"][0]["parameters"]
    run = case.plan[0]
    with_it, without = (Specimen(case.specimen.rig, one).answer(run) for one in (fields, {}))
    v, x = with_it["velocity"], with_it["displacement"]
    grip = case.specimen.rig.values["f_c"] + case.specimen.rig.values["f_v"] * with_it["voltage"]
    share = (with_it["force"] - without["force"]) / grip * np.sign(v)
    for turn, end in pairwise(np.flatnonzero(v[1:] * v[:-1] < 0.0) + 1):
        way = np.abs(x[turn:end] - x[turn - 1])  # from the last sample before the reversal
        wanted = fields["brk_s"] * np.exp(-way / fields["brk_len"])
        assert np.allclose(share[turn:end], wanted, atol=0.1 * fields["brk_s"])


def test_an_accumulator_is_stiffer_fast_than_slow():
    """Adiabatic over isothermal stiffness is 1.4, the ratio of a diatomic gas's heats."""
    rig = make_case(5, "none", None, 0.15, 0.01, "bench_10N", "bingham").specimen.rig
    fields = {"heat_kind": 1, "heat_k": 100.0, "heat_c": 0.4, "heat_tau": 0.3, "heat_len": 1.0}
    x, h = 0.01, 1e-6
    for held, stiffness in ((0.0, 140.0), (x, 100.0)):  # the state lags behind, or has followed
        plant = Specimen(rig, fields).plant[0]
        assert _accumulator(plant, held, x, 0.0)[0] == pytest.approx(stiffness * x)
    gas = Specimen(rig, fields | {"heat_kind": 2}).plant[0]
    assert _accumulator(gas, 0.0, h, 0.0)[0] == pytest.approx(100.0 * h, rel=1e-5)
    grown = _accumulator(gas, 0.0, 0.0, 1.0)[1] * h  # what heats up while it moves by h
    assert _accumulator(gas, grown, h, 0.0)[0] == pytest.approx(140.0 * h, rel=1e-5)
