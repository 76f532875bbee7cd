"""The test runs of a study, which no choice sees, and how often they have been opened."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from ..core.config import other_schema
from ..data.files import read_json, write_json
from ..errors import StudyError
from .run_file import TEST
from .runs import Runs, refuse_seen, usable

if TYPE_CHECKING:
    from .study import Study

FILE = "test_openings.json"
"""Where a study counts."""


@dataclass(frozen=True)
class Opening:
    """A comparison of a model with the test runs: when (UTC), and the step of that model."""

    date: str
    step: int


def runs_for_test(study: Study, runs: Runs) -> Runs:
    """Return the runs for training, and the test runs in place of those held out.

    Parameters
    ----------
    study : the study
    runs : its other runs, with none of which a test run may be identical

    Raises
    ------
    StudyError
        If the study has no test run, or one is among its other runs.
    RecordError
        If a file cannot be read.
    """
    if not study.files(TEST):
        raise StudyError(
            f'{study.folder / "study.toml"}: no run has role = "{TEST}". Give it to runs before '
            "they are compared with any model: bristle study new NAME --data 'lab/*.csv' --test "
            "'last_*.csv'"
        )
    found, idle = usable(study.read(TEST))
    refuse_seen(runs.all, found)
    return Runs(runs.train, found, idle)


def openings(study: Study) -> tuple[Opening, ...]:
    """Return when the test runs were opened, the first time first.

    Raises
    ------
    StudyError
        If the file that counts is damaged.
    """
    path = study.folder / FILE
    if not path.is_file():
        return ()
    data = read_json(path)
    if data.get("schema") != 1:
        raise StudyError(f"{path}: {other_schema(data.get('schema'))}")
    try:
        return tuple(Opening(str(one["date"]), int(one["step"])) for one in data["openings"])
    except (KeyError, TypeError, ValueError):
        raise StudyError(
            f"{path}: it counts the openings of the test runs, and is damaged. Restore it from a "
            "copy of the study."
        ) from None


def count_opening(study: Study) -> None:
    """Write down that the test runs are opened now, for the present model.

    Raises
    ------
    StudyError
        If the study cannot be written, or the file that counts is damaged.
    """
    with study.writing():
        numbers = study.history.numbers()
        now = datetime.now(UTC).isoformat(timespec="seconds")
        counted = (*openings(study), Opening(now, numbers[-1] if numbers else 0))
        write_json(study.folder / FILE, {"schema": 1, "openings": [asdict(one) for one in counted]})


def opened_text(times: int) -> str:
    """Return the sentence that tells how often the test runs have been opened."""
    if times <= 1:
        return "No fit and no verdict has seen these runs; they are opened for the first time."
    return (
        f"These runs have been opened {times} times: their error is no longer that of unseen runs."
    )
