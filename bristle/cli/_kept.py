"""What each command that takes long keeps where Ctrl-C ends it, and how to go on."""

from __future__ import annotations

import argparse

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


def kept_by(arguments: argparse.Namespace) -> str:
    """Return what is told of a command that is interrupted, "" where it loses nothing.

    Parameters
    ----------
    arguments : of the command line
    """
    action = getattr(arguments, "action", None) or getattr(arguments, "name", None)
    alone = KEPT.get(arguments.command, "")
    return KEPT.get(f"{arguments.command} {action}", alone)
