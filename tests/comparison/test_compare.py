"""A model held against runs: z, bands, regimes, sentences that match the numbers, refusals."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from predictions_made import DT, motion, predictions_with

from bristle.comparison.comparison import compare_predictions
from bristle.comparison.predictions import halved, run_predictions
from bristle.comparison.view import draw_pattern, worst_window
from bristle.data.left_out import MISSING
from bristle.errors import RecordError
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.identification.smoothing import posterior_draws, smooth
from bristle.model.model import Model


def bench(law="lugre", values=None, n=4000, count=3, noise=0.01, skip=25):
    """Return runs of a damper whose model is known, all channels noisy, motion smoothed."""
    runs = []
    for k in range(count):
        random = np.random.default_rng(50 + k)
        x, v, a, V = motion(n, 7 * k + 1)
        force = DamperForces(law, []).force(x, v, a, V, DT, values or {})
        sizes = noise * np.std(x), noise * np.std(v), noise * np.std(force)
        noisy = [
            y + s * random.standard_normal(n) for y, s in zip((x, v, force), sizes, strict=True)
        ]
        found = smooth(noisy[0], noisy[1], DT, sizes[:2])
        draws = np.zeros((12, n, 4))
        draws[:, :, :3] = posterior_draws(n, DT, sizes[:2], found.jerk, (True, True), 12, k)
        runs.append(
            Run(f"run_{k}", DT, found.x, found.v, found.a, V, noisy[2], sizes[2], draws, skip)
        )
    return Problem(runs)


@pytest.mark.parametrize("size", [1.0, 2.5])
@pytest.mark.parametrize("phi", [0.0, 0.9])
def test_z_is_the_size_of_the_error_over_the_noise(size, phi):
    found = compare_predictions(predictions_with(size=size, phi=phi, n=6000))
    low, high = found.z_interval
    # Huber's scale reads a Gaussian error as its RMS only up to about k = 2.
    expected = 1.0 if size == 1.0 else pytest.approx(2.1, abs=0.25)
    assert found.z == (pytest.approx(1.0, abs=0.08) if size == 1.0 else expected)
    assert low < found.z < high
    assert found.total.rms == pytest.approx(0.05 * size, rel=0.1)
    assert found.first is None


def test_the_truth_is_right_within_its_noise_and_a_wrong_model_is_not():
    problem = bench()
    truth = compare_predictions(run_predictions(problem, Model("lugre")))
    assert 0.9 < truth.z < 1.1
    wrong = compare_predictions(run_predictions(problem, Model("lugre", (), {"sigma_2": 200.0})))
    assert wrong.z > 1.5 * truth.z
    assert {"speed", "velocity"} & {wrong.first.coordinate, *wrong.first.alike}
    assert wrong.total.rms > truth.total.rms


def test_fit_and_variance_accounted_for_are_their_definitions():
    found = compare_predictions(run_predictions(bench(), Model("lugre", (), {"sigma_2": 200.0})))
    parts = [(one.measured[one.skip :], one.residual) for one in found.predictions]
    measured, residual = (np.concatenate(group) for group in zip(*parts, strict=True))
    about = np.sqrt(np.sum((measured - measured.mean()) ** 2))
    assert found.total.fit == pytest.approx(1.0 - np.sqrt(np.sum(residual**2)) / about, rel=1e-12)
    assert found.total.accounted == pytest.approx(1.0 - np.var(residual) / np.var(measured))
    assert found.as_dict()["total"]["fit"] == found.total.fit


def test_the_numerical_error_falls_with_the_step():
    run = bench(count=1, noise=1e-6).runs[0]
    finer = halved(run)
    coarse = run_predictions(Problem([run]), Model("lugre"))[0]
    fine = run_predictions(
        Problem([replace(finer, draws=np.zeros((1, len(finer.x), 4)))]), Model("lugre")
    )[0]
    moving = slice(100, None)
    assert np.std(coarse.numerical[moving]) > 0.0
    assert np.std(fine.numerical[moving]) < 0.6 * np.std(coarse.numerical[moving])


def test_halving_the_step_of_a_cubic_motion_is_exact():
    t = np.arange(50) * 0.1
    x, v, a = t**3 - t, 3.0 * t**2 - 1.0, 6.0 * t
    run = Run("r", 0.1, x, v, a, t, x, 1.0, np.zeros((0, 50, 4)))
    s = np.arange(99) * 0.05
    assert halved(run).x == pytest.approx(s**3 - s, abs=1e-12)
    assert halved(run).v == pytest.approx(3.0 * s**2 - 1.0, abs=1e-12)
    assert pytest.approx(s, abs=1e-12) == halved(run).V


def test_samples_that_were_filled_in_do_not_count():
    problem = bench(count=1)
    run = problem.runs[0]
    force = run.force.copy()
    force[1000:1004] += 50.0
    known = np.ones(len(force), dtype=bool)
    known[1000:1004] = False
    spoilt = Problem([replace(run, force=force)])
    marked = Problem([replace(run, force=force, left_out={MISSING: ~known})])
    assert compare_predictions(run_predictions(spoilt, Model("lugre"))).total.rms > 1.0
    clean = compare_predictions(run_predictions(problem, Model("lugre")))
    found = compare_predictions(run_predictions(marked, Model("lugre")))
    assert found.total.rms == pytest.approx(clean.total.rms, rel=0.02)


def test_white_noise_is_at_its_floor_in_every_band():
    found = compare_predictions(predictions_with(n=6000))
    assert all(band.z == pytest.approx(1.0, abs=0.35) for band in found.spectrum.bands)
    assert sum(band.p < 0.01 for band in found.spectrum.bands) <= 1
    assert found.spectrum.noise[5:] == pytest.approx(2.0 * 0.05**2 * DT, rel=1e-9)
    power = np.trapezoid(found.spectrum.residual, found.spectrum.frequency)
    assert power == pytest.approx(0.05**2, rel=0.1)


def test_an_error_that_depends_on_an_extra_channel_is_told_in_its_unit():
    def plant(along):
        return 0.4 * (along["oil_pressure"] > 3e6)

    found = []
    for one in predictions_with(n=6000):
        pressure = 3e6 + 1e6 * np.sin(0.9 * np.arange(6000) * DT)
        along = {**one.coordinates, "oil_pressure": pressure}
        error = plant(along)
        found.append(
            replace(
                one, coordinates=along, measured=one.measured + error, units={"oil_pressure": "Pa"}
            )
        )
    comparison = compare_predictions(found)
    assert comparison.first.coordinate == "oil_pressure"
    text = comparison.sentences[1]
    assert text.startswith("The error depends mainly on oil pressure")
    assert "above 3.1 MPa the force is up to 0.4 N higher than the model's" in text
    comparison.plot()


def test_a_tone_is_in_its_band():
    def tone(along):
        return 0.1 * np.sin(2.0 * np.pi * 3.0 * along["time"])

    found = compare_predictions(predictions_with(tone, n=6000))
    loudest = max(found.spectrum.bands, key=lambda band: band.share)
    assert loudest.low <= 3.0 < loudest.high
    assert loudest.share > 0.9
    assert loudest.p < 1e-6
    assert "3" in f"{loudest.low:g}" or loudest.low < 3.0 < loudest.high


def numbers(text):
    return [float(word) for word in re.findall(r"(?<![\w.])\d+\.?\d*(?:e-?\d+)?", text)]


def test_sentences_say_the_numbers_of_a_spring_that_is_missing():
    held = predictions_with(lambda c: 40.0 * c["displacement"])
    found = compare_predictions(held)
    how, where, right = found.sentences
    assert how.startswith("On held-out runs the model misses the force by")
    rms, share, z = numbers(how)[:3]
    assert rms == pytest.approx(found.total.rms, rel=0.05)
    assert share == pytest.approx(100.0 * found.total.share, rel=0.05)
    assert z == pytest.approx(found.z, rel=0.005)
    assert "depends mainly on displacement" in where
    assert "pushes back up to" in where
    assert "more than the model" in where
    assert "to either side" in where
    edge, amount = numbers(where)[:2]
    top = max(abs(found.first.mean))
    assert amount == pytest.approx(top, rel=0.15)
    # Beyond the edge the mean error is at least half of the largest.
    beyond = np.abs(found.first.centre) > 1e-3 * edge
    assert np.abs(found.first.mean[beyond]).min() > 0.4 * top
    assert "the same at every voltage" in where
    assert "The model is nowhere right within its noise" in right or "it is right within" in right


def test_a_softer_spring_pushes_back_less():
    where = compare_predictions(predictions_with(lambda c: -40.0 * c["displacement"])).sentences[1]
    assert re.search(r"pushes back up to [\d.]+ N less than the model", where)


def test_an_error_that_grows_with_voltage_is_said_to():
    held = predictions_with(lambda c: 15.0 * c["displacement"] * c["voltage"])
    where = compare_predictions(held).sentences[1]
    assert "more at high voltage" in where


def test_more_resistance_at_high_speed():
    held = predictions_with(lambda c: 300.0 * c["velocity"] * np.abs(c["velocity"]))
    where = compare_predictions(held).sentences[1]
    assert re.search(r"above [\d.]+ mm/s the damper resists up to [\d.]+ N more", where)


def test_where_it_is_right_is_said():
    held = predictions_with(
        lambda c: np.where(c["speed"] > 0.05, 0.3 * c["direction"], 0.0), n=6000
    )
    found = compare_predictions(held)
    right = [one for one in found.regimes if one.right]
    assert right
    assert found.sentences[2].startswith("At low speed")
    assert "right within its noise" in found.sentences[2]
    assert numbers(found.sentences[2])[-1] < 1.1 or "and so it is" in found.sentences[2]


def test_nothing_is_said_of_noise():
    found = compare_predictions(predictions_with(n=6000))
    assert "which the noise explains" in found.sentences[0]
    assert found.sentences[1] == "The remaining error looks like noise along every coordinate."
    assert found.sentences[2].startswith("It is right within its noise at every speed and voltage")


def test_the_runs_of_the_fit_are_called_so():
    held = predictions_with()
    assert compare_predictions(held, seen=True).sentences[0].startswith("On the training runs")
    assert compare_predictions(held, seen=None).sentences[0].startswith("In this measurement")


def test_the_comparison_is_json_and_the_same_again():
    held = predictions_with(lambda c: 40.0 * c["displacement"])
    first, again = (json.dumps(compare_predictions(held).as_dict()) for _ in range(2))
    assert first == again
    answer = json.loads(first)
    assert answer["places"][0]["coordinate"] == "displacement"
    assert answer["places"][0]["significant"] is True
    assert {"z", "z_interval", "runs", "bands", "regimes", "sentences"} <= set(answer)


def test_without_any_run_there_is_nothing_to_compare():
    with pytest.raises(RecordError, match="no run"):
        compare_predictions([])


def test_a_prediction_that_is_not_finite_is_refused_with_its_time():
    one = predictions_with(count=1)[0]
    predicted = one.predicted.copy()
    predicted[500] = np.nan
    with pytest.raises(RecordError, match=r"run_0: the predicted force is nan at 1 s"):
        compare_predictions([replace(one, predicted=predicted)])


def test_a_channel_without_noise_is_refused():
    one = predictions_with(count=1)[0]
    with pytest.raises(RecordError, match=r"noise of the force is zero"):
        compare_predictions([replace(one, sigma=np.zeros_like(one.sigma))])


def test_a_short_run_is_refused():
    with pytest.raises(RecordError, match="100 samples"):
        compare_predictions(predictions_with(count=1, n=100))


def test_an_output_with_a_name_of_its_own_is_called_by_it_and_a_large_rig_has_kilonewtons():
    held = [
        replace(
            one, quantity="F_kN", measured=1e5 * one.measured, predicted=1e5 * one.predicted,
            noise=1e5 * one.noise, sigma=1e5 * one.sigma,
        )
        for one in predictions_with(lambda c: -40.0 * c["displacement"])
    ]  # fmt: skip
    how, where, right = compare_predictions(held).sentences
    assert 'misses the output "F_kN" by ' in how
    assert re.search(r"by [\d.]+ kN \([\d.]+ %\), ", how)
    assert " kN more" in where or " kN less" in where
    assert not re.search(r"\de[+-]\d", how + where + right)


def test_the_axis_of_a_signal_far_from_zero_begins_where_its_data_do():
    predictions = predictions_with(lambda along: 0.1 * along["displacement"] / 0.01)
    warm = [
        replace(
            one, coordinates={**one.coordinates, "temperature": 29.0 + 4.0 * np.sin(one.time)},
            units={**one.units, "temperature": "degC"},
        )
        for one in predictions
    ]  # fmt: skip
    found = compare_predictions(warm)
    pattern = next(one for one in found.patterns if one.coordinate == "temperature")
    axes = Figure().add_subplot()
    draw_pattern(axes, found, pattern)
    assert axes.get_xlim()[0] > 20.0


def test_samples_that_do_not_count_make_no_error_smaller():
    def beyond(along):
        return 2.0 * (np.abs(along["displacement"]) > 0.004) * np.sign(along["displacement"])

    whole = predictions_with(beyond)
    random = np.random.default_rng(3)
    lost = [
        (np.abs(one.coordinates["displacement"]) > 0.004) & (random.random(4000) < 0.6)
        for one in whole
    ]
    some = [replace(one, known=~gone) for one, gone in zip(whole, lost, strict=True)]
    all_of_it, found = compare_predictions(whole), compare_predictions(some)
    assert found.first.coordinate == all_of_it.first.coordinate == "displacement"
    assert np.max(np.abs(found.first.mean)) == pytest.approx(2.0, abs=0.1)
    assert found.first.share > 0.8
    assert max(one.samples for one in found.regimes) < sum(4000 - 25 for _ in whole)
    quiet = [replace(one, known=random.random(4000) < 0.5) for one in predictions_with()]
    assert [band.z for band in compare_predictions(quiet).spectrum.bands] == pytest.approx(
        [1.0] * len(found.spectrum.bands), abs=0.2
    )


def test_the_worst_stretch_is_one_that_counts():
    (one,) = predictions_with(count=1)
    measured, known = one.measured.copy(), np.ones(4000, dtype=bool)
    measured[1000:1600] += 5.0
    known[1000:1600] = False
    measured[2000:2600] += 1.0
    window = worst_window(replace(one, measured=measured, known=known))
    assert window == slice(2000, 2600)
