"""Files of a study: written whole or not at all; JSON read."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.config import read_text
from ..errors import StudyError
from ..findings import written


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file so that there is the old one or the new one at any time, never a part.

    Raises
    ------
    StudyError
        If it cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    draft: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
        draft = Path(name)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        draft.chmod(0o666 & ~_umask())
        draft.replace(path)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({error.strerror or error}).") from None
    finally:
        if draft is not None:
            draft.unlink(missing_ok=True)


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file whole; numbers that are not finite become null."""
    write_whole(path, json.dumps(_plain(data), indent=2, ensure_ascii=False) + "\n")


def read_json(path: Path) -> dict[str, Any]:
    """Return the content of a JSON file that holds an object; StudyError if it does not."""
    try:
        found = json.loads(read_text(path, StudyError))
    except ValueError as error:
        raise StudyError(f"{path}: no JSON ({error}). Remove or correct the file.") from None
    if not isinstance(found, dict):
        raise StudyError(f"{path}: holds {written(found)}: expected an object.")
    return found


_INF = float("inf")


def _plain(value: Any) -> Any:
    """Return a value as JSON has it: numbers of numpy and tuples turned, NaN and infinity null."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and (value != value or abs(value) == _INF):
        return None
    return value


def _umask() -> int:
    """Return the process's umask, which can only be read by setting it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
