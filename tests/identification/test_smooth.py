"""The draws of a smoothed motion's error are as large as the error, and do not foretell it."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.identification.smoothing import GROUP, posterior_draws, smooth

DT, N, INSIDE = 0.002, 6000, slice(25, -25)
T = DT * np.arange(N)


def motion(kind, seed):
    """Return x, v, a (n,) of a motion [m, m/s, m/s2], exact derivatives of each other."""
    random = np.random.default_rng(seed)
    if kind == "lines":
        w = 2.0 * np.pi * np.exp(random.uniform(np.log(0.3), np.log(7.0), 15))
        size, phase = 0.005 / w, random.uniform(0.0, 6.28, 15)
        angle = w[:, None] * T + phase[:, None]
        return size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
    if kind == "swelling sine":
        w, s = 2.0 * np.pi * 1.7, 2.0 * np.pi * 0.11
        wave = np.array([np.sin(w * T), w * np.cos(w * T), -(w**2) * np.sin(w * T)])
        size = np.array([0.5 - 0.48 * np.cos(s * T), 0.48 * s * np.sin(s * T),
                         0.48 * s**2 * np.cos(s * T)])  # fmt: skip
        x, v = wave[0] * size[0], wave[1] * size[0] + wave[0] * size[1]
        a = wave[2] * size[0] + 2.0 * wave[1] * size[1] + wave[0] * size[2]
        return 0.01 * x, 0.01 * v, 0.01 * a
    rate = 2.0 * np.pi * 6.0 / T[-1]  # a chirp from 0 to 6 Hz
    phase, w = 0.5 * rate * T**2, rate * T
    return (
        0.01 * np.sin(phase), 0.01 * w * np.cos(phase),
        0.01 * (rate * np.cos(phase) - w**2 * np.sin(phase)),
    )  # fmt: skip


def smoothed(kind, seed, level, have, draws=GROUP):
    """Return the errors (n, 3) of a smoothed motion of known noise, and draws of them."""
    true = motion(kind, seed)
    random = np.random.default_rng(seed + 50)
    noise = (level * float(np.std(true[0])), level * float(np.std(true[1])))
    y = [true[i] + noise[i] * random.standard_normal(N) if have[i] else None for i in range(2)]
    found = smooth(y[0], y[1], DT, noise)
    drawn = posterior_draws(N, DT, noise, found.jerk, have, draws, seed, found)
    errors = np.column_stack(true) - np.column_stack([found.x, found.v, found.a])
    return errors[INSIDE], drawn[:, INSIDE]


@pytest.mark.parametrize("have", [(True, True), (True, False), (False, True)])
@pytest.mark.parametrize("level", [0.01, 0.03])
@pytest.mark.parametrize("kind", ["lines", "swelling sine", "chirp"])
def test_draws_are_as_large_as_the_error(kind, level, have):
    ratios, beyond = [], []
    for seed in (1, 2, 3):
        errors, drawn = smoothed(kind, seed, level, have)
        ratios.append(np.sqrt(np.mean(errors**2, axis=0) / np.mean(drawn**2, axis=(0, 1))))
        # The mean of the draws foretells most of the acceleration's error, their spread the rest.
        known = drawn[:, :, 2].mean(axis=0)
        left = np.std(errors[:, 2] - known)
        assert left < 0.5 * np.std(errors[:, 2])
        beyond.append(left / np.std(drawn[:, :, 2] - known))
    mean = np.mean(ratios, axis=0)
    # Where nothing but the velocity was measured, displacement is known up to its wandering alone.
    assert mean[1] == pytest.approx(1.0, abs=0.1)
    assert mean[2] == pytest.approx(1.0, abs=0.2)
    assert np.mean(beyond) == pytest.approx(1.0, abs=0.18)
    if have[0]:
        assert mean[0] == pytest.approx(1.0, abs=0.2)  # of few independent errors


def test_the_mean_of_the_draws_does_not_foretell_noise_of_the_velocity():
    errors, drawn = smoothed("lines", 4, 0.01, (True, True))
    known = drawn.mean(axis=0)
    assert np.std(errors[:, 1] - known[:, 1]) < 1.03 * np.std(errors[:, 1])


def test_every_group_of_draws_has_the_same_mean():
    _, drawn = smoothed("lines", 5, 0.01, (True, True), 2 * GROUP)
    first, second = drawn[:GROUP].mean(axis=0), drawn[GROUP:].mean(axis=0)
    assert first == pytest.approx(second, abs=1e-9 * float(np.abs(drawn).max()))


def test_what_the_smoother_takes_off_a_corner_is_in_the_draws():
    bend = 0.02  # s, over which the velocity turns: sharper than the smoother follows
    phase = (T % 1.0) - 0.5
    v = 0.02 * np.tanh(phase / bend) * np.where(np.floor(T) % 2 == 0, 1.0, -1.0)
    x = np.cumsum(v) * DT
    noise = (0.01 * float(np.std(x)), 1.0)
    random = np.random.default_rng(0)
    found = smooth(x + noise[0] * random.standard_normal(N), None, DT, noise)
    drawn = posterior_draws(N, DT, noise, found.jerk, (True, False), GROUP, 0, found)
    known = drawn.mean(axis=0)[INSIDE, 1]
    error = (v - found.v)[INSIDE]
    assert np.std(error - known) < 0.95 * np.std(error)
