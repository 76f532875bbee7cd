"""Fixtures that several folders share: toy FMUs, and scenarios made of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from toys import Maker, build_toys


@pytest.fixture(scope="session")
def toys(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the toy FMUs by name, built once."""
    return build_toys(tmp_path_factory.mktemp("toys"))


@pytest.fixture
def scenario_of(toys: dict[str, Path], tmp_path: Path) -> Maker:
    """Return a function that writes a scenario of toys and returns its file."""
    return Maker(toys, tmp_path)
