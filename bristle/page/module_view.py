"""View 7, Simulate: the WebAssembly module by which a page runs scenarios itself.

It is compiled once for all scenarios, which takes a minute or two: a process of its own does it, so
that views are answered meanwhile.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..export.web_module import module


def answer(folder: Path, arguments: Mapping[str, Any]) -> bytes:
    """Return the module.

    Parameters
    ----------
    folder : is not used
    arguments : none are taken

    Raises
    ------
    BuildError
        If zig is not installed, or cannot compile.
    """
    return module()
