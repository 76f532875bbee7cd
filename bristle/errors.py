"""What can go wrong, one class per layer, each with the exit code of the command line."""

from __future__ import annotations

from os import PathLike
from typing import Any


class BristleError(Exception):
    """Base of every error that bristle raises on purpose.

    The text says where, what, and what would be right; it is printed as it is, without a
    traceback. `exit_code` is what the command line returns: 2 for wrong input, 1 for a run
    that failed on its way.

    Attributes
    ----------
    exit_code : int
        2 or 1.
    findings : tuple
        Of a file that is wrong: what is wrong with it, each with its line.

    Examples
    --------
    >>> import bristle
    >>> try:
    ...     bristle.run("no_damperr")
    ... except bristle.BristleError as error:
    ...     print(error.exit_code, "Did you mean" in str(error))
    2 True
    """

    exit_code = 2
    findings: tuple[Any, ...] = ()


class UnitError(BristleError):
    """A unit that is not known, or two units of different dimension."""


class PhysicsError(BristleError):
    """A parameter, effect, law or building that cannot be."""


class RecordError(BristleError):
    """A ground motion or measurement that cannot be read or must not be trusted."""


class FmuError(BristleError):
    """An FMU file that cannot or must not be opened."""


class BuildError(BristleError):
    """An FMU that cannot be built from its component."""


class ScenarioError(BristleError):
    """A scenario file that is wrong; the text lists every mistake found, with lines."""


class DesignError(BristleError):
    """A controller that cannot be designed, or a controller file that must not be used."""


class EnsembleError(BristleError):
    """An ensemble that cannot be run: its file or its folder is wrong."""


class RunError(BristleError):
    """A run that started and failed; the text says what is kept, and where."""

    exit_code = 1


class StudyError(BristleError):
    """A study's folder or one of its files that cannot be read, or must not be changed."""


class TrustError(BristleError):
    """Code that came with a file and that this machine's user has not consented to.

    `path` is the file, `text` the code that would run, "" where consent cannot be kept, `why`;
    `optional` whether the work can go on without it.
    """

    optional = False

    def __init__(self, path: PathLike[str], text: str = "", why: str = "") -> None:
        self.path = path
        self.text = text
        said = (
            f"consent cannot be kept: {why}"
            if why
            else "this file's code has not run here before. Read it, then consent with --trust"
        )
        ways = "in Python `with bristle.trust.granted():`, in CI BRISTLE_TRUST=1"
        super().__init__(f"{path}: {said} ({ways}).")


def not_usable(text: str) -> RunError:
    """Return a RunError for what is wrong before a run starts: exit code 2."""
    error = RunError(text)
    error.exit_code = 2
    return error
