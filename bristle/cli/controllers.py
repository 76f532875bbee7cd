"""Compare controllers on your building, damper and ground motions.

The command writes tables, a report, and a scenario of each case.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._options import Parser, print_answer, share_of

if TYPE_CHECKING:
    from ..controller_comparison.result import ControllerComparison

HELP = "compare controllers on your building, damper and ground motions"

OPTIONS = (
    "building", "motions", "controller", "damper", "device", "output", "statistic", "grid",
    "limit", "ensemble", "spread", "noise", "delay", "step", "engine", "fmus", "workers",
)  # fmt: skip
"""What makes the comparison again."""
ANSWER = "answer.json"
"""What --json prints, beside the report: the page shows it."""


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle controllers`."""
    text = (
        "ground motions: names or files, with values, e.g. el_centro_1940_ns,peak=0.4g,factor=0.5"
    )
    parser.option("--motions", "RECORD", text, nargs="+")
    text = (
        "stock names, controller files (.json) or design files (.toml) of `bristle design`, "
        "your own components (.py), FMUs, with values, e.g. Skyhook,gain=80,label=mine"
    )
    parser.option("--controller", "WHAT", text, nargs="+", action="extend")
    parser.option("--building", "FILE", "building file; else the library's building")
    text = (
        "a component, a law, the folder of a study or a model.toml, an FMU, with values; "
        "else LuGreDamper"
    )
    parser.option("--damper", "WHAT", text)
    text = "device of the building that the controllers command; else the damper on the first level"
    parser.option("--device", "NAME", text)
    parser.option("--output", "NAME", "judged output; else the top level's absolute acceleration")
    parser.add_argument("--statistic", choices=("peak", "rms"), help="its statistic; else peak")
    parser.option("--grid", "N", "number of constant voltages to try; else 17", type=int)
    text = "compute the limit of any voltage under each motion: up to a minute each"
    parser.add_argument("--limit", action="store_const", const=True, help=text)
    text = "run each case with N varied buildings, dampers and sensors, to find the worst case"
    parser.option("--ensemble", "N", text, type=int)
    text = "variation of masses, stiffnesses and damper parameters to either side; else 10%%"
    parser.option("--spread", "SHARE", text)
    text = "noise of the sensors, a share of each signal's RMS; else 1%%"
    parser.option("--noise", "SHARE", text)
    parser.option("--delay", "S", "longest delay of the sensors [s]; else 0.004", type=float)
    text = "interval of the rows and step of FMUs [s]; else 0.002, or a share of a sample period"
    parser.option("--step", "S", text, type=float)
    text = "solve built-in components together (compiled), or step all as FMUs (fmu)"
    parser.add_argument("--engine", choices=("compiled", "fmu"), help=text)
    parser.add_argument("--fmus", choices=("python", "native"), help="kind of FMUs")
    parser.option("--workers", "N", "number of processes; else one per core", type=int)
    parser.add_no_figure("write only tables, no report")
    text = (
        "folder of report, tables and scenarios; older ones are replaced; else "
        "results/comparison/BUILDING/"
    )
    parser.add_out(text)
    parser.add_json()
    parser.add_trust()


def main(arguments: argparse.Namespace) -> int:
    """Compare, write scenarios, tables and report; print tables and verdict."""
    from ..controller_comparison import compare_controllers
    from ..controller_comparison.setting import plain_name
    from ..core.files import write_whole

    name = Path(arguments.building).stem if arguments.building else "building"
    folder: Path = arguments.out or Path("results", "comparison", plain_name(name))
    given = {
        key: value
        for key in ("building", "damper", "device", "output", "statistic", "grid", "step",
                    "engine", "fmus", "workers")
        if (value := getattr(arguments, key)) is not None
    }  # fmt: skip
    found = compare_controllers(
        arguments.motions or [], arguments.controller or [], **given,
        limit=bool(arguments.limit), spread=_spread(arguments), out=folder,
    )  # fmt: skip
    files = found.write(folder)
    if not arguments.no_figure:
        from ..core.progress import tell
        from ..report.controllers_page import controllers_report

        tell("drawing")
        files.insert(0, folder / "report.html")
        write_whole(files[0], controllers_report(found))
    answer = {"command": _said(arguments), **_answer(found, files)}
    write_whole(folder / ANSWER, json.dumps(answer, indent=1, allow_nan=False))
    print_answer(arguments, answer, found.view())
    if not arguments.json:
        print(f"\n{len(found.table)} cases as scenarios in {folder / 'scenarios'}")
        for path in files:
            print(f"  {path}")
    return 0


def _said(arguments: argparse.Namespace) -> str:
    """Return the command that makes the same comparison."""
    from ..core.text import command

    words: list[object] = []
    for name in (*OPTIONS, "out"):
        value = getattr(arguments, name)
        if value is True:
            words.append(f"--{name}")
        elif value is not None:
            words += [f"--{name}", *(value if isinstance(value, list) else [value])]
    return command("controllers", *words)


def _spread(arguments: argparse.Namespace) -> Any:
    """Return how far reality may lie from the case, None where nobody asks."""
    from ..controller_comparison import Spread

    given = {"members": arguments.ensemble, "delay": arguments.delay}
    given = {name: value for name, value in given.items() if value is not None}
    for name, option in (("share", "spread"), ("noise", "noise")):
        if (text := getattr(arguments, option)) is not None:
            given[name] = share_of(f"--{option}", text)
    return Spread(**given) if given else None


def _answer(found: ControllerComparison, files: list[Path]) -> dict[str, Any]:
    from ..controller_comparison.view import footnotes, header, lowest, rows
    from ..core.files import as_json

    judged = found.setting.judged
    return {
        "verdict": found.verdict,
        "judged": {"output": judged.column, "statistic": judged.statistic, "unit": judged.unit},
        "units": found.units,
        "cases": as_json(found.table.to_dict(orient="records")),
        "worst": None if found.worst is None else as_json(found.worst.to_dict(orient="records")),
        "limits": {name: one._asdict() for name, one in found.limits.items()},
        "notes": list(found.notes),
        "tables": [
            {"motion": name, "rows": rows(found, name), "lowest": lowest(found, name)}
            for name in found.motions
        ],
        "header": header(found), "footnotes": footnotes(found),
        "seconds": round(found.seconds, 1),
        "files": [str(path.absolute()) for path in files],
    }  # fmt: skip
