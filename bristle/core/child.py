"""A fresh interpreter that does one piece of work, with the bristle that asks for it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

_ROOT = str(Path(__file__).resolve().parents[2])


def in_child(
    code: str, order: object, timeout: float | None = None, more: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Return what became of a process, with all that it said.

    Parameters
    ----------
    code : Python, which finds the order on its standard input
    order : plain data, which stands there as JSON
    timeout : after which the process is ended [s]; None: never
    more : variables of its environment beside those of this process

    Raises
    ------
    subprocess.TimeoutExpired
        If it was ended.
    """
    path = os.pathsep.join([_ROOT, os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-c", code], input=json.dumps(order), capture_output=True, text=True,
        env={**os.environ, **(more or {}), "PYTHONPATH": path}, check=False, timeout=timeout,
    )  # fmt: skip
