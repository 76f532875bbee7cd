"""The process that answers views: it imports what is heavy, and reads studies.

It is apart from the server so that the server starts at once and stays small, and so that an effect
of a user's own, once consented to, can hang no page: the server ends a worker that takes too long.
Requests come as lines of JSON on stdin; an answer is a line of JSON with its length, and its bytes.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

from ..errors import BristleError, TrustError

VIEWS = {
    "data_views": ("channels", "check", "columns", "data", "preview"),
    "study_views": ("errors", "fit", "history", "residual", "verdict"),
    "control_views": (
        "controllers", "design", "weights", "scenarios", "simulate", "spectrum",
    ),
}  # fmt: skip
"""The views of each module: `NAME_view(folder, arguments)` answers with what `html.pack` takes."""

Answered = tuple[dict[str, Any], bytes]


def answer(view: str, folder: Path, arguments: Mapping[str, Any]) -> Answered:
    """Return what is told of an answer, and its bytes.

    Parameters
    ----------
    view : one of `VIEWS`
    folder : of the study, or with the studies
    arguments : what the page asks for
    """
    from ..user_code.load import unload_effects
    from ..view.html import pack

    try:
        unload_effects()  # those of the study that was asked for before
        found = function_of(view)(folder, arguments)
        return {"ok": True}, pack(found)
    except TrustError as error:
        told = {"kind": "TrustError", "file": str(error.path), "text": error.text}
        return {"ok": False, "error": str(error), **told}, b""
    except BristleError as error:
        return {"ok": False, "error": str(error), "kind": type(error).__name__}, b""
    except Exception as error:
        traceback.print_exc()
        said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        return {"ok": False, "error": f"an unexpected error ({said}).", "kind": "unexpected"}, b""


def function_of(view: str) -> Callable[[Path, Mapping[str, Any]], Any]:
    """Return what answers a view."""
    module = next(module for module, views in VIEWS.items() if view in views)
    found: Callable[[Path, Mapping[str, Any]], Any] = getattr(
        import_module(f"{__package__}.{module}"), f"{view}_view"
    )
    return found


def serve(requests: BinaryIO, answers: BinaryIO) -> None:
    """Answer requests until there are no more."""
    import_module(f"{__package__}.data_views")
    for number, line in enumerate(requests):
        asked = json.loads(line)
        head, body = answer(asked["view"], Path(asked["folder"]), asked["arguments"])
        head |= {"bytes": len(body), "memory": memory()}
        answers.write(json.dumps(head).encode() + b"\n")
        answers.write(body)
        answers.flush()
        if number == 0:
            # What is asked for next is imported behind the first answer.
            ahead = threading.Thread(target=import_module, args=(f"{__package__}.study_views",))
            ahead.daemon = True
            ahead.start()


def memory() -> int:
    """Return the memory [bytes] that this process has taken at the most, 0 where nobody tells."""
    if sys.platform == "win32":
        return 0
    import resource

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else 1024 * most


def main() -> None:
    """Answer on the real stdout, which nothing else may write to."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    try:
        serve(sys.stdin.buffer, answers)
    except BrokenPipeError:  # the page has ended, nobody reads what is left in the buffer
        os.dup2(os.open(os.devnull, os.O_WRONLY), answers.fileno())


if __name__ == "__main__":
    main()
