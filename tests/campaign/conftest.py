"""A short ensemble that every test of this folder may run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

TEXT = """
schema = 1
scenario = "half_sine_pulse"
runs = 12
seed = 7

[set]
"run.stop" = 0.5

[vary]
"damper.sigma_a" = { normal = [650.0, 65.0], within = [500.0, 800.0] }
"voltage.level" = { each = [0.0, 4.0] }
"structure.building.masses.2" = { uniform = [1.1, 1.4] }

[outputs]
"structure.floor2_acceleration_absolute" = ["peak", "rms"]
"damper.force" = ["max"]
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes the ensemble with texts replaced, and returns its file."""

    def writer(*replaced: tuple[str, str], name: str = "mine.toml") -> Path:
        text = TEXT
        for old, new in replaced:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / name
        path.write_text(text)
        return path

    return writer
