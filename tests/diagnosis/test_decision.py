"""From numbers of trials to a verdict: the rules alone, on made trials."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bristle.diagnosis.decision import decide, missing
from bristle.diagnosis.rule import BENCH, INSIDE, RECONSTRUCTED
from bristle.diagnosis.site import beside_yield
from bristle.diagnosis.trials import Trial
from bristle.model.model import Model

SAMPLES = 6000
NOISE = np.random.default_rng(1).standard_normal(SAMPLES) ** 2


def trial(z, *effects, spread=0.0, seed=0):
    """Return a trial whose losses have the mean z^2; `spread` makes blocks of them differ."""
    blocks = np.repeat(np.random.default_rng(seed).standard_normal(SAMPLES // 250), 250)
    losses = NOISE / NOISE.mean() * z**2 + spread * blocks
    return Trial(Model("bingham", effects), z, z, z, losses, np.sqrt(NOISE))


def no_more(_first):
    """Grow nothing: no second effect helps."""
    return []


def refuse(_first):
    """Fail if a pair is looked for."""
    raise AssertionError("a pair was looked for")


def test_none_where_nothing_helps_and_the_error_is_noise():
    found = decide(trial(1.02), [trial(1.02, "stribeck"), trial(1.015, "coil_lag")], refuse)
    assert found.kind == "none"
    assert found.effects == ()
    assert "1.02 times the noise (z)" in found.reasons[0]


def test_a_gain_below_the_smallest_is_none_and_above_it_an_effect():
    before = trial(1.1)
    less, more = (
        trial(1.1 * (1.0 - 0.8 * BENCH.gain), "drift"),
        trial(1.1 * (1.0 - 2.0 * BENCH.gain), "drift"),
    )
    assert not missing(before, less)
    assert decide(before, [less], no_more).kind == "none"
    assert missing(before, more)
    assert decide(before, [more], no_more).effects == ("drift",)


def test_a_gain_on_the_runs_held_out_alone_is_none_where_noise_is_nearly_all():
    before, after = replace(trial(1.046), train=0.994), replace(trial(1.02, "drift"), train=0.994)
    assert not missing(before, after)
    assert missing(before, replace(after, train=0.99))
    assert missing(replace(before, z=1.5), after)


def test_a_gain_within_chance_is_none_missing():
    before, after = trial(1.1), trial(1.05, "drift", spread=1.0)
    assert 1.0 - after.z / before.z > BENCH.gain
    assert not missing(before, after)


def test_a_gain_at_the_cost_of_the_plain_error_is_none_missing():
    before, after = trial(3.0), trial(1.5, "drift")
    assert missing(before, after)
    assert not missing(before, replace(after, rms=1.2 * before.rms))


def test_a_few_samples_beside_reversals_are_no_cost():
    before, after = replace(trial(3.0), rms_bulk=1.0), replace(trial(1.5, "drift"), rms=3.6)
    assert missing(before, replace(after, rms_bulk=0.6))
    assert not missing(before, replace(after, rms_bulk=1.2))


def test_noise_that_was_estimated_too_high_judges_nothing():
    found = decide(trial(0.5), [trial(0.4, "stribeck")], refuse)
    assert (found.kind, found.effects) == ("insufficient", ())
    assert "State the noise" in found.reasons[0]
    assert decide(trial(0.5), [trial(0.499, "stribeck")], refuse).kind == "none"


def test_one_effect_that_explains_it():
    before = trial(3.0)
    found = decide(before, [trial(2.7, "stribeck"), trial(1.01, "gas_spring")], refuse)
    assert (found.kind, found.effects) == ("effect", ("gas_spring",))
    assert found.best.z == pytest.approx(1.01)
    assert found.explained > 0.99


def test_an_effect_of_another_form_keeps_its_name_and_says_that_a_residual_remains():
    trials = [trial(1.4, "gas_spring"), trial(2.6, "stribeck")]
    found = decide(trial(3.0), trials, no_more)
    assert (found.kind, found.effects) == ("effect", ("gas_spring",))
    assert any("follows another formula" in reason for reason in found.reasons)


def test_rivals_that_the_data_cannot_distinguish_are_ambiguous():
    trials = [trial(1.010, "asymmetry"), trial(1.011, "gas_spring"), trial(2.0, "stribeck")]
    found = decide(trial(3.0), trials, refuse)
    assert found.kind == "ambiguous"
    assert found.effects == ("asymmetry", "gas_spring")


def test_a_wrong_form_must_stand_out_more_where_equilibrium_gives_the_force():
    before = trial(4.25)
    tried = [trial(1.97, "base_friction"), trial(2.28, "stribeck"), trial(2.83, "flattening")]
    assert decide(before, tried, no_more, rule=INSIDE).effects == ("base_friction",)
    found = decide(before, tried, no_more, rule=RECONSTRUCTED)
    assert (found.kind, found.effects) == ("ambiguous", ("base_friction", "stribeck"))


def test_friction_that_the_layer_shares_has_what_suffices_for_a_rival():
    def named(*tried):
        before = trial(1.53)
        found = decide(before, tried, no_more, rule=RECONSTRUCTED)
        found = beside_yield(found, before, tried, RECONSTRUCTED)
        return found.kind, *found.effects

    friction, flattening = trial(1.03, "base_friction"), trial(1.4, "flattening")
    both = ("ambiguous", "base_friction", "stribeck")
    assert named(friction, trial(1.10, "stribeck"), flattening) == both
    assert named(friction, flattening) == ("effect", "base_friction")
    assert named(trial(1.03, "stribeck"), trial(1.10, "base_friction")) == ("effect", "stribeck")


def test_three_alternatives_are_named_at_most():
    trials = [trial(1.01 + 1e-4 * k, name) for k, name in enumerate("abcdef")]
    assert decide(trial(3.0), trials, refuse).effects == ("a", "b", "c")


def test_series_elements_count_as_one():
    trials = [trial(1.01, "presliding"), trial(1.011, "mount_compliance")]
    found = decide(trial(3.0), trials, refuse)
    assert (found.kind, found.effects) == ("effect", ("presliding",))


def test_unknown_where_the_best_effect_leaves_most_of_it():
    found = decide(trial(3.0), [trial(2.5, "stribeck")], no_more)
    assert (found.kind, found.effects) == ("unknown", ())
    assert found.best.effects == ()
    assert "Stribeck effect" in found.reasons[0]


@pytest.mark.parametrize(("z", "organised"), [(BENCH.clean + 0.05, False), (1.05, True)])
def test_unknown_where_no_effect_helps_but_something_is_there(z, organised):
    found = decide(trial(z), [trial(z, "stribeck")], refuse, organised=organised)
    assert (found.kind, found.effects) == ("unknown", ())


def test_two_effects_where_both_are_needed():
    def grow(first):
        assert first.effects[0] in ("gas_spring", "coil_lag")
        return [trial(1.01, "gas_spring", "coil_lag")]

    found = decide(trial(3.0), [trial(2.0, "gas_spring"), trial(2.4, "coil_lag")], grow)
    assert (found.kind, set(found.effects)) == ("effect", {"gas_spring", "coil_lag"})
    assert found.best.z == pytest.approx(1.01)


def test_a_second_effect_that_takes_little_is_not_named():
    def grow(_first):
        return [trial(1.35, "gas_spring", "coil_lag")]

    found = decide(trial(3.0), [trial(1.4, "gas_spring"), trial(2.9, "coil_lag")], grow)
    assert found.effects == ("gas_spring",)


@pytest.mark.parametrize(
    ("large", "alone", "left", "names"),
    [
        (8.0, 1.4, BENCH.complete, 2),
        (8.0, 1.4, 1.1 * BENCH.complete, 1),
        (8.0, 1.12, 1.02, 1),
        (36.0, 6.7, 1.02 * BENCH.complete, 2),
        (36.0, 6.7, 2.0, 1),
    ],
)
def test_a_small_second_effect_counts_where_it_leaves_nothing(large, alone, left, names):
    best = trial(alone, "gas_spring")
    assert (best.z**2 - 1.0) / (large**2 - 1.0) < BENCH.pair_part
    found = decide(
        trial(large),
        [best, trial(7.7, "delay")],
        lambda _first: [trial(left, "gas_spring", "delay")],
    )
    assert (found.kind, len(found.effects)) == ("effect", names)


def test_a_pair_is_reduced_where_one_of_it_suffices_alone():
    def grow(_first):
        return [trial(1.01, "coil_lag", "gas_spring")]

    def reduce(pair):
        assert set(pair.effects) == {"coil_lag", "gas_spring"}
        return [trial(1.012, "gas_spring"), trial(2.4, "coil_lag")]

    trials = [trial(2.0, "coil_lag"), trial(2.2, "gas_spring")]
    assert len(decide(trial(3.0), trials, grow).effects) == 2
    found = decide(trial(3.0), trials, grow, reduce=reduce)
    assert (found.kind, found.effects) == ("effect", ("gas_spring",))


def test_only_what_is_new_is_named():
    before = trial(3.0, "stribeck")
    found = decide(before, [trial(1.01, "stribeck", "gas_spring")], refuse)
    assert found.effects == ("gas_spring",)
