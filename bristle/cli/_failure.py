"""What is told of an error that nobody foresaw: one line, and a file with the traceback."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
import time
import traceback
from contextlib import suppress
from pathlib import Path

KEPT = 20
"""How many tracebacks are kept."""


def line(error: Exception, command: str) -> str:
    """Return one line about an error, with the file that holds its traceback."""
    what = " ".join(f"{type(error).__name__}: {error}".split())[:200].rstrip(": ")
    said = f"bristle {command}: an unexpected error ({what})."
    file = _keep(error)
    if file is None:
        return f"{said} Its traceback could not be written; --debug shows it."
    return f"{said} Please report it with what  bristle bug-report  packs, its traceback: {file}"


def folders() -> tuple[Path, Path]:
    """Return where tracebacks are kept, and where they are if nothing can be written there."""
    from ..core.files import state_folder

    return state_folder() / "errors", Path(tempfile.gettempdir()) / "bristle-errors"


def _keep(error: Exception) -> Path | None:
    """Write a traceback among those of this user; return the file, None where none can be."""
    from ..version import __version__

    lines = [
        f"bristle {__version__}, Python {platform.python_version()}, {platform.platform()}",
        f"arguments: {sys.argv[1:]}",
        "",
        *traceback.format_exception(error),
    ]
    name = f"{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.txt"
    for folder in folders():
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            file = folder / name
            file.write_text("\n".join(lines), encoding="utf-8")
            for old in sorted(folder.glob("*.txt"))[:-KEPT]:
                old.unlink(missing_ok=True)
            return file
    return None
