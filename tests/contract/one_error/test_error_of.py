"""What the error is: RMS(measured - predicted) / RMS(measured), both over the same samples."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bristle.data.left_out import LOADED, MASKED, MISSING, SATURATED, SETTLING
from bristle.errors import RecordError
from bristle.identification.error import ForceError, error_of, pooled, refuse_empty
from bristle.identification.problem import Problem, Run
from bristle.identification.rig import Site
from bristle.identification.rig_fit import SiteModel, force_errors
from bristle.model.model import Model

N = 10_000
LAW = Model("bingham")
RANDOM = np.random.default_rng(3)
FORCE = 50.0 * np.sin(0.01 * np.arange(N))
WRONG = FORCE + RANDOM.normal(0.0, 2.0, N)


def first(count: int, start: int = 0) -> np.ndarray:
    place = np.arange(N)
    return (place >= start) & (place < start + count)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_what_is_left_out_is_out_of_numerator_and_denominator():
    spoilt = FORCE.copy()
    spoilt[500:600] = 1e4
    error = error_of(spoilt, WRONG, {SATURATED: first(100, 500)})
    kept = ~first(100, 500)
    assert (error.samples, error.total, error.left_out) == (N - 100, N, {SATURATED: 100})
    assert error.rms == rms((FORCE - WRONG)[kept])
    assert error.share == rms((FORCE - WRONG)[kept]) / rms(FORCE[kept])
    assert error.share_all > 0.9  # over all of them, 1 % of the samples is nearly everything


def test_a_sample_with_two_reasons_is_counted_once():
    error = error_of(FORCE, WRONG, {SETTLING: first(25), SATURATED: first(10), MISSING: first(5)})
    assert error.left_out == {MISSING: 5, SATURATED: 5, SETTLING: 15}
    assert sum(error.left_out.values()) == error.total - error.samples


def test_runs_are_pooled_sample_by_sample():
    flags = {SETTLING: first(25), MISSING: first(300, 4000)}
    whole = error_of(FORCE, WRONG, flags)
    cuts = [slice(0, 1000), slice(1000, 4100), slice(4100, N)]
    parts = [error_of(FORCE[c], WRONG[c], {k: v[c] for k, v in flags.items()}) for c in cuts]
    joined = pooled(parts)
    assert (joined.samples, joined.total, joined.left_out) == (N - 325, N, whole.left_out)
    for key in ("rms", "signal", "rms_all", "signal_all"):
        assert getattr(joined, key) == pytest.approx(getattr(whole, key), rel=1e-12)


@pytest.mark.parametrize(
    ("count", "beside"),
    [
        (0, []),
        (12, ["12 of 10,000 samples (0.12 %) left out: saturated."]),
        (300, ["300 of 10,000 samples (3 %) left out: saturated. Over all samples the error is "]),
        (6990, ["Warning: 6,990 of 10,000 samples (70 %) left out: saturated. So the error "]),
    ],
)  # fmt: skip
def test_count_share_and_reason_stand_beside_the_number(count, beside):
    error = error_of(FORCE, 1.5 * FORCE, {SATURATED: first(count)})
    told = error.beside()
    assert [text[: len(start)] for text, start in zip(told, beside, strict=True)] == beside
    assert error.over_all is (count == 6990)


def test_above_a_fifth_the_error_over_all_samples_is_the_error_with_a_way_out():
    bad = np.where(first(3000), 10.0 + FORCE, FORCE)
    error = error_of(FORCE, bad, {SATURATED: first(3000)})
    assert error.rms == 0.0
    assert error.headline == (error.rms_all, error.share_all)
    assert error.text() == f"{error.rms_all:.3f} N ({100 * error.share_all:.1f} %)"
    (told,) = error.beside()
    assert "over the 7,000 that are left it is 0 N (0.0 %)" in told
    assert "measure with a wider range, or leave the run out" in told


def test_where_nothing_was_measured_is_in_no_error():
    holed = np.where(first(3000), 1e6, FORCE)
    error = error_of(holed, WRONG, {MISSING: first(2000), MASKED: first(1000, 2000)})
    assert error.rms_all == error.rms == rms((FORCE - WRONG)[3000:])
    assert not error.over_all
    (told,) = error.beside()
    assert told.startswith("Warning: 3,000 of 10,000 samples (30 %) left out: 2,000 missing, ")


def test_no_sample_left_is_said():
    error = error_of(FORCE, WRONG, {LOADED: first(N)})
    assert error.samples == 0
    assert error.headline[0] == error.rms_all
    assert "over the 0 that are left it is unknown" in error.beside()[0]


def test_a_prediction_that_is_not_finite_has_an_infinite_error_and_plain_json():
    error = error_of(FORCE, np.where(first(1), np.nan, WRONG), {})
    assert error.rms == float("inf")
    assert json.loads(json.dumps(error.as_dict(), allow_nan=False))["rms"] is None


def test_what_json_tells_is_the_error_again():
    error = error_of(FORCE, WRONG, {SETTLING: first(25), SATURATED: first(4000, 100)})
    assert ForceError.of(json.loads(json.dumps(error.as_dict()))) == error


class Broken(Problem):
    """A run whose model ends in what is no number."""

    def predict(self, model, run, draw=None):
        return np.where(np.arange(len(run.force)) > 500, np.nan, run.force)


def test_an_error_that_is_not_finite_on_a_run_is_one_clear_message():
    still = np.zeros(N)
    run = Run("drive_7", 0.002, still, still, still, still, FORCE, 1.0, np.zeros((0, N, 4)))
    at = SiteModel(Site("damper", lambda role: Broken([run]) if role == "train" else None), LAW)
    with pytest.raises(RecordError, match="drive_7: the force of the model bingham is not finite"):
        force_errors({"damper": at})


def test_runs_of_which_nothing_is_left_are_refused_with_run_count_reason_and_way_out():
    still = np.zeros(N)
    parts = (0.002, still, still, still, still, FORCE, 1.0, np.zeros((0, N, 4)))
    runs = [
        Run(name, *parts, left_out={SATURATED: first(N - 10 * k)})
        for k, name in enumerate(("a", "b"))
    ]
    with pytest.raises(RecordError) as told:
        refuse_empty(runs)
    assert str(told.value) == (
        "a: 10,000 of 10,000 samples (100.0 %) left out: saturated; b: 9,990 of 10,000 samples "
        "(99.9 %) left out: saturated. 10 samples are left, and 100 are needed. To change it: "
        "measure with a wider range, or leave the run out."
    )
    refuse_empty([replace(runs[0], left_out={SATURATED: first(N - 100)})])
