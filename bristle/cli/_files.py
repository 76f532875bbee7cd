"""The measurement files that patterns on the command line name, and the channels in them."""

from __future__ import annotations

import argparse
from fnmatch import fnmatchcase
from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..data.channels import ChannelSpec


def add_run_facts(parser: argparse.ArgumentParser) -> None:
    """Add what is known of whole runs beside their files."""
    for option, value, text in (
        ("--level", "PATTERN", "the command's level in the names of files, {} in its place: "
         "--level 'I{}A'"),
        ("--label", "NAME=PATTERN", "other labels in the names of files: --label 'oil=batch{}'"),
    ):  # fmt: skip
        parser.add_argument(option, action="append", default=[], metavar=value, help=text)
    parser.add_argument(
        "--runs", type=Path, metavar="FILE",
        help="a table with a row per run: file, role, current [A], temperature [degC], ...",
    )  # fmt: skip


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


def channels_of(texts: list[str]) -> dict[str, ChannelSpec]:
    """Return where channels are, as --channel says; StudyError where one is given twice."""
    from ..errors import StudyError
    from ..study.new import parse_channel

    channels: dict[str, ChannelSpec] = {}
    for text in texts:
        name, spec = parse_channel(text)
        if name in channels:
            raise StudyError(f"--channel {name} is given twice; once is right.")
        channels[name] = spec
    return channels


def _matches(pattern: str) -> list[str]:
    """Return the files that a pattern names, in order."""
    # pathlib takes no pattern that begins at the root.
    matches = sorted(glob(pattern, recursive=True))  # noqa: PTH207
    matches = [pattern] if Path(pattern).is_file() else matches
    return [match for match in matches if Path(match).is_file()]


def files_of(patterns: list[str], option: str = "--data ") -> list[str]:
    """Return the files that patterns name, or that folders hold, each once, in order.

    Parameters
    ----------
    patterns : of the files
    option : what stands before them on the command line, for messages
    """
    from ..data.read import files_in
    from ..errors import StudyError

    found: list[str] = []
    for pattern in patterns:
        if Path(pattern).is_dir():
            found += map(str, files_in(Path(pattern)))
            continue
        files = _matches(pattern)
        if not files:
            raise StudyError(f'{option}"{pattern}": no file matches, seen from {Path.cwd()}.')
        found += files
    return list(dict.fromkeys(found))
