"""The child process: `main(work, probe)` tries one probe and leaves its finding in a file.

Its file names are shared with the parent: plan.json comes in; finding.json and the black box
(the call under way) go out, the latter also when this process dies.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

from ..core.finding import Finding
from ..fmu.library import FatalAnswerError, MissingFunctionError, UnexpectedError
from .bench import Bench, BlackBox, ProbePlan
from .probe import failed
from .probes import PROBES

PLAN, FINDING, BOX = "plan.json", "finding.json", "box"


def main(work: Path, name: str) -> None:
    """Try one probe; the process then ends as the FMU lets it."""
    bench = Bench(ProbePlan.load(work / PLAN), BlackBox(work / BOX))
    finding = _try(bench, name)
    text = {
        "finding": finding.as_dict("kind", "level", "text"), "pace": bench.pace,
        "said": bench.said() if finding.level == "error" else "",
    }  # fmt: skip
    part = work / (FINDING + ".part")
    part.write_text(json.dumps(text))
    part.replace(work / FINDING)
    bench.box.note("leaving the process")
    if "answered Fatal" in finding.text:
        os._exit(0)  # not even the FMU's own cleaning up may be asked for


def serve(work: Path) -> None:
    """Fork one process per line of standard input (probe, tab, working folder).

    Each is announced by its process id, and its end by its exit code, on standard output.
    """
    null = os.open(os.devnull, os.O_RDWR)
    while line := sys.stdin.buffer.readline():
        name, folder = line.decode().rstrip("\n").split("\t")
        child = os.fork()
        if child == 0:
            os.setsid()
            os.dup2(null, 0)
            os.dup2(null, 1)
            os.chdir(folder)
            return main(work, name)
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
    return None


def _try(bench: Bench, name: str) -> Finding:
    try:
        return PROBES[name].run(bench)
    except (UnexpectedError, MissingFunctionError) as error:
        return failed(str(error))
    except FatalAnswerError as error:
        return failed(f"{error} answered Fatal: no instance may be used any more")
    except Exception as error:  # what an FMU answers can break any code that reads it
        where = bench.box.text() or "reading its answer"
        return failed(f"the probe broke off, {where}: {type(error).__name__}: {error}")


def forget_ourselves() -> None:
    """Take bristle out of the module table, so that an FMU finds what it brings and no more."""
    for module in [m for m in sys.modules if m.split(".")[0] == "bristle"]:
        del sys.modules[module]
