"""The command line: a thin layer that names the command, prints the answer, sets the exit code.

Every command is a module of this package with `HELP`, `add_arguments(parser)` and
`main(arguments) -> int`. Modules import what is heavy inside `main`, so that `--help` answers
at once.
"""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NoReturn

from ..errors import BristleError, TrustError
from ..version import __version__
from ._options import Parser

_BLAS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""How many threads a product of matrices takes, read when numpy is imported. The matrices here are
narrow, and laws, effects and runs have threads of their own: both together are slower."""

_SLOW_TO_LEAVE = ("bristle.engine.instance", "numba")
"""Modules with which a process takes half a second and more to be taken down."""

_ANEW = "The same command begins anew."
_AS_IT_WAS = f"The study is as it was. {_ANEW}"
_COMPILED = (
    "No FMU was written. What was compiled stays in the cache: the same command goes on there."
)
_NO_FILE = f"No file was written. {_ANEW}"

KEPT = {
    "add": _AS_IT_WAS,
    "check": _ANEW,
    "build": _COMPILED,
    "compare": f"No picture was written. {_ANEW}",
    "compare-fmu": f"No picture was written. {_ANEW}",
    "conform": f"No verdict is kept. {_ANEW}",
    "controllers": "Limits that were found and runs of ensembles are kept; the same command takes "
    "them, and runs each case once more.",
    "design": f"No controller was written. {_ANEW}",
    "diagnose": f"Of this diagnosis nothing is kept. {_AS_IT_WAS}",
    "example bench": f"No study was made. {_ANEW}",
    "example building": f"No study was made. {_ANEW}",
    "example perform": _AS_IT_WAS,
    "export": _COMPILED.replace("FMU", "file"),
    "export-ssp": "A package that is there is whole; its coupling error is not yet known. The same "
    "command begins anew, and finds FMUs that were built.",
    "identify": _AS_IT_WAS,
    "learn": _AS_IT_WAS,
    "limit": _NO_FILE,
    "optimise": _NO_FILE,
    "plan": f"No plan was written. {_ANEW}",
    "predict": _ANEW,
    "report": f"No report was written; an older one is as it was. {_ANEW}",
    "study auto": _AS_IT_WAS,
    "study check": f"No picture was written. {_ANEW}",
    "study extend": _AS_IT_WAS,
    "study new": f"No study was made. {_ANEW}",
}
"""What is told by command, or by command and action, before anything is made.

What is made on the way is told by who makes it, as by `study auto`, `run` and `ensemble`.
"""


def build_parser(only: str = "") -> Parser:
    """Return the parser with one subcommand per module of this package.

    Parameters
    ----------
    only : the command that is wanted: the modules of the others stay unread; "" for all
    """
    parser = Parser(
        prog="bristle",
        description="Find the physics that a damper model misses; simulate buildings with MR "
        "dampers as FMUs.",
        epilog="Exit codes: 0 done, 1 failed during the work, 2 the input is wrong, 130 "
        "interrupted.",
    )
    parser.add_argument("--version", action="version", version=f"bristle {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for found in pkgutil.iter_modules(__path__):
        if found.name.startswith("_"):
            continue
        name = found.name.strip("_").replace("_", "-")
        if only and name != only:
            continue
        module = importlib.import_module(f"{__name__}.{found.name}")
        sub = commands.add_parser(name, help=module.HELP, description=module.__doc__)
        sub.add_common()
        module.add_arguments(sub)
        sub.set_defaults(main=module.main)
    return parser


def _parsed(argv: Sequence[str] | None) -> argparse.Namespace:
    """Return the arguments of a command line, for which one command's module is read."""
    words = (sys.argv[1:] if argv is None else argv) or ["--help"]
    known = {one.name.strip("_").replace("_", "-") for one in pkgutil.iter_modules(__path__)}
    return build_parser(words[0] if words and words[0] in known else "").parse_args(words)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code (0, 1, 2 or 130) and never a traceback.

    The traceback of an error that nobody foresaw is kept in a file, which the one line names.
    """
    debug = False
    try:
        arguments = _parsed(argv)
        debug = arguments.debug
        return _run(arguments)
    except KeyboardInterrupt:
        if debug:
            raise
        from ..core.interrupt import message

        print(message(), file=sys.stderr)
        return 130


def _run(arguments: argparse.Namespace) -> int:
    """Run a command; say in one line why it fails, unless its tracebacks are asked for."""
    from ..core.interrupt import Hurry, keeps

    keeps(_kept_by(arguments))
    try:
        with Hurry(), _progress(arguments):
            return _with_consent(arguments)
    except BristleError as error:
        if arguments.debug:
            raise
        from ..core.text import cut_short

        print(cut_short(f"{type(error).__name__}: {error}"), file=sys.stderr)
        return error.exit_code
    except BrokenPipeError:  # the reader of a pipe, such as head, has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if arguments.debug:
            raise
        from . import _failure

        print(_failure.line(error, arguments.command), file=sys.stderr)
        return 1


def _kept_by(arguments: argparse.Namespace) -> str:
    """Return what is told of a command that is interrupted, "" where it loses nothing.

    Parameters
    ----------
    arguments : of the command line
    """
    action = getattr(arguments, "action", None) or getattr(arguments, "name", None)
    alone = KEPT.get(arguments.command, "")
    return KEPT.get(f"{arguments.command} {action}", alone)


@contextmanager
def _progress(arguments: argparse.Namespace) -> Iterator[None]:
    """Tell on stderr what is being done, unless nobody wants to know.

    Where the answer is JSON, a terminal and a program that asks for lines want to: no other pipe.
    """
    from ..core.progress import telling, wants_lines
    from ._line import ProgressLine

    piped = not (sys.stderr.isatty() or wants_lines())
    if arguments.quiet or (getattr(arguments, "json", False) and piped):
        with telling(None):
            yield
        return
    line = ProgressLine(f"bristle {arguments.command}")
    with line, telling(line.say):
        yield


def _with_consent(arguments: argparse.Namespace) -> int:
    """Run a command; ask, on a terminal, about code that has not run here, and run it again.

    What the command can do without is left out where the answer is no, or nobody can be asked.
    """
    from ..trust import asking, digest, granted

    if getattr(arguments, "trust", False):
        with granted():
            return int(arguments.main(arguments))
    with asking() as declined:
        while True:
            try:
                return int(arguments.main(arguments))
            except TrustError as error:
                from . import _options as _consent

                answered = digest(error.text)
                if _consent.given(error):
                    continue
                if not error.optional or answered in declined:
                    raise
                declined.add(answered)


def run_and_exit() -> NoReturn:
    """Run one command and end the process with its exit code; what the shell calls.

    Products of matrices take one thread, unless the environment says another number.

    Taking down a process with FMUs and compiled code in it takes up to a second, after its work is
    done and written: such a process ends at once.
    """
    for threads in _BLAS:
        os.environ.setdefault(threads, "1")
    code = main()
    if code == 130:
        from ..core.interrupt import leave

        leave(code)
    if any(name in sys.modules for name in _SLOW_TO_LEAVE):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)
