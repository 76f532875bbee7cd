"""Names of runs, no two of which are alike: corrections, roles and faults go by them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from .measurement import stem_of

_PARTS = (" (", ", ")
"""How the name of a part of a run goes on behind that of the run: "run (1 of 2)", "run, first"."""


def names_of_files(files: Sequence[str], ends: Sequence[str] = ()) -> list[str]:
    """Return a name for each run in a file, the shortest that means no other run.

    Parameters
    ----------
    files : (n,) path of the file of each run. Its run is called by its stem; where another one has
        that too, as of run.csv and run.txt, by its whole name; else by its path
    ends : (n,) what tells the runs of one file apart, such as " run 2"; by default nothing

    Returns
    -------
    list of str
        (n,) names.
    """
    ends = ends or [""] * len(files)
    forms = [
        [f"{form}{end}" for form in (stem_of(file), Path(file).name, file)]
        for file, end in zip(files, ends, strict=True)
    ]
    longer = [0] * len(files)
    while True:
        names = [own[k] for own, k in zip(forms, longer, strict=True)]
        counts, wholes = Counter(names), {whole for name in names for whole in _wholes(name)}
        doubtful = [
            k
            for k, name in enumerate(names)
            if longer[k] < len(forms[k]) - 1 and (counts[name] > 1 or name in wholes)
        ]
        if not doubtful:
            return names
        for k in doubtful:
            longer[k] += 1


def is_part(name: str, whole: str) -> bool:
    """Return whether a name is that of a run or of a part of it."""
    return name == whole or name.startswith(tuple(f"{whole}{part}" for part in _PARTS))


def _wholes(name: str) -> list[str]:
    """Return of which runs' parts this could be the name."""
    return [name[:k] for part in _PARTS for k in range(len(name)) if name.startswith(part, k)]
