"""Commands as a user gives them: their answer as JSON, and what they print."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from bristle.cli import main

Capture = pytest.CaptureFixture[str]


def asked(capsys: Capture, *words: str | Path, code: int = 0) -> Any:
    """Return a command's answer as JSON holds it."""
    capsys.readouterr()
    assert main([*map(str, words), "--json"]) == code
    return json.loads(capsys.readouterr().out)


def told(capsys: Capture, *words: str | Path, code: int = 0) -> str:
    """Return what a command prints for people, in one line."""
    capsys.readouterr()
    assert main([*map(str, words)]) == code
    captured = capsys.readouterr()
    return " ".join((captured.out if code == 0 else captured.err).split())
