"""The limit of each motion: computed once, kept in the cache, played as one more controller."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any, NamedTuple

from ..campaign.campaign import Output
from ..core.files import cache_folder
from ..errors import ScenarioError
from ..optimal_control import limit
from ..optimal_control.case import case_of, history_text
from ..system.scenario import load_scenario
from ..version import __version__
from .runs import Bench, quiet
from .setting import ABOVE, FILES, LIMIT, LIMITS, ON, Candidate, Motion, Part, constant, plain_name


class Reached(NamedTuple):
    """What a search for the limit of a motion found.

    `value` of the judged output; `bound` below which no force can bring it, None where none is
    known; `agreeing` of `starts` searches found it within 2 %, `sure` whether two did and the
    coupled engine confirms it. `kept` tells whether the cache had it.
    """

    value: float
    bound: float | None
    agreeing: int
    starts: int
    sure: bool
    kept: bool


def refuse_limit(bench: Bench, motion: Motion, judged: Output) -> None:
    """Refuse a case that has no limit, before the work for it is done.

    Raises
    ------
    ScenarioError
        Saying why.
    """
    candidate = constant(ON, bench.damper.most, "")
    if bench.engine_of(candidate) != "compiled":
        raise ScenarioError(
            "--limit needs a damper of the library and the engine compiled: the law in an FMU is "
            "not known."
        )
    case_of(load_scenario(bench.write(motion, candidate)), judged.column)


def limit_of(
    bench: Bench, motion: Motion, judged: Output, starts: int = 3
) -> tuple[Candidate, Reached]:
    """Return the voltage that reaches a motion's limit as a controller, and what is known of it.

    Parameters
    ----------
    bench, motion : the case
    judged : the output that is to be lowest, and its statistic
    starts : of the search

    Raises
    ------
    ScenarioError
        If the case does not suit.
    RunError
        If a run fails.
    """
    text = bench.text(motion, constant(ON, bench.damper.most, ""))
    file = cache_folder() / LIMITS / f"{_digest(bench, text, judged, starts)}.json"
    found, kept = _read(file), True
    if found is None:
        kept = False
        scenario = load_scenario(bench.write(motion, constant(ON, bench.damper.most, "")))
        with quiet():
            one = limit(
                scenario, output=judged.column, statistic=judged.statistic, previews=(),
                starts=starts,
            )  # fmt: skip
        found = {
            "value": one.value, "bound": one.bound, "agreeing": one.agreeing,
            "starts": len(one.starts), "sure": bool(one.sure), "time": one.time.tolist(),
            "voltage": one.voltage.tolist(),
        }  # fmt: skip
        bench.folder.write(file, json.dumps(found))
    path = bench.folder.at(LIMITS, motion.name, "voltage.csv")
    bench.folder.write(path, history_text(found["time"], found["voltage"]))
    said = f"{ABOVE}/{LIMITS}/{plain_name(motion.name)}/{path.name}"
    part = Part({"fmu": "SignalSource"}, {"kind": "csv", "file": said})
    about = "the voltage that reaches the limit, the ground motion known in advance"
    reached = Reached(
        found["value"], found["bound"], found["agreeing"], found["starts"], found["sure"], kept
    )
    return Candidate(LIMIT, part, {}, "value", True, None, about), reached


def _digest(bench: Bench, text: str, judged: Output, starts: int) -> str:
    """Return what stands for all that decides a limit: scenario, files that it reads, goal."""
    content = hashlib.sha256(f"{__version__}/{judged.name}/{starts}/".encode())
    content.update(re.sub(r"^title = .*$", "", text, flags=re.MULTILINE).encode())
    for name in re.findall(rf'{re.escape(ABOVE)}/{FILES}/([^"]+)', text):
        content.update((bench.folder.path / FILES / name).read_bytes())
    return content.hexdigest()[:24]


def _read(file: Path) -> dict[str, Any] | None:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None  # not there, or cut short: it is computed anew
    return found if isinstance(found, dict) else None
