"""The fits of a search for the law, kept as they are made: an interrupted one goes on there."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Mapping

from ..data.files import read_json
from ..data.model import StudyModel
from ..data.model_text import model_text
from ..errors import BristleError
from ..interrupt import keeps
from ..version import __version__
from .study import Study

NAME = "law_fits.json"
"""Where they are, in reports/."""


class LawFits:
    """The fits of laws to a study's training runs: what is known of them, and where more go.

    Those of other data, of another model or code, or of another version of bristle do not count.

    Parameters
    ----------
    study : the folder, opened
    model : the present one, whose effects the laws have
    """

    def __init__(self, study: Study, model: StudyModel) -> None:
        self._study = study
        self._key = _key(study, model)
        self.known: dict[str, dict[str, float]] = _read(study, self._key)
        self._lock = threading.Lock()

    def keep(self, fitted: Mapping[str, Mapping[str, float]]) -> None:
        """Write the values of laws [SI] by law and name, beside those that are there."""
        with self._lock:
            self.known |= {law: dict(values) for law, values in fitted.items()}
            content = {"schema": 1, "key": self._key, "laws": self.known}
            self._study.write_report(NAME, json.dumps(content, indent=1) + "\n")
            count = len(self.known)
        keeps(
            f"The fit{'s' * (count > 1)} of {count} law{'s' * (count > 1)} "
            f"{'are' if count > 1 else 'is'} kept, the search for effects is not: the same command "
            "goes on there."
        )


def _read(study: Study, key: str) -> dict[str, dict[str, float]]:
    path = study.reports_folder / NAME
    try:
        found = read_json(path) if path.is_file() else {}
        if found.get("key") != key:
            return {}
        return {
            str(law): {str(n): float(v) for n, v in values.items()}
            for law, values in found["laws"].items()
        }
    except (BristleError, KeyError, TypeError, ValueError, AttributeError):
        return {}  # a file that somebody changed: the fits are made anew


def _key(study: Study, model: StudyModel) -> str:
    whole = hashlib.sha256(f"{__version__} {study.data} {model_text(model)}".encode())
    for folder in (study.laws_folder, study.effects_folder):
        for path in sorted(folder.glob("*.py")) if folder.is_dir() else ():
            whole.update(path.read_bytes())
    return whole.hexdigest()[:16]
