"""Run a scenario: results, a figure and a log in one folder, peaks and RMS on the screen."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ._consent import add_trust

if TYPE_CHECKING:
    import pandas as pd

HELP = "run a scenario and draw what happens"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle run`."""
    parser.add_argument("file", metavar="FILE", help="scenario file, or name of a stock scenario")
    parser.add_argument(
        "--out",
        metavar="FOLDER",
        help="where results, figure and log go, in place of older ones; else results/NAME/",
    )
    parser.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="take a value in place of the file's, e.g. --set damper.f_c=2",
    )
    parser.add_argument(
        "--engine",
        choices=("fmu", "compiled"),
        default="fmu",
        help="step FMUs (fmu), or solve built-in components together (compiled)",
    )
    parser.add_argument(
        "--format", choices=("csv", "parquet"), default="csv", help="of the results"
    )
    parser.add_argument("--no-figure", action="store_true", help="draw nothing")
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Run, draw, print; return 0, 1 if the run failed on its way, 130 if it was interrupted."""
    from ..errors import RunError
    from ..scenario.scenario import parse_overrides, resolve_scenario
    from ..simulate.output import Output
    from ..simulate.run import IncompleteRunError, RunInterrupted, execute

    overrides = parse_overrides(arguments.overrides)
    file = resolve_scenario(arguments.file)
    folder = Path(arguments.out) if arguments.out else Path("results", file.stem)
    output = Output(folder, arguments.format)
    code, trouble = 0, ""
    try:
        frame = execute(file, overrides, arguments.engine, output, True, end_process=True)
    except (IncompleteRunError, RunInterrupted) as error:
        if arguments.debug and isinstance(error, IncompleteRunError):
            raise
        frame, trouble = error.frame, str(error)
        code = 1 if isinstance(error, IncompleteRunError) else 130
    written = {"results": folder / f"results.{output.format}", "log": folder / "log"}
    if not arguments.no_figure:
        from ..report.figures import run_figure

        try:
            run_figure(frame, folder / "figure.png")
            written["figure"] = folder / "figure.png"
        except RunError as error:  # the results are there all the same
            code, trouble = code or 1, "\n".join(filter(None, (trouble, str(error))))
    if arguments.json:
        _print_json(frame, written, trouble)
    else:
        _print_plain(frame, written)
    if trouble:
        kind = "RunError: " if code == 1 else ""
        print(f"{kind}{trouble}", file=sys.stderr)
    return code


def _print_json(frame: pd.DataFrame, written: dict[str, Path], trouble: str) -> None:
    import json
    from dataclasses import asdict

    from ..report.summary import summarise

    answer = {
        "complete": frame.attrs["complete"],
        "error": trouble or None,
        "rows": len(frame),
        "window": [float(frame.index[0]), float(frame.index[-1])],
        "wall_time": frame.attrs["made"]["wall_time"],
        "outputs": [
            {key: None if value != value else value for key, value in asdict(summary).items()}
            for summary in summarise(frame, everything=True)  # JSON has no NaN
        ],
        **{name: str(path.absolute()) for name, path in written.items()},
    }
    print(json.dumps(answer, indent=2))


def _print_plain(frame: pd.DataFrame, written: dict[str, Path]) -> None:
    from rich.console import Console
    from rich.table import Table

    from ..report.summary import summarise

    made = frame.attrs["made"]
    first, last = frame.index[0], frame.index[-1]
    heading = f"{made['title'] or made['file']}: RMS over {first:g} to {last:g} s"
    table = Table(title=heading, title_justify="left", box=None, pad_edge=False)
    table.add_column("output")
    for column in ("peak", r"at \[s]", "RMS"):
        table.add_column(column, justify="right")
    table.add_column("unit")
    for row in summarise(frame):
        unit = row.unit if row.unit and row.unit != "1" else ""
        table.add_row(
            row.name, f"{row.peak:.5g}", f"{row.time_of_peak:.4g}", f"{row.rms:.5g}", unit
        )
    Console(highlight=False).print(table)
    print(f"{len(frame)} rows in {made['wall_time']:.2f} s")
    for path in written.values():
        print(f"  {path}")
