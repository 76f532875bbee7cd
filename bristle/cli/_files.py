"""The measurement files that patterns on the command line name."""

from __future__ import annotations

from fnmatch import fnmatchcase
from glob import glob
from pathlib import Path


def test_files(patterns: list[str], files: list[str]) -> list[str]:
    """Return the files of the test runs: names among the files of --data, or files of their own."""
    from ..errors import StudyError

    found: list[str] = []
    for pattern in patterns:
        named = [file for file in files if fnmatchcase(Path(file).name, pattern)]
        matches = named or _matches(pattern)
        if not matches:
            raise StudyError(
                f'--test "{pattern}": no file of --data has such a name, and no other file '
                f"matches, seen from {Path.cwd()}."
            )
        found += matches
    return list(dict.fromkeys(found))


def _matches(pattern: str) -> list[str]:
    """Return the files that a pattern names, in order."""
    # pathlib takes no pattern that begins at the root.
    matches = sorted(glob(pattern, recursive=True))  # noqa: PTH207
    matches = [pattern] if Path(pattern).is_file() else matches
    return [match for match in matches if Path(match).is_file()]


def files_of(patterns: list[str]) -> list[str]:
    """Return the files that patterns name, or that folders hold, each once, in order."""
    from ..data.read import files_in
    from ..errors import StudyError

    found: list[str] = []
    for pattern in patterns:
        if Path(pattern).is_dir():
            found += map(str, files_in(Path(pattern)))
            continue
        files = _matches(pattern)
        if not files:
            raise StudyError(f'--data "{pattern}": no file matches, seen from {Path.cwd()}.')
        found += files
    return list(dict.fromkeys(found))
