"""The folder of a run: results.csv or results.parquet, figure.png, spectrum.csv and log."""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ..errors import RunError, not_usable
from .results import CsvWriter, Table, cannot_write, write_parquet

if TYPE_CHECKING:
    import pandas as pd

FORMATS = ("csv", "parquet")
_OURS = ("results.csv", "results.parquet", "figure.png", "spectrum.csv", "log")


class Output:
    """Where a run's files go; None as the folder means that nothing is written.

    `show` gets the warnings and notes of the scenario's check before the run; by default they are
    in the log alone.

    Raises
    ------
    RunError
        The folder cannot be made or written to, exit code 2.
    """

    def __init__(
        self,
        folder: Path | None,
        format: str = "csv",
        show: Callable[[str], None] = lambda line: None,
    ) -> None:
        if format not in FORMATS:
            raise not_usable(f'format "{format}" is not known; there are: {", ".join(FORMATS)}.')
        self.folder = folder
        self.format = format
        self.show = show
        self._made: list[Path] = []
        self._writer: CsvWriter | None = None
        self._log: TextIO | None = None
        self._told: set[str] = set()
        self.failed: RunError | None = None
        if folder is not None:
            self._prepare(folder)

    @property
    def results(self) -> Path | None:
        """The results file, None if nothing is written."""
        return self.folder / f"results.{self.format}" if self.folder else None

    @property
    def written(self) -> int:
        """The number of rows that are on disk."""
        return self._writer.rows if self._writer else 0

    def begin(self, table: Table, made: Mapping[str, Any], remarks: Iterable[str] = ()) -> None:
        """Write the first rows and log remarks; from now on there is a file that can be read."""
        if self.folder is None:
            return
        for name in _OURS[:4]:
            if name != "results.csv" or self.format != "csv":  # that one is replaced at once
                try:
                    (self.folder / name).unlink(missing_ok=True)
                except OSError as error:
                    raise cannot_write(self.folder / name, error, 0) from error
        if self.format == "csv":
            self._writer = CsvWriter(self.folder / "results.csv", table, made)
        for line in remarks:
            self.log(line)

    def write(self, table: Table) -> None:
        """Append rows to a CSV file; a Parquet file is written whole at the end."""
        if self._writer:
            self._writer.write(table)
        if self.failed:
            raise self.failed

    def finish(self, frame: pd.DataFrame) -> None:
        """Mark the file as complete or incomplete; a Parquet file is written now."""
        if self._writer:
            made = frame.attrs["made"]
            self._writer.finish(
                frame.attrs["complete"], made["wall_time"], made.get("energy_residual")
            )
        elif self.folder is not None:
            write_parquet(frame, self.folder / "results.parquet")
        if self.failed:
            raise self.failed

    def warn(self, line: str) -> None:
        """Write a line to the log and show it, once, on stderr."""
        self.log(f"warning: {line}")
        if line not in self._told:
            self._told.add(line)
            logging.getLogger("bristle").warning(line)

    def log(self, line: str) -> None:
        """Write a line to the log at once: what comes next may end the process.

        A log that cannot be written fails the next `write` or `finish`, not the FMU that spoke.
        """
        if self.folder is None:
            return
        path = self.folder / "log"
        try:
            if self._log is None:
                self._log = path.open("w", encoding="utf-8", buffering=1)
            self._log.write(line + "\n")
        except OSError as error:
            self.failed = cannot_write(path, error, self.written)

    def close(self) -> None:
        """Close the files; folders that were made for nothing are removed."""
        if self._log:
            with suppress(OSError):  # what could not be written has been reported
                self._log.close()
        if self._writer:
            self._writer.close()
        for folder in reversed(self._made):
            if any(folder.iterdir()):
                break
            folder.rmdir()

    def _prepare(self, folder: Path) -> None:
        missing = [part for part in (folder, *folder.parents) if not part.exists()]
        self._made = missing[::-1]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except FileExistsError:
            raise not_usable(f"{folder}: is a file; results go into a folder.") from None
        except OSError as error:
            raise not_usable(
                f"{folder}: results cannot be written there: {error.strerror or error}."
            ) from error
