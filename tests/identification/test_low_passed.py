"""The low-pass of errors: no phase, half the power twice at its cut-off."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.errors import RecordError
from bristle.identification.low_passed import low_pass

DT, N = 0.004, 3000
T = np.arange(N) * DT


def test_the_filter_has_no_phase_and_halves_the_power_twice_at_its_cut_off():
    slow, fast = (np.sin(2.0 * np.pi * f * T) for f in (5.0, 60.0))
    inner = slice(N // 4, -N // 4)
    assert low_pass(slow, DT)[inner] == pytest.approx(slow[inner], abs=1e-4)
    assert np.max(np.abs(low_pass(fast, DT)[inner])) < 1e-3
    at = low_pass(np.sin(2.0 * np.pi * 18.0 * T), DT)[inner]
    assert np.max(np.abs(at)) == pytest.approx(0.5, rel=0.01)  # 1/sqrt(2), forth and back
    assert np.array_equal(low_pass(fast, DT, 0.0), fast)
    with pytest.raises(RecordError, match="cut-off"):
        low_pass(fast, DT, -1.0)
