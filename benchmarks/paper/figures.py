"""The figures of Shirazi et al. (2012) that this project draws anew, each with one call."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bristle.core.progress import Progress
from bristle.errors import not_usable
from bristle.version import __version__
from bristle.view.style import look

from . import identification, loops, optimum, stiction
from .runs import Drawing, Runs


@dataclass(frozen=True)
class PaperFigure:
    """A figure that can be asked for: its name, the paper's number, a line on it, its runs."""

    name: str
    number: str
    about: str
    runs: int
    draw: Callable[[Runs], Drawing]


def paper_figures() -> dict[str, PaperFigure]:
    """Return the figures by name, in the order of the paper."""
    found = (
        PaperFigure("loops-voltage", "Figs 3, 4",
                    "force loops of both laws on a test bench at four voltages",
                    2 * len(loops.VOLTAGES), loops.over_voltages),
        PaperFigure("loops-frequency", "Figs 3, 4",
                    "force loops of both laws on a test bench at four frequencies",
                    2 * len(loops.FREQUENCIES), loops.over_frequencies),
        PaperFigure("stiction", "Fig. 5",
                    "peaks in the acceleration of the base where its velocity crosses zero",
                    stiction.RUNS, stiction.draw),
        PaperFigure("identification", "Figs 6-8",
                    "laws with and without the exponential, fitted to the identification "
                    "experiment",
                    identification.RUNS, identification.draw),
        PaperFigure("passive-optimum", "Fig. 9",
                    "peak acceleration of the second floor over constant voltage, four intensities",
                    optimum.RUNS, optimum.draw),
    )  # fmt: skip
    return {figure.name: figure for figure in found}


def make(
    name: str,
    folder: Path,
    *,
    engine: str = "compiled",
    format: str = "png",
    progress: bool = False,
) -> list[Path]:
    """Run what a figure needs, draw it, and write it with its numbers into a folder.

    Parameters
    ----------
    name : str
        A name of `paper_figures()`.
    folder : path
        Made where it is missing; files of the same names are replaced.
    engine : str
        "compiled" or "fmu", as for `bristle.run`.
    format : str
        "png" (300 dpi), "svg" or "pdf".
    progress : bool
        Show a progress bar, on a terminal only.

    Returns
    -------
    list of Path
        The image first, then the CSV files of what is drawn.

    Raises
    ------
    RunError
        A run failed; or, with exit code 2, a file cannot be written.
    """
    figure = paper_figures()[name]
    make_folder(folder)
    with Progress(figure.name, figure.runs, progress) as bar, look():
        drawing = figure.draw(Runs(engine, bar.show))
        image = folder / f"{name}.{format}"
        drawing.page.save(image)
    written = [image]
    for ending, table in drawing.tables.items():
        path = folder / f"{name}{ending}.csv"
        head = (
            f"# {figure.number} of Shirazi et al. (2012), by bristle; bristle {__version__}, "
            f"engine {engine}, command: python -m benchmarks paper figures {name}\n"
            "# Damper parameters are reconstructed, not those of the paper's tables.\n"
        )
        write(path, head + table.to_csv(index=False, float_format="%.9g"))
        written.append(path)
    return written


def make_folder(folder: Path) -> None:
    """Refuse a folder that cannot be written before anything is run."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except FileExistsError:
        raise not_usable(f"{folder}: is a file; figures go into a folder.") from None
    except OSError as error:
        raise not_usable(
            f"{folder}: figures cannot be written there: {error.strerror or error}."
        ) from error


def write(path: Path, text: str) -> None:
    """Write a text, or say in a line why it cannot be written."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise not_usable(f"{path}: cannot be written: {error.strerror or error}.") from error
