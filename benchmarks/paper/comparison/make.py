"""Runs the whole comparison and writes it: tables, figures, ledger and one HTML report."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from bristle.component.controller_file import read_controller
from bristle.core.progress import Progress, counted
from bristle.errors import DesignError
from bristle.version import __version__
from bristle.view.style import Page, look

from .. import optimum, stiction
from ..figures import make_folder, write
from ..runs import Drawing, Runs
from . import identification, pictures
from . import page as page_of
from .claims import Numbers, Statement, Verdict, ledger
from .experiment import Comparison, cases, compare, facts, motions
from .page import TABLES, published_table

if TYPE_CHECKING:
    import pandas as pd

KINDS = ("hinf", "lpv")
REPORT = "report.html"
FIGURES: dict[str, tuple[str, Callable[[Comparison], Page | None]]] = {
    "fig13-anti-windup": ("Fig. 13", pictures.anti_windup),
    "fig14-northridge-strong": ("Fig. 14", pictures.northridge_hinf),
    "fig15-northridge-strong-lpv": ("Fig. 15", pictures.northridge_lpv),
    "fig16-northridge-weak": ("Fig. 16", pictures.northridge_weak),
    "fig17-el-centro": ("Fig. 17", pictures.el_centro),
    "summary": ("", pictures.summary),
}
"""File name to the paper's number, "" for this project's own, and what draws it."""
_ROOT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class Report:
    """What the comparison came to.

    `tables` are Tables IV and V by file name; `figures` the images by file name, with the paper's
    number; `seconds` the time that everything took.
    """

    comparison: Comparison
    numbers: Numbers
    ledger: list[tuple[Statement, Verdict]]
    tables: dict[str, pd.DataFrame]
    figures: dict[str, str]
    folder: Path
    files: list[Path]
    seconds: float


def make(folder: Path, newhall: Path | None = None, progress: bool = False) -> Report:
    """Design, run, judge, draw and write the comparison.

    Parameters
    ----------
    folder : Path
        Made where it is missing; files of the same names are replaced.
    newhall : Path, optional
        The record of Newhall Fire Station, 360 deg, as AT2 or two-column CSV.
    progress : bool
        Show a progress bar, on a terminal only.

    Raises
    ------
    RecordError
        If the Newhall file cannot be read.
    DesignError
        If a design fails.
    RunError
        If a run fails; or, with exit code 2, a file cannot be written.
    """
    began = time.perf_counter()
    found, left_out = motions(newhall)
    make_folder(folder)
    total = len(cases(found)) + stiction.RUNS + optimum.RUNS + identification.RUNS
    with designing(folder) as controllers, Progress("controllers", total, progress) as bar:
        # The march that controllers need serves the other runs as well: it alone is compiled.
        Runs()("el_centro_0p6g_clipped", {"run.stop": 0.01})
        runs = Runs(done=bar.show)
        with look():
            peaks, best = stiction.draw(runs), optimum.draw(runs)
        fits = identification.errors(runs)
        comparison = compare(found, left_out, controllers, runs)
        designs = {kind: read_controller(path) for kind, path in controllers().items()}
    numbers = Numbers(
        comparison.table, best.tables[""], peaks.tables["_peaks"], fits, facts(designs, found),
        comparison.strong,
    )  # fmt: skip
    figures = _draw(comparison, peaks, best, folder)
    tables = {name: published_table(comparison, kind) for name, (kind, _) in TABLES.items()}
    claims = ledger(numbers)
    files = [folder / f"{name}.png" for name in figures] + [folder / f"{k}.json" for k in KINDS]
    files += _write_tables(folder, comparison, tables, claims)
    report = Report(
        comparison, numbers, claims, tables, figures, folder, [folder / REPORT, *files],
        time.perf_counter() - began,
    )  # fmt: skip
    write(folder / REPORT, page_of.page(report))
    return report


@contextmanager
def designing(folder: Path) -> Iterator[Callable[[], dict[str, Path]]]:
    """Design the reference controllers into a folder, in a process of its own.

    Yields a function that waits for them and returns their files.
    """
    search = os.pathsep.join([str(_ROOT), os.environ.get("PYTHONPATH", "")])
    with tempfile.TemporaryFile("w+") as errors:
        child = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.paper.reference", "--out", str(folder.absolute()),
             "--only", *KINDS],
            env={**os.environ, "PYTHONPATH": search}, stdout=subprocess.DEVNULL, stderr=errors,
        )  # fmt: skip

        @cache
        def wait() -> dict[str, Path]:
            if child.wait() != 0:
                errors.seek(0)
                raise DesignError(f"a design failed: {errors.read().strip()[-500:]}")
            return {kind: folder / f"{kind}.json" for kind in KINDS}

        try:
            yield wait
        finally:
            child.kill()
            child.wait()


def _draw(comparison: Comparison, peaks: Drawing, best: Drawing, folder: Path) -> dict[str, str]:
    """Write the figures; return their names with the paper's numbers, in its order."""
    pages: dict[str, tuple[str, Page | None]] = {
        "fig5-stiction": ("Fig. 5", peaks.page),
        "fig9-passive-optimum": ("Fig. 9", best.page),
    }
    with look():
        pages |= {name: (number, draw(comparison)) for name, (number, draw) in FIGURES.items()}
    drawn = {}
    for name, (number, page) in counted([*pages.items()], "drawing figure"):
        if page is not None:
            page.save(folder / f"{name}.png", dpi=page_of.DOTS)
            drawn[name] = number
    return drawn


def _write_tables(
    folder: Path,
    comparison: Comparison,
    tables: dict[str, pd.DataFrame],
    claims: list[tuple[Statement, Verdict]],
) -> list[Path]:
    import pandas as pd

    rows = [(s.number, s.section, s.text, v.verdict, v.measured, s.rule, v.why) for s, v in claims]
    names = ["number", "section", "statement", "verdict", "measured", "decided by", "why"]
    written = []
    frames = {**tables, "comparison": comparison.table, "ledger": pd.DataFrame(rows, columns=names)}
    for name, table in frames.items():
        head = (
            f"# {name}; bristle {__version__}, command: python -m benchmarks paper controllers\n"
            "# Damper parameters, weights and the factor 0.45 on the ground motion are "
            "reconstructed, not the paper's own.\n"
        )
        path = folder / f"{name}.csv"
        write(path, head + table.to_csv(index=False, float_format="%.6g"))
        written.append(path)
    return written
