"""Which laws are searched for effects, and which pair of law and effects is named: made trials."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from bristle.diagnosis import site
from bristle.diagnosis.law_choice import (
    LawAndEffects,
    LawVerdict,
    as_good,
    best_of,
    choose,
    clearly_worse,
    equivalents,
    rows_of,
    search,
    simplest,
    survivors,
)
from bristle.diagnosis.law_trials import LawTrial
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.rule import BENCH
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.trials import Trial
from bristle.diagnosis.words import headline, law_sentences, law_table
from bristle.identification.error import ForceError
from bristle.identification.histories import counted
from bristle.identification.problem import Problem
from bristle.model.model import Model
from bristle.physics.laws import base_and_variant

SAMPLES = 6000
NOISE = np.random.default_rng(1).standard_normal(SAMPLES) ** 2


def trial(z, law, effects=(), spread=0.0, seed=0):
    """Return a trial whose losses have the mean z^2; `spread` makes blocks of them differ."""
    blocks = np.repeat(np.random.default_rng(seed).standard_normal(SAMPLES // 250), 250)
    losses = NOISE / NOISE.mean() * z**2 + spread * blocks
    base, variant = base_and_variant(law)
    model = Model(base.name, tuple(effects), dict(variant.values))
    return Trial(model, z, z, z, losses, np.sqrt(NOISE))


def erring(rms):
    """Return an error of so many newtons in 10 N."""
    return ForceError(SAMPLES, SAMPLES, rms, 10.0, rms, 10.0)


def row(law, z, **choices):
    return LawTrial(law, trial(z, law, **choices), erring(z), (z, z, z))


def pair(law, z_alone, kind="none", effects=(), z=None, **choices):
    """Return a law with what it lacks."""
    first = row(law, z_alone)
    after = trial(z if z is not None else z_alone, law, effects, **choices)
    gone = SiteDiagnosis(
        "damper", kind, tuple(effects), z_alone, after.z, 0.0, float("nan"), after=after
    )
    return LawAndEffects(first, gone, Prepared(after, Problem([]), Problem([])))


def looker(*pairs):
    """Return what looks up a law's pair, and the laws that were asked for."""
    known = {one.row.law: one for one in pairs}
    asked = []

    def look(one, pairs):
        if one.law not in asked:
            asked.append(one.law)
        return known[one.law]

    return look, asked


def test_a_law_is_clearly_worse_by_enough_and_beyond_chance_alone():
    best = trial(1.0, "dahl")
    assert not clearly_worse(trial(1.0 + 0.5 * BENCH.law_gain, "bingham"), best)
    assert clearly_worse(trial(1.0 + 2.0 * BENCH.law_gain, "bingham"), best)
    assert not clearly_worse(trial(1.0 + 2.0 * BENCH.law_gain, "bingham", spread=1.0), best)


def test_other_samples_are_compared_by_z_alone():
    best, other = trial(1.0, "dahl"), trial(1.05, "bingham")
    fewer = Trial(other.model, 1.05, 1.05, 1.05, other.losses[:-5], other.residual[:-5])
    assert clearly_worse(fewer, best)
    assert not as_good(fewer, best)


MIMICS = [
    row("modified_bouc_wen", 4.91), row("tanh", 4.92), row("tanh[quadratic]", 4.92),
    row("bouc_wen", 5.1), row("lugre", 6.6), row("bingham", 6.7), row("lugre[quadratic]", 6.8),
    row("lugre_standard", 6.9), row("bingham_standard", 7.0), row("dahl", 7.1),
]  # fmt: skip
"""Laws without an effect on runs of a Bingham damper with a gas spring."""


def test_the_best_law_and_those_that_contain_nothing_go_on():
    found = [one.law for one in survivors(MIMICS)]
    assert found == ["modified_bouc_wen", "lugre", "tanh", "bingham"]
    assert len(found) == BENCH.most_laws


def test_a_parabola_goes_on_where_a_straight_line_is_clearly_worse():
    rows = [*MIMICS, row("dahl[quadratic]", 5.5)]
    assert "dahl[quadratic]" in [one.law for one in survivors(rows)]
    assert "lugre" in [one.law for one in survivors(rows)]


def bent(z, rms):
    """Return the best law of `MIMICS` with a parabola, its error in z and its plain one."""
    formed = row("modified_bouc_wen[quadratic]", z)
    return replace(formed, trial=replace(formed.trial, rms=rms))


@pytest.mark.parametrize(
    ("z", "rms", "goes_on"), [(5.1, 4.7, True), (5.1, 4.89, False), (5.1, 5.1, False)]
)
def test_the_plain_error_judges_the_form_of_a_command_where_the_law_is_far_off(z, rms, goes_on):
    found = [one.law for one in survivors([*MIMICS, bent(z, rms)])]
    best = "modified_bouc_wen[quadratic]" if goes_on else "modified_bouc_wen"
    assert found == [best, "lugre", "tanh", "bingham"]


def test_the_straight_form_does_not_go_on_beside_the_parabola_that_it_gave_way_to():
    rows = [row("modified_bouc_wen", 5.0), bent(5.1, 4.7), row("bingham", 9.0)]
    assert [one.law for one in survivors(rows)] == ["modified_bouc_wen[quadratic]", "bingham"]


def test_the_smallest_z_goes_on_where_a_missing_effect_makes_its_plain_error_large():
    # Of a damper whose mount gives: its law alone fits the samples near rest, and no others.
    near_rest = row("tanh", 6.6)
    rows = [replace(near_rest, trial=replace(near_rest.trial, rms=13.2)), row("lugre", 7.9)]
    assert {one.law for one in survivors(rows)} == {"lugre", "tanh"}


def test_a_law_that_contains_an_effect_goes_on_where_it_does_no_better_than_one_without():
    # A Bouc-Wen damper with Stribeck friction: its spring shows once the friction is there.
    rows = [
        row("lugre[quadratic]", 8.93), row("bouc_wen", 8.94), row("modified_bouc_wen", 8.95),
        row("lugre", 8.95), row("lugre_standard", 9.4), row("dahl", 9.47), row("bingham", 14.6),
    ]  # fmt: skip
    assert "bouc_wen" in [one.law for one in survivors(rows)]


def test_near_the_noise_z_judges_the_form_of_a_command():
    near = [row("modified_bouc_wen", 1.5), row("bingham", 4.0), bent(1.55, 1.4)]
    assert survivors(near)[0].law == "modified_bouc_wen"


def test_nothing_more_is_searched_where_a_plain_law_lacks_nothing():
    rows = [row("dahl", 1.0), row("lugre", 1.0), row("bouc_wen", 1.0), row("bingham", 4.0)]
    look, asked = looker(pair("dahl", 1.0))
    (found,) = search(rows, look)
    assert asked == ["dahl"]
    assert choose([found]) is found


def test_a_law_that_contains_the_missing_effect_does_not_end_the_search():
    rows = [row("bouc_wen", 1.02), row("dahl", 6.0)]
    true = pair("dahl", 6.0, "effect", ("duffing",), 1.0)
    look, asked = looker(pair("bouc_wen", 1.02), true)
    found = search(rows, look)
    assert asked == ["bouc_wen", "dahl"]
    assert choose(found) is true


def test_a_law_is_left_out_where_fewer_parameters_explain_the_runs_already():
    rows = [row("bouc_wen", 3.0), row("bingham", 6.0)]
    true = pair("bingham", 6.0, "effect", ("gas_spring",), 1.0)
    look, asked = looker(pair("bouc_wen", 3.0, "unknown"), true)
    search(rows, look)
    assert asked == ["bingham"]


def test_laws_are_searched_on_where_a_simple_one_explains_nothing():
    rows = [row("bouc_wen", 3.0), row("bingham", 6.0)]
    look, asked = looker(pair("bouc_wen", 3.0, "unknown"), pair("bingham", 6.0, "unknown"))
    assert len(search(rows, look)) == 2
    assert asked == ["bingham", "bouc_wen"]


def test_where_nothing_explains_the_runs_the_best_law_that_was_left_out_is_looked_at():
    z = {"lugre": 5.0, "dahl": 5.05, "bouc_wen": 7.0, "modified_bouc_wen": 6.5, "bingham": 9.0}
    true = pair("modified_bouc_wen", 6.5, "effect", ("flattening",), 1.0)
    others = [pair(law, z[law], "unknown", z=4.0) for law in z if law != true.row.law]
    look, asked = looker(true, *others)
    found = search([row(law, z[law]) for law in z], look)
    assert choose(found) is true
    assert asked[-1] == "modified_bouc_wen"
    assert "bouc_wen" not in asked


def test_the_simpler_of_two_that_explain_the_runs_is_named_and_the_other_told():
    simple, rich = pair("dahl", 1.001), pair("lugre", 1.0)
    assert choose([rich, simple]) is simple
    other = row("bouc_wen", 1.002)
    bent = row("dahl[quadratic]", 1.0)  # does as well as dahl by itself: nothing to tell
    told = equivalents(simple, [rich, simple], [simple.row, bent, rich.row, other])
    assert [(law, effects) for law, effects, _ in told] == [("lugre", ()), ("bouc_wen", ())]


def test_a_law_with_nothing_missing_is_preferred_to_an_effect_at_equal_size():
    effect = pair("dahl", 6.0, "effect", ("quadratic_damping",), 1.0)
    none = pair("lugre", 1.0)
    assert effect.fitted == none.fitted
    assert choose([effect, none]) is none


def test_an_effect_is_not_named_for_what_a_better_law_explains():
    mimic = pair("bingham", 6.0, "effect", ("gas_spring",), 1.06)
    law = pair("bouc_wen", 1.0)
    assert choose([mimic, law]) is law


def test_where_none_explains_the_runs_the_best_is_unknown():
    best, other = pair("tanh", 3.0, "unknown"), pair("lugre", 5.0, "unknown")
    assert choose([other, best]) is best
    assert equivalents(best, [best, other], [best.row, other.row]) == []


def test_where_none_explains_the_runs_the_law_that_comes_nearest_with_an_effect_is_the_best():
    alone, other = pair("tanh", 3.0, "unknown"), pair("dahl", 5.0, "unknown")
    gas = trial(2.0, "dahl", ("gas_spring",))
    other = replace(other, finding=replace(other.finding, trials=(gas,)))
    assert other.reach() is gas
    assert choose([alone, other]) is other
    far = replace(other, finding=replace(other.finding, trials=(trial(4.0, "dahl", ("delay",)),)))
    assert choose([alone, far]) is alone
    rich = pair("modified_bouc_wen", 2.99, "unknown")
    assert choose([rich, alone]) is alone  # that hardly differs, with fewer parameters


def test_where_all_leave_many_times_the_noise_a_law_leads_that_comes_nearest_by_itself():
    alone, other = pair("modified_bouc_wen", 7.1, "unknown"), pair("dahl", 28.0, "unknown")
    two = trial(7.0, "dahl", ("gas_spring", "flattening"))
    other = replace(other, finding=replace(other.finding, trials=(two,)))
    assert choose([other, alone]) is alone
    near = replace(other, finding=replace(other.finding, trials=(replace(two, z=6.0),)))
    assert choose([near, alone]) is near


def test_most_of_a_large_error_is_no_explanation_where_a_simpler_law_comes_as_near():
    """Two effects explain most of what one law leaves, and leave as much as another with one."""
    mimic = pair("bingham", 10.9, "effect", ("presliding", "gas_spring"), 3.7)
    other = pair("dahl", 6.08, "unknown")
    gas = trial(3.3, "dahl", ("gas_spring",))
    other = replace(other, finding=replace(other.finding, trials=(gas,)))
    assert choose([mimic, other]) is other
    settled = pair("bingham", 10.9, "effect", ("presliding", "gas_spring"), 1.05)
    assert choose([settled, other]) is settled
    far = replace(other, finding=replace(other.finding, trials=(trial(5.0, "dahl", ("delay",)),)))
    assert choose([mimic, far]) is mimic


def test_of_wrong_laws_one_that_serves_rest_alone_is_not_the_best():
    near_rest, all_over = trial(5.8, "tanh"), trial(6.1, "modified_bouc_wen")
    near_rest, all_over = replace(near_rest, rms=13.2), replace(all_over, rms=9.1)
    assert best_of([near_rest, all_over]) is all_over
    right = replace(trial(1.0, "bingham"), rms=13.2)  # its jumps are a sample off
    assert best_of([right, all_over]) is right


def test_the_simplest_law_is_of_those_that_the_best_does_not_surpass():
    rows = [row("lugre", 1.0), row("dahl", 1.002), row("bingham_standard", 1.2)]
    assert simplest(rows).law == "dahl"


def test_an_interval_over_runs_needs_two_of_them():
    best = LawTrial("dahl", trial(1.0, "dahl"), erring(1.0), (1.0, 1.0, 1.1))
    other = LawTrial("bingham", trial(2.0, "bingham"), erring(2.0), (2.0, 2.2, 2.1))
    above, half = other.above(best)
    assert above == pytest.approx(1.0667, abs=1e-3)
    # t(0.975; 2) = 4.303 of Student's tables; standard deviation of 1.0, 1.2, 1.0 by sqrt(3)
    assert half == pytest.approx(4.303 * 0.11547 / 3**0.5, rel=1e-3)
    alone = [LawTrial(one.law, one.trial, erring(1.0), one.z_runs[:1]) for one in (other, best)]
    assert np.isnan(alone[0].above(alone[1])[1])
    assert rows_of((alone[1], alone[0]))[1]["interval95"] is None


def test_the_verdict_tells_law_table_and_what_does_as_well():
    true = pair("bingham", 6.0, "effect", ("gas_spring",), 1.0)
    best = pair("bouc_wen", 1.003)
    rows = (best.row, true.row, row("lugre[quadratic]", 7.0))
    verdict = LawVerdict(true.row, "lugre", rows, (true, best), (("bouc_wen", (), 1.003),))
    told = {"kind": "effect", "effects": ["gas_spring"], **verdict.as_dict()}
    assert (told["law"], told["command"], told["law_before"]) == ("bingham", "linear", "lugre")
    assert headline(told) == "Missing from the law bingham: gas spring."
    first, second = law_sentences(told)
    assert "bingham with gas spring is the simplest of " in first
    assert first.endswith("explains the runs.")  # how near, the verdict says
    assert "so does another: bouc_wen alone." in second
    table = law_table(told["laws"])
    assert [cells[:2] for cells in table][-1] == ["lugre", "quadratic"]
    assert table[0][5] == "best"
    assert (table[0][6], table[0][7]) == (
        "1.003 N (10.0 %)",
        "not judged",
    )  # nobody asked on held-out runs
    old = [{"rms_train": 0.3, "rms_holdout": 0.4, **one} for one in told["laws"]]
    for one in old:  # another error than the one that is told today
        del one["error_train"], one["error_holdout"]
    assert {cells[k] for cells in law_table(old) for k in (6, 7)} == {"not judged"}


def test_a_verdict_on_a_law_given_says_nothing_of_laws():
    assert law_sentences({"kind": "none", "effects": []}) == []
    assert headline({"kind": "effect", "effects": ["drift"]}) == "Missing from the model: drift."


def test_an_effect_that_explains_most_near_rest_is_not_preferred_to_a_law_with_half_the_error():
    mimic = pair("bingham", 13.0, "effect", ("gas_spring",), 5.21)
    law = pair("modified_bouc_wen", 5.2, "unknown")
    assert not clearly_worse(mimic.after, law.after)  # by z the runs do not tell
    assert choose([mimic, law]) is mimic
    coarse = replace(mimic.after, rms=2.6 * law.after.rms)
    coarse_pair = replace(mimic, finding=replace(mimic.finding, after=coarse))
    assert clearly_worse(coarse, law.after)
    assert choose([coarse_pair, law]) is law


def test_two_effects_are_tried_only_where_no_single_one_explains_the_runs():
    rows = [row("bouc_wen", 3.0), row("lugre", 5.0), row("bingham", 6.0)]
    twice = []

    def look(one, pairs):
        twice.extend([one.law] * pairs)
        effect = "effect" if one.law == "lugre" else "unknown"
        return pair(one.law, one.trial.z, effect, ("gas_spring",), z_of_lugre[one.law])

    z_of_lugre = {"lugre": 1.0, "bingham": 2.0, "bouc_wen": 3.0}
    assert choose(search(rows, look)).row.law == "lugre"
    assert twice == []
    z_of_lugre["lugre"] = 1.06  # a pair could be clearly better
    search(rows, look)
    assert twice == ["lugre"], "two effects of the others begin too far from there"
    z_of_lugre["bouc_wen"] = 1.1
    twice.clear()
    search(rows, look)
    assert twice == ["lugre", "bouc_wen"], "one that begins near may do better"


def test_two_effects_are_tried_of_the_nearest_law_first_and_of_all_until_two_explain_the_runs():
    rows = [row("lugre", 5.0), row("dahl", 5.05), row("bouc_wen", 4.0), row("bingham", 9.0)]
    alone = {"lugre": 2.0, "dahl": 4.9, "bouc_wen": 3.0, "bingham": 8.0}
    twice = []

    def look(one, pairs):
        twice.extend([one.law] * pairs)
        found = pairs and one.law == explains
        left = 1.3 if found else alone[one.law]
        return pair(one.law, one.trial.z, "effect" if found else "unknown", ("delay",), left)

    explains = ""
    search(rows, look)
    assert twice == ["lugre", "bouc_wen", "dahl", "bingham"]
    twice.clear()
    explains = "lugre"
    found = search(rows, look)
    assert twice == ["lugre", "bouc_wen"]
    assert {one.row.law for one in found} == {*alone}, "the others stay with a single effect"
    assert choose(found).row.law == "lugre"


def test_a_law_that_a_simpler_one_of_its_parts_equals_waits_for_effects_that_leave_little():
    z = {"modified_bouc_wen": 4.9, "bouc_wen": 4.91, "lugre": 5.0, "dahl": 5.01, "bingham": 9.0}
    rows = [row(law, z[law]) for law in z]
    assert "modified_bouc_wen" not in [one.law for one in survivors(rows)]
    coarse = replace(rows[1], trial=replace(rows[1].trial, rms=6.0))
    assert "modified_bouc_wen" in [one.law for one in survivors([rows[0], coarse, *rows[2:]])]
    for left, waits in ((4.0, True), (1.2, False)):
        look, asked = looker(*(pair(law, z[law], "unknown", z=left) for law in z))
        search(rows, look)
        assert {"bouc_wen", "dahl"} <= {*asked}
        assert ("modified_bouc_wen" not in asked) is waits
        assert ("lugre" not in asked) is waits


def test_a_law_that_waited_is_searched_once_two_effects_of_the_simpler_one_leave_little():
    rows = [row("lugre", 5.0), row("dahl", 5.01), row("bingham", 9.0)]
    asked = []

    def look(one, pairs):
        asked.append((one.law, pairs))
        left = {"dahl": 1.2, "lugre": 1.0}.get(one.law, 8.0) if pairs else 4.0
        kind = "effect" if pairs else "unknown"
        return pair(one.law, one.trial.z, kind, ("delay", "stribeck"), left)

    found = search(rows, look)
    assert ("lugre", False) not in asked
    assert asked[-1] == ("lugre", True)
    assert choose(found).row.law == "lugre"


def test_where_enough_was_searched_the_best_law_is_still_looked_at_and_two_effects_of_the_nearest():
    z = {"lugre": 5.0, "dahl": 5.05, "bouc_wen": 4.0, "bingham": 9.0}
    asked = []

    def look(one, pairs):
        asked.append((one.law, pairs))
        return pair(one.law, one.trial.z, "unknown", z=0.9 * one.trial.z)

    found = search([row(law, z[law]) for law in z], look, enough=lambda _row, _pairs: True)
    assert asked == [("bouc_wen", False), ("bouc_wen", True)]
    assert [one.row.law for one in found] == ["bouc_wen"]

    asked.clear()
    found = search([row(law, z[law]) for law in z], look, enough=lambda _row, pairs: pairs)
    assert [law for law, pairs in asked if pairs] == ["bouc_wen"]
    assert {one.row.law for one in found} == {*z}, "the others stay with a single effect"


@pytest.mark.parametrize("most", [inf, -1.0])
def test_behind_a_joint_no_second_effect_is_sought_once_enough_was_spent(monkeypatch, most):
    def tried(base, *_given, most=None, **_named):
        names = ("stribeck",) if most else ("backlash", "gas_spring")
        return [trial(4.0, "bingham", (*base.effects, name)) for name in names]

    monkeypatch.setattr(site, "try_all", tried)
    runs = Problem([])
    with counted(most):
        made = site.Trials(Prepared(trial(6.0, "bingham"), runs, runs))
        grown = {first.effects: len(made.grow(first)) for first in made.single}
    assert grown == {("backlash",): int(most > 0.0), ("gas_spring",): 1}


def test_the_verdict_says_of_which_laws_not_all_was_tried():
    rows = (row("lugre", 5.0), row("dahl", 5.05), row("bouc_wen", 6.0))
    pairs = tuple(pair(one.law, one.trial.z, "unknown") for one in rows[:2])
    laws = LawVerdict(rows[0], "", rows, pairs, not_tried={"bouc_wen": False, "dahl": True})
    said = laws.as_dict()
    assert said["not_tried"] == {"effects": ["bouc_wen"], "two_effects": ["dahl"]}
    (text,) = [one for one in law_sentences(said | {"kind": "unknown"}) if "Not tried" in one]
    assert text == (
        "Not tried, because the search had taken long enough: effects of bouc_wen and two effects "
        "at once of dahl."
    )
