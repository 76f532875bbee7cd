"""What is told of effects that lower an error which none of them explains: made trials."""

from __future__ import annotations

import numpy as np

from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.trials import Trial
from bristle.diagnosis.verdict import gains_of
from bristle.diagnosis.words import sentences
from bristle.model.model import Model

NOISE = np.random.default_rng(1).standard_normal(6000) ** 2


def trial(z, *effects):
    """Return a trial whose losses have the mean z^2."""
    losses = NOISE / NOISE.mean() * z**2
    return Trial(Model("bouc_wen", effects), z, z, z, losses, np.sqrt(NOISE))


def finding(*trials, kind="unknown", together=None):
    """Return what a damper shows whose model has z = 3."""
    before = trial(3.0)
    return SiteDiagnosis(
        "damper", kind, (), 3.0, 3.0, 0.0, float("nan"), "", None, trials, before, before,
        together=together,
    )  # fmt: skip


def test_effects_that_gain_are_told_with_what_each_gains():
    singles = trial(2.4, "stribeck"), trial(2.7, "coil_lag"), trial(2.97, "drift")
    pair = trial(1.5, "stribeck", "coil_lag")
    rows = gains_of(finding(*singles, together=pair))
    assert [row["effects"] for row in rows] == [
        ["stribeck"],
        ["coil_lag"],
        ["stribeck", "coil_lag"],
    ]
    assert [row["gain"] for row in rows] == [0.2, 0.1, 0.5]
    told = " ".join(sentences({"kind": "unknown", "effects": [], "reasons": [], "gains": rows}))
    assert "Stribeck effect by 20 % and coil lag by 10 %, each added alone." in told
    assert "Stribeck effect and coil lag together lower it by 50 %." in told


def test_a_pair_that_gains_no_more_than_the_best_effect_is_not_told():
    pair = trial(2.39, "stribeck", "coil_lag")
    rows = gains_of(finding(trial(2.4, "stribeck"), together=pair))
    assert [row["effects"] for row in rows] == [["stribeck"]]


def test_nothing_is_told_where_no_effect_gains_or_the_verdict_names_it():
    assert gains_of(finding(trial(2.99, "stribeck"))) == []
    assert gains_of(finding(trial(1.0, "stribeck"), kind="effect")) == []
    assert gains_of(SiteDiagnosis("damper", "unknown", (), 3.0, 3.0, 0.0, float("nan"))) == []
