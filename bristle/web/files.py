"""Writes what is exported for the web: modules, texts, loaders."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..data.files import write_whole
from ..errors import BuildError, StudyError

LOADERS = Path(__file__).parent
"""Folder with the loaders, and what pages are made of."""


def write_files(folder: Path, contents: Mapping[str, str | bytes]) -> list[Path]:
    """Write files into a folder, made if missing; return them in their order.

    Raises
    ------
    BuildError
        If one cannot be written.
    """
    try:
        for name, content in contents.items():
            write_whole(folder / name, content)
    except StudyError as error:
        raise BuildError(str(error)) from None
    return [folder / name for name in contents]


def loader(*names: str) -> dict[str, str]:
    """Return the texts of loaders by name."""
    return {name: (LOADERS / name).read_text(encoding="utf-8") for name in names}
