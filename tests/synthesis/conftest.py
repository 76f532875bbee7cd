"""The reference designs, made once."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.synthesis import DesignResult, Task, design


@pytest.fixture(scope="session")
def hinf() -> DesignResult:
    """Return the H-infinity design of the paper's building."""
    return design(Task("hinf"))


@pytest.fixture(scope="session")
def lpv() -> DesignResult:
    """Return the LPV design with constant X and Y."""
    return design(Task("lpv"))


@pytest.fixture(scope="session")
def lqg() -> DesignResult:
    """Return the LQG design."""
    return design(Task("lqg"))


@pytest.fixture(scope="session")
def frozen() -> Path:
    """Return the folder of the frozen controller files."""
    return Path(__file__).parents[1] / "reference" / "controllers"
