"""Options that several commands share, and what they name: files, channels, consent."""

from __future__ import annotations

import argparse
import importlib
import re
import sys
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from fnmatch import fnmatchcase
from functools import partial
from glob import glob
from math import inf
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, NoReturn

from ..core.text import did_you_mean
from ..errors import StudyError, TrustError

if TYPE_CHECKING:
    from ..data.channels import ChannelSpec
    from ..fmu.build import BuildPlan
    from ..view.blocks import View


_LEAVE = "leave it out"
GONE = {
    "--no-table": f"{_LEAVE}: there is no table any more that it would leave out",
    "--static": f"{_LEAVE}: a report has no scripts unless --what-if is given",
    "--limits": f"{_LEAVE}: --details prints the limits",
    "--cluster": f"{_LEAVE}: ensembles run on this machine",
    "--osp": f"{_LEAVE}: packages are written in SSP alone",
    "--greedy": f"{_LEAVE}: it is so without it; --proven adds only what is proven",
    "--with-limits": "bristle predict --with-limits",
    "--fmu": "bristle compare-fmu",
    "--closed-loop": "bristle predict",
    "--exclude": "bristle study roles --exclude",
    **{name: f"bristle list {name}" for name in ("effects", "laws", "components", "scenarios")},
}
"""Options and commands of checkouts before 1.0, and what takes their place."""


class Parser(argparse.ArgumentParser):
    """The parser of a command or action: it knows the options that several of them share.

    Of an option that takes a value, `value` is what help calls that; `more` is as argparse has it.
    """

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Return what the parser knows of a line; what it does not know is an error of its own.

        argparse would leave the error to `bristle`, which does not know the command's options.
        """
        known, rest = super().parse_known_args(args, namespace)
        if rest:
            options = [name for action in self._actions for name in action.option_strings]
            self.error(f"unrecognized arguments: {' '.join(rest)}.{instead(rest[0], options)}")
        return known, rest

    def error(self, message: str) -> NoReturn:
        """End the command; of a misspelt word say the one that is near, as Python 3.14 does."""
        wrong = re.match(r"argument (\S+): invalid choice: '(.*)' \(choose from (.*)\)$", message)
        if wrong:
            names = re.findall(r"[\w.-]+", wrong[3])
            near = instead(wrong[2], names) or f" There are: {', '.join(names)}."
            message = fill(f'{wrong[1]}: there is no "{wrong[2]}".{near}', 80)
        super().error(message)

    def flag(self, name: str, text: str, default: object = False) -> None:
        """Add an option that is there or not."""
        self.add_argument(name, action="store_true", default=default, help=text)

    def option(self, name: str, value: str, text: str, **more: Any) -> None:
        """Add an option that takes a value."""
        self.add_argument(name, metavar=value, help=text, **more)

    def several(self, name: str, value: str, text: str, **more: Any) -> None:
        """Add an option that may be repeated, each time with a value."""
        self.add_argument(name, metavar=value, help=text, action="append", default=[], **more)

    def add_common(self, default: object = False) -> None:
        """Add --quiet and --debug, which every command takes."""
        self.flag("--quiet", "print no progress", default=default)
        self.flag("--debug", "show the traceback of an error", default=default)

    def add_study(self) -> None:
        """Add the folder of the study that a command is about."""
        self.add_argument("folder", type=Path, metavar="FOLDER", help="the study")

    def add_json(self, text: str = "print the answer as JSON") -> None:
        """Add --json."""
        self.flag("--json", text)

    def add_no_figure(self, text: str = "draw nothing") -> None:
        """Add --no-figure."""
        self.flag("--no-figure", text)

    def add_out(self, text: str, metavar: str = "FOLDER") -> None:
        """Add --out, the file or folder that a command writes."""
        self.add_argument("-o", "--out", type=Path, metavar=metavar, help=text)

    def add_overrides(self, of: str = "file", example: str = "damper.f_c=2") -> None:
        """Add --set to a command that loads a scenario; `of` is what the values are else from."""
        text = f"use this value instead of the {of}'s, e.g. --set {example}"
        self.several("--set", "NAME=VALUE", text, dest="overrides")

    def add_dry_run(self) -> None:
        """Add --dry-run to a command that changes a study."""
        self.flag("--dry-run", "show the result; write nothing")

    def add_details(self) -> None:
        """Add --details to a command whose answer has some."""
        self.flag("--details", "print the evidence below the answer: all tables")

    def add_trust(self) -> None:
        """Add --trust to a command that may run effects of somebody's own."""
        what = "effects and laws that came with a study or scenario"
        self.flag("--trust", f"consent to run {what}; bristle remembers it")

    def add_channel(self) -> None:
        """Add --channel, which says where a channel is in a file."""
        text = (
            "the column of a channel; a minus before COLUMN reverses its sign: --channel "
            "'force=-Ch3@kN'; without @UNIT the unit is that of the title"
        )
        self.several("--channel", "CHANNEL=COLUMN@UNIT", text)

    def add_channels_of_data(self) -> None:
        """Add what says where the channels are in a study's files."""
        self.add_channel()
        text = "do not read this channel, whatever column it was taken from"
        self.several("--without", "CHANNEL", text)
        self.option("--step", "S", "sampling step in s of files without a time", type=float)

    def add_run_facts(self) -> None:
        """Add what is known of whole runs beside their files."""
        text = "the command's level in the names of files, {} in its place: --level 'I{}A'"
        self.several("--level", "PATTERN", text)
        text = "other labels in the names of files: --label 'oil=batch{}'"
        self.several("--label", "NAME=PATTERN", text)
        text = "a table with a row per run: file, role, current [A], temperature [degC], ..."
        self.option("--runs", "FILE", text, type=Path)

    def add_judged(self) -> None:
        """Add the output that is minimised, and its statistic."""
        text = "the output to minimise; else the second floor's absolute acceleration"
        default = "structure.floor2_acceleration_absolute"
        self.option("--output", "NAME", text, default=default)
        text = "its statistic; else peak"
        self.add_argument("--statistic", choices=("peak", "rms"), default="peak", help=text)

    def add_native(self) -> None:
        """Add --native, --platform and --fmi."""
        text = "FMUs that need no Python: compiled, with a library for each platform"
        self.flag("--native", text)
        text = (
            "with --native: linux64, win64, darwin64, aarch64-linux or aarch64-darwin, several "
            "separated by commas; else all"
        )
        self.several("--platform", "NAME", text, dest="platforms")
        text = "with --native: include the C sources in the FMU, for hosts that compile them"
        self.flag("--sources", text)
        text = "version of FMI; 3 needs --native (default: 2)"
        self.add_argument("--fmi", type=int, choices=(2, 3), default=2, help=text)


def instead(word: str, names: Iterable[str]) -> str:
    """Return a sentence with what is right in place of a word that is not known, or ""."""
    now = GONE.get(word.partition("=")[0])
    return f" It is gone; now: {now}." if now else did_you_mean(word, names)


def test_files(patterns: list[str], files: list[str]) -> list[str]:
    """Return the files of the test runs: names among the files of --data, or files of their own."""

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


def channels_of(texts: list[str], step: float | None = None) -> dict[str, ChannelSpec]:
    """Return where channels are, as --channel and --step say; StudyError where one is twice."""
    from ..data.channels import ChannelSpec
    from ..study.new import parse_channel

    channels = {} if step is None else {"time": ChannelSpec(step=step)}
    for text in texts:
        name, spec = parse_channel(text)
        if name == "time" and step is not None:
            raise StudyError("--step and --channel time=... exclude each other.")
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


# Modules that a command needs later, imported while compiled code is at work.


def import_ahead(*names: str) -> None:
    """Import modules in a thread of their own; what cannot be imported is told where it is needed.

    Parameters
    ----------
    names : whole names, as in "bristle.view.style"
    """

    def bring() -> None:
        for name in names:
            with suppress(Exception):
                importlib.import_module(name)

    # No daemon: an end of the process in the middle of an import would bring it down.
    threading.Thread(target=bring, name="bristle-imports").start()


# Options that every command takes, or every action of a command, or several commands.


def add_common_to_actions(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add them to the actions of a command: after an action they count as before it."""
    for action in commands.choices.values():
        action.add_common(argparse.SUPPRESS)


def print_json(answer: Any) -> None:
    """Print an answer as JSON."""
    from ..core.files import json_text

    print(json_text(answer))


def print_answer(
    arguments: argparse.Namespace, answer: Any, view: View, files: Iterable[Path | str] = ()
) -> None:
    """Print an answer: as JSON where that is asked for, else its view and the files written.

    Parameters
    ----------
    arguments : of the command line
    answer : what JSON holds
    view : of the result
    files : that were written
    """
    from ..view import terminal
    from ..view.blocks import Table

    if arguments.json:
        return print_json(answer)
    print(terminal.text(view))
    if view.blocks and isinstance(view.blocks[-1], Table):
        print()  # paths are no rows
    for path in files:
        print(f"  {path}")


IN_REPORT = ("add", "compare", "diagnose", "identify", "study")
"""Commands whose details stand in a study's report too."""


def print_study_answer(
    arguments: argparse.Namespace, answer: Any, view: View, *pictures: Path | None
) -> None:
    """Print a study's result: as JSON where that is asked for, else its view and its pictures.

    Parameters
    ----------
    arguments : of the command, with `folder` and `details`
    answer, view : of the result
    pictures : their files, None for one that was not drawn
    """
    from ..core.text import command
    from ..view import terminal

    if arguments.json:
        return print_json(answer)
    elsewhere = command("report", arguments.folder) if arguments.command in IN_REPORT else ""
    print(terminal.text(view, details=arguments.details, elsewhere=elsewhere))
    for picture in filter(None, pictures):
        print(f"Picture: {picture}")


def share_of(option: str, text: str, *, small: bool = False) -> float:
    """Return a share [1] from a text such as "10%" or "0.1"; RunError where it is none.

    One that is `small` is above 0 and below 1.
    """
    from ..errors import not_usable

    try:
        value = float(text.rstrip("% ")) / (100.0 if text.rstrip().endswith("%") else 1.0)
    except ValueError:
        value = inf
    if not (0.0 < value < 1.0 if small else 0.0 <= value < inf):
        ends = " above 0 and below 1" if small else ""
        raise not_usable(f"{option} {text!r}: a share{ends}, as 0.2% or 0.002, is right.")
    return value


# Asks on a terminal whether code that came with a file may run; shows it first.


def given(error: TrustError) -> bool:
    """Return whether the user consents to a text that is shown, and remember that.

    Nobody is asked where the input or the messages are no terminal.
    """
    if not error.text or not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    from ..core.progress import tell
    from ..trust import readable, remember

    tell("")  # the question stands on the terminal until it is answered
    print(f"{error.path} has not run on this machine before:\n", file=sys.stderr)
    for line in readable(error.text).splitlines():
        print(f"    {line}", file=sys.stderr)
    print("\nIt runs with your rights. Run it, and remember that? [y/N] ", end="", file=sys.stderr)
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        return False
    remember(Path(error.path), error.text)
    return True


# Options of the commands that write FMUs: those that need no Python, and for which platforms.


def builder(arguments: argparse.Namespace) -> Callable[[BuildPlan, Path], Path]:
    """Return what builds a planned FMU into a folder.

    Raises
    ------
    BuildError
        If a platform is not known; if what belongs to --native is asked for without it.
    """
    from ..errors import BuildError

    if arguments.native:
        from ..native.build import build as build_native
        from ..native.zig import chosen

        return partial(
            build_native,
            platforms=chosen(arguments.platforms),
            fmi=arguments.fmi,
            sources=arguments.sources,
        )
    if arguments.platforms:
        raise BuildError("--platform goes with --native: FMUs in Python hold all that they can.")
    if arguments.sources:
        raise BuildError("--sources goes with --native: FMUs in Python are their own sources.")
    if arguments.fmi != 2:
        raise BuildError("--fmi 3 goes with --native: FMUs in Python follow FMI 2.0.")
    from ..fmu.build import build

    return build
