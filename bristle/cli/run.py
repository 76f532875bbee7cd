"""Run a scenario: results, a figure and a log in one folder, peaks and RMS on the screen."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._options import Parser, print_answer, share_of

if TYPE_CHECKING:
    import pandas as pd

    from ..system.model import System


HELP = "run a scenario: results, a figure, peaks and RMS"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle run`."""
    text = "scenario file, name of a stock scenario, or SSP package"
    parser.add_argument("file", metavar="FILE", help=text)
    text = (
        "folder of results, figure and log; older ones are replaced; else results/NAME/, or "
        "results/NAME_a.b=value/ with --set a.b=value"
    )
    parser.add_out(text)
    parser.add_overrides()
    text = "step FMUs (fmu), or solve built-in components together (compiled)"
    parser.add_argument("--engine", choices=("fmu", "compiled"), default="fmu", help=text)
    text = "kind of FMUs: those that run in Python, or compiled native ones"
    parser.add_argument("--fmus", choices=("python", "native"), default="python", help=text)
    text = "format of the results"
    parser.add_argument("--format", choices=("csv", "parquet"), default="csv", help=text)
    text = "estimate the coupling error of every output with additional runs"
    parser.flag("--coupling-error", text)
    text = "find the step at which the coupling error stays below a share of the peaks, e.g. 0.2%%"
    parser.option("--tolerance", "SHARE", text)
    text = "write the response spectra of ground and floors, 5 %% damped, as spectrum.csv"
    parser.flag("--spectrum", text)
    parser.add_no_figure()
    parser.add_trust()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Run, draw, print; return 0, 1 if the run failed on its way, 130 if it was interrupted."""
    from ..engine.run import IncompleteRunError, RunInterrupted, run
    from ..errors import RunError
    from ..system.library import run_name
    from ..system.overrides import parse_overrides
    from ..system.scenario import load_scenario, resolve_scenario

    overrides = parse_overrides(arguments.overrides)
    file = resolve_scenario(arguments.file)
    if arguments.tolerance is not None:
        overrides |= _steps_for(arguments, file, overrides)
    folder: Path = arguments.out or Path("results", run_name(file, overrides))
    scenario = load_scenario(file, overrides)
    _show(scenario)
    code, trouble = 0, ""
    try:
        frame = run(
            scenario, engine=arguments.engine, fmus=arguments.fmus, out=folder,
            format=arguments.format, progress=True, end_process=True,
            coupling_error=arguments.coupling_error or arguments.tolerance is not None,
        )  # fmt: skip
    except (IncompleteRunError, RunInterrupted) as error:
        if arguments.debug and isinstance(error, IncompleteRunError):
            raise
        frame, trouble = error.frame, str(error)
        code = 1 if isinstance(error, IncompleteRunError) else 130
    written = {"results": folder / f"results.{arguments.format}", "log": folder / "log"}
    further: dict[str, Callable[[pd.DataFrame, Path], None]] = {}
    if not arguments.no_figure:
        from ..engine.view import run_figure

        further["figure.png"] = run_figure
    if arguments.spectrum:
        from ..engine.results import SPECTRUM_FILE, write_spectra

        further[SPECTRUM_FILE] = write_spectra
    for name, make in further.items() if code != 130 else ():  # Ctrl-C waits for nothing more
        try:
            make(frame, folder / name)
            written[name.partition(".")[0]] = folder / name
        except RunError as error:  # the results are there all the same
            code, trouble = code or 1, "\n".join(filter(None, (trouble, str(error))))
    print_answer(arguments, _answer(frame, written, trouble), frame.view(), written.values())
    if trouble:
        kind = "RunError: " if code == 1 else ""
        print(f"{kind}{trouble}", file=sys.stderr)
    return code


def _show(scenario: System) -> None:
    """Show the warnings and notes of a scenario's check, the first ones where there are many."""
    from ..core.text import LINES, command

    remarks = scenario.remarks()
    for line in remarks[: LINES - 1]:
        print(line, file=sys.stderr, flush=True)
    if len(remarks) >= LINES:
        name = scenario.package
        again = ["import-ssp", name] if name else ["check", scenario.where]
        more = f"and {len(remarks) - LINES + 1} more; all:  {command(*again, '--json')}"
        print(more, file=sys.stderr, flush=True)


def _steps_for(
    arguments: argparse.Namespace, file: Path, overrides: dict[str, object]
) -> dict[str, object]:
    """Return the step that keeps the tolerance, as overrides, and say it.

    Components with a step of their own step the more often, the shorter that of the run is.
    """
    from ..engine.cosimulation import Cosimulation, ignore
    from ..engine.coupling_error import again_by, find_step
    from ..errors import not_usable
    from ..system.scenario import load_scenario

    if arguments.engine != "fmu":
        raise not_usable('--tolerance: engine "compiled" makes no coupling error; "fmu" does.')
    tolerance = share_of("--tolerance", arguments.tolerance, small=True)
    again = again_by(Cosimulation(arguments.fmus, ignore, progress=True))
    scenario = find_step(load_scenario(file, overrides), tolerance, again)
    own = {name: one.step for name, one in scenario.components.items() if one.step is not None}
    of_own = ", ".join(f"{1e3 * step:.6g} ms of {name}" for name, step in own.items())
    said = f"a step of {1e3 * scenario.step:.6g} ms{f' ({of_own})' if own else ''} keeps"
    print(f"{said} the coupling error below {100 * tolerance:.3g} %", file=sys.stderr)
    return {"run.step": scenario.step, **{f"{name}.step": step for name, step in own.items()}}


def _answer(frame: pd.DataFrame, written: dict[str, Path], trouble: str) -> dict[str, Any]:
    from dataclasses import asdict

    from ..engine.results import summarise

    return {
        "complete": frame.attrs["complete"],
        "error": trouble or None,
        "rows": len(frame),
        "window": [float(frame.index[0]), float(frame.index[-1])],
        "wall_time": frame.attrs["made"]["wall_time"],
        "coupling_error": dict(frame.attrs.get("coupling_error", {})),
        "outputs": [asdict(summary) for summary in summarise(frame, everything=True)],
        **{name: str(path.absolute()) for name, path in written.items()},
    }
