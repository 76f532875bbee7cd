"""Compute the smallest peak or RMS that any voltage of a scenario's damper can give.

The ground motion is known in advance; the voltage is free between zero and its largest value. The
limit is the best voltage that the search found: the gap between a controller and the limit is the
possible gain. No controller gets below the lower bound.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._options import Parser, print_answer

if TYPE_CHECKING:
    from ..optimal_control import Limit

HELP = "compute the smallest peak or RMS that any control of a scenario's damper can give"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle limit`."""
    text = "file or stock scenario with one damper; else El Centro 0.6 g with a LuGre damper"
    parser.add_argument(
        "scenario",
        nargs="?",
        default="el_centro_0p6g_constant_voltage",
        metavar="SCENARIO",
        help=text,
    )
    parser.add_judged()
    text = "preview times [s] of a receding horizon; none: no such runs; else 0 0.1 0.5"
    parser.option("--preview", "S", text, nargs="*", type=float, default=[0.0, 0.1, 0.5])
    parser.option("--starts", "N", "number of starts of the search; else 3", type=int, default=3)
    text = "folder of voltage, scenario, results and picture; else results/limit/SCENARIO/"
    parser.add_out(text)
    parser.add_no_figure()
    parser.add_overrides("scenario", "ground.peak=3.924")
    parser.add_trust()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Compute, write voltage, scenario, results and picture, print what was found."""
    from ..optimal_control import limit
    from ..system.library import run_name
    from ..system.overrides import parse_overrides
    from ..system.scenario import load_scenario, resolve_scenario

    overrides = parse_overrides(arguments.overrides)
    file = resolve_scenario(arguments.scenario)
    scenario = load_scenario(file, overrides)
    folder = arguments.out or Path("results", "limit", run_name(file, overrides))
    found = limit(
        scenario,
        output=arguments.output,
        statistic=arguments.statistic,
        previews=arguments.preview,
        starts=arguments.starts,
        out=folder,
    )
    files = [folder / name for name in ("voltage.csv", "limit.toml", "results.csv")]
    if not arguments.no_figure:
        from ..optimal_control.view import draw_limit

        files.append(folder / "limit.png")
        draw_limit(found).save(files[-1], dpi=160)
    print_answer(arguments, _answer(found, files), found.view(), files)
    return 0


def _answer(found: Limit, files: list[Path]) -> dict[str, Any]:
    return {
        "title": found.title,
        "output": found.output,
        "statistic": found.statistic,
        "unit": found.unit,
        "limit": found.value,
        "bound": found.bound,
        "most_force": found.most_force,
        "searched": found.searched,
        "sure": found.sure,
        "starts": [vars(start) for start in found.starts],
        "previews": [{"ahead": s, "value": v} for s, v in found.previews.items()],
        "constant": [{"voltage": V, "value": v} for V, v in found.constant.items()],
        "as_it_is": found.as_it_is,
        "seconds": round(found.seconds, 1),
        "files": [str(path.absolute()) for path in files],
    }
