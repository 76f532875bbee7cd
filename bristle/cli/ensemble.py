"""Run an ensemble: many runs of one scenario, each with new draws of the uncertain values."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._options import Parser, print_answer

if TYPE_CHECKING:
    from ..campaign.ensemble import Ensemble

HELP = "run a scenario hundreds of times with varied parameters"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle ensemble`."""
    parser.add_argument("file", metavar="FILE", help="ensemble file, or name of a stock ensemble")
    parser.option("--runs", "N", "number of runs, instead of the file's", type=int)
    parser.option("--workers", "N", "number of processes; else one per core", type=int)
    text = (
        "folder of runs, quantiles and figure; a stopped ensemble continues there; else "
        "results/NAME/"
    )
    parser.add_out(text)
    parser.flag("--fresh", "start again and replace earlier runs")
    parser.flag("--retry", "repeat runs that failed")
    parser.add_no_figure()
    parser.add_trust()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Run what is left, write tables and figure; return 1 if every run failed, else 0."""
    from ..campaign.ensemble import EnsembleInterrupted, ensemble
    from ..campaign.ensemble_file import resolve_ensemble

    file = resolve_ensemble(arguments.file)
    folder: Path = arguments.out or Path("results", file.stem)
    try:
        found = ensemble(
            file,
            out=folder,
            runs=arguments.runs,
            workers=arguments.workers,
            fresh=arguments.fresh,
            retry=arguments.retry,
            progress=True,
        )
    except EnsembleInterrupted as stopped:
        print(stopped, file=sys.stderr)
        return 130
    files = _write(found, folder, not arguments.no_figure)
    print_answer(arguments, _answer(found, files), found.view(), files.values())
    if not (found.runs["status"] == "done").any():
        print(f"RunError: all {len(found.runs)} runs failed.", file=sys.stderr)
        return 1
    return 0


def _write(found: Ensemble, folder: Path, figure: bool) -> dict[str, Path]:
    from ..core.files import writing
    from ..errors import not_usable

    files = {"runs": folder / "runs.csv", "quantiles": folder / "quantiles.csv"}
    with writing(files["quantiles"], not_usable):
        if found.continued < len(found.runs):
            (folder / "figure.png").unlink(missing_ok=True)  # that of fewer runs, or of others
        found.quantiles.to_csv(files["quantiles"], float_format="%.9g")
    if figure and (found.runs["status"] == "done").sum() > 1:
        from ..campaign.view import draw_ensemble

        files["figure"] = folder / "figure.png"
        draw_ensemble(found).save(files["figure"], dpi=160)
    return files


def _answer(found: Ensemble, files: dict[str, Path]) -> dict[str, Any]:
    from dataclasses import asdict

    table = found.quantiles
    levels = [name for name in table if str(name).endswith(" %")]
    done = int((found.runs["status"] == "done").sum())
    return {
        "title": found.plan.title,
        "runs": len(found.runs),
        "done": done,
        "failed": len(found.runs) - done,
        "continued": found.continued,
        "wall_time": round(found.wall_time, 3),
        "quantiles": table[["unit", *levels]].reset_index().to_dict("records"),
        "failures": [asdict(failure) for failure in found.failures],
        "files": {name: str(path.absolute()) for name, path in files.items()},
    }
