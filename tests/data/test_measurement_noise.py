"""The noise of a channel told from the channel alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

from bristle.data.noise import estimate_noise, quantum, white_noise
from bristle.errors import RecordError

TIME = np.arange(6000) / 500.0


def signal(kind: str) -> NDArray[np.float64]:
    fast = 2.5 if kind == "hasty" else 1.0  # then it jumps every 14 samples or so
    phase = 2.0 * np.pi * fast * TIME
    sine = np.sin(2.0 * phase) + 0.5 * np.sin(7.3 * phase)
    if kind == "smooth":
        return sine
    if kind in ("yield", "hasty"):  # a force that jumps at each reversal
        return np.sign(np.gradient(sine)) * (1.0 + 0.3 * np.abs(sine))
    levels = np.random.default_rng(1).choice([0.0, 1.0, 3.0], 24)
    return np.repeat(levels, 250)


@pytest.mark.parametrize("kind", ["smooth", "yield", "hasty", "switched"])
@pytest.mark.parametrize("share", [0.01, 0.03])
@pytest.mark.parametrize("seed", range(4))
def test_white_noise_within_ten_percent(kind: str, share: float, seed: int) -> None:
    clean = signal(kind)
    std = share * np.std(clean)
    noisy = clean + std * np.random.default_rng(seed).standard_normal(len(clean))
    found = estimate_noise(noisy)
    assert found.std == pytest.approx(std, rel=0.1)
    assert found.colour == "white"


@pytest.mark.parametrize("steps", [0.3, 1.0, 3.0, 10.0])
def test_noise_of_a_quantised_channel_counts_the_rounding(steps: float) -> None:
    clean = signal("smooth")
    std = 0.01 * np.std(clean)
    noisy = clean + std * np.random.default_rng(5).standard_normal(len(clean))
    step = steps * std
    written = step * np.round(noisy / step)
    # The error of what was written, against what was there.
    assert white_noise(written) == pytest.approx(np.std(written - clean), rel=0.1)


def test_rounding_alone_is_step_over_root_twelve() -> None:
    clean = signal("smooth")
    written = 0.01 * np.round(clean / 0.01)
    assert quantum(written) == pytest.approx(0.01, rel=1e-9)
    assert white_noise(written) == pytest.approx(0.01 / np.sqrt(12.0), rel=0.1)


def test_noise_does_not_depend_on_scale_or_offset() -> None:
    noisy = signal("yield") + 0.02 * np.random.default_rng(2).standard_normal(len(TIME))
    once = white_noise(noisy)
    assert white_noise(-2e3 * noisy + 7e4) == pytest.approx(2e3 * once, rel=1e-6)


@pytest.mark.parametrize("cut_off", [0.9, 0.8, 0.7])
def test_low_passed_noise_is_told_by_its_level_below(cut_off: float) -> None:
    white = np.random.default_rng(3).standard_normal(len(TIME))
    sections = butter(4, cut_off, output="sos")
    found = estimate_noise(50.0 * signal("smooth") + sosfilt(sections, white))
    assert found.colour == "low-passed"
    assert found.std == pytest.approx(1.0, rel=0.1)


def test_filtered_channel_is_flagged_as_a_lower_limit() -> None:
    white = np.random.default_rng(3).standard_normal(len(TIME))
    filtered = sosfilt(butter(4, 0.07, output="sos"), white)
    found = estimate_noise(50.0 * signal("smooth") + filtered)
    assert found.colour == "hidden"
    assert found.std < np.std(filtered)


def test_filtered_channel_at_rest_shows_its_noise_there() -> None:
    white = np.random.default_rng(3).standard_normal(len(TIME))
    filtered = sosfilt(butter(4, 0.07, output="sos"), white)
    motion = np.where(TIME > 3.0, 50.0 * signal("smooth"), 0.0)
    found = estimate_noise(motion + filtered)
    assert found.colour == "resting"
    assert found.std == pytest.approx(np.std(filtered), rel=0.4)


def test_derivative_of_a_noisy_channel_is_blue() -> None:
    white = np.random.default_rng(3).standard_normal(len(TIME) + 1)
    found = estimate_noise(50.0 * signal("smooth") + np.diff(white))
    assert found.colour == "blue"


def test_rough_channel_is_flagged_as_an_upper_limit() -> None:
    found = estimate_noise(np.random.default_rng(3).standard_normal(2000))
    assert found.colour == "rough"
    assert found.std == pytest.approx(1.0, rel=0.1)


def test_no_noise_is_none() -> None:
    assert estimate_noise(np.full(500, 4.0)).colour == "none"
    assert estimate_noise(signal("switched")).std == 0.0  # three levels are no steps of writing


@pytest.mark.parametrize("bad", [np.zeros(10), np.full(100, np.nan), np.zeros((100, 2))])
def test_what_cannot_be_told_is_refused(bad: NDArray[np.float64]) -> None:
    with pytest.raises(RecordError, match="noise"):
        estimate_noise(bad)
