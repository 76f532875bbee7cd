"""Pack what a bug report needs, without measurements; show it first.

Packed are versions, the study's text files (settings, model, history, verdict, effects and laws of
your own), the shape of each run (names, units, samples, sampling), and the last traceback that
bristle kept. Read it before you send it: titles, notes and file names are yours.
"""

from __future__ import annotations

import argparse
import platform
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from ..core.text import plain
from ..errors import BristleError, StudyError
from ._options import Parser, print_json

HELP = "pack what a bug report needs, without measurements"
TEXTS = (
    "study.toml", "*model*.toml", "*building*.toml", "verdict.json", "history/**/*.toml",
    "history/**/*.json", "effects/*.py", "laws/*.py",
)  # fmt: skip
"""What is taken from a study's folder; figures and reports show measurements."""
_OF_DEVELOPERS = ("test", "docs", "dev", "benchmarks")
LARGEST = 500_000
"""Largest text that is packed [bytes]."""


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle bug-report`."""
    text = "the study; without one, versions and the last traceback alone"
    parser.add_argument("folder", nargs="?", type=Path, metavar="FOLDER", help=text)
    text = "file to write; else bristle_bug_report.zip"
    parser.option("--out", "FILE.zip", text, type=Path, default=Path("bristle_bug_report.zip"))
    parser.flag("--yes", "write it without asking")
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Show what would be packed; pack it with the user's consent."""
    from ..fmu.archive import write_archive

    members = {"versions.txt": _versions()}
    left_out: list[str] = []
    if arguments.folder is not None:
        if not (arguments.folder / "study.toml").is_file():
            raise StudyError(f"{arguments.folder}: no study: there is no study.toml in it.")
        for name, path in _texts(arguments.folder):
            if path.stat().st_size > LARGEST:
                left_out.append(f"{name}: larger than {LARGEST // 1000} kB")
            else:
                members[f"study/{name}"] = path.read_text(encoding="utf-8", errors="replace")
        members["shapes.txt"] = _shapes(arguments.folder)
    if last := _last_traceback():
        members["traceback.txt"] = last.read_text(encoding="utf-8", errors="replace")
    if not arguments.json:
        print(f"{arguments.out} will hold these files, and no measurement:\n")
        for name, text in members.items():
            print(f"  {name}  {len(text.encode())} bytes")
        for name in ("versions.txt", "shapes.txt"):
            if name in members:
                print(f"\n{name}:\n  " + members[name].rstrip().replace("\n", "\n  "))
        print("".join(f"\nLeft out: {one}" for one in left_out))
    write = arguments.yes or (not arguments.json and _asked())
    if write:
        try:
            write_archive(arguments.out, {name: text.encode() for name, text in members.items()})
        except OSError as error:
            raise StudyError(
                f"{arguments.out}: cannot be written ({error.strerror or error})."
            ) from None
    if arguments.json:
        file = str(arguments.out.absolute()) if write else None
        print_json({"file": file, "members": [*members], "left_out": left_out})
    else:
        print(f"{arguments.out}: written." if write else "Nothing was written; --yes writes it.")
    return 0


def _asked() -> bool:
    """Return whether the user consents; nobody is asked where there is no terminal."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return False
    print("Write it? [y/N] ", end="", flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _versions() -> str:
    """Return the versions of bristle, of Python and of what bristle needs, a line each."""
    from ..version import __version__

    lines = [f"bristle {__version__}", f"Python {platform.python_version()}", platform.platform()]
    try:
        needed = metadata.requires("bristle") or []
    except metadata.PackageNotFoundError:
        needed = []
    named = [_name(one) for one in needed if not any(f"'{own}'" in one for own in _OF_DEVELOPERS)]
    for name in dict.fromkeys(named):
        try:
            lines.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            lines.append(f"{name}: not installed")
    return "\n".join(lines) + "\n"


def _name(requirement: str) -> str:
    """Return the name of the package that a requirement is about."""
    length = next(
        (k for k, letter in enumerate(requirement) if not (letter.isalnum() or letter in "-_.")),
        len(requirement),
    )
    return requirement[:length]


def _texts(folder: Path) -> Iterator[tuple[str, Path]]:
    """Return name and path of the study's text files."""
    found = {file for pattern in TEXTS for file in folder.glob(pattern) if file.is_file()}
    for file in sorted(found):
        yield file.relative_to(folder).as_posix(), file


def _shapes(folder: Path) -> str:
    """Return name, length, sampling, channels and units of each run; no value of any."""
    from ..study.study import Study

    try:
        runs = Study(folder).runs()
    except BristleError as error:
        return f"The runs cannot be read: {type(error).__name__}: {error}\n"
    lines, before = [], ""
    for role, of_role in (("train", runs.train), ("holdout", runs.holdout)):
        for run in of_role:
            step = plain(float(run.time[1] - run.time[0])) if len(run.time) > 1 else "?"
            named = ", ".join(f"{name} [{run.units[name]}]" for name in run.channels)
            lines += [f"channels: {named}"] if named != before else []
            lines.append(f"{run.name} ({role}): {len(run.time)} samples every {step} s")
            before = named
    return "\n".join([*lines, *runs.notes]) + "\n"


def _last_traceback() -> Path | None:
    """Return the newest traceback that bristle kept, None where there is none."""
    from ._failure import folders

    kept = [file for folder in folders() for file in folder.glob("*.txt")]
    return max(kept, key=lambda file: file.name, default=None)
