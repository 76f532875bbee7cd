"""`bristle.plan`: the next tests of a rig, from Python."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.text import joined, written
from ..errors import StudyError
from ..study.study import Study
from .bench import plan_new, plan_study
from .building import plan_building
from .limits import limits_given, read_rig
from .plan import NAMED, Plan
from .questions import PlanRequest, notes_of_change

Names = str | Sequence[str] | bool | None


def plan(
    study: Study | str | Path,
    *,
    separate: Names = None,
    see: Names = None,
    sharpen: Names = None,
    learn: Names = None,
    rig: str | Path | None = None,
    record: str | Path | Sequence[str | Path] = (),
    seed: int = 1,
    **limits: Any,
) -> Plan:
    """Return the next tests of a rig: motions and commands that show what is not known yet.

    Without a purpose they settle what the verdict leaves open: rivals where it is ambiguous,
    a part without a form where it is unknown, or else all effects and parameters.

    Parameters
    ----------
    study : Study or path
        A study of a damper on a bench, or of a building; or a rig.toml with `[damper]` and
        `[limits]`, before the first measurement.
    separate : str or sequence of str, optional
        Rivals to tell apart: effects, laws, or "none" for the model as it is.
    see : str, sequence of str or True, optional
        Effects to make visible; True for all that can be.
    sharpen : str, sequence of str or True, optional
        Parameters to know better, or effects whose parameters these are; True for all.
    learn : str, sequence of str or True, optional
        Coordinates on which an unknown part may depend; True for the usual ones.
    rig : path, optional
        A rig.toml with the limits of the rig; what it does not say is what the runs have done.
    record : str, path or sequence, optional
        Of a building: further ground motions that may be scaled, by name or as files.
    seed : int
        Draws the tests that are looked at.
    limits : float, str or sequence
        Limits as keywords, in place of those, by the names of rig.toml: numbers in SI or texts with
        a unit, such as `stroke="20 mm"`, `runs=6`.

    Returns
    -------
    Plan
        Its tests, what they will show, and `write(folder)` for the files.

    Raises
    ------
    StudyError
        If the limits allow no test, or a purpose names what there is not.
    RecordError
        If a file cannot be read.

    Examples
    --------
    >>> import bristle, pathlib, tempfile
    >>> sheet = pathlib.Path(tempfile.mkdtemp()) / "rig.toml"
    >>> _ = sheet.write_text('''schema = 1
    ... [damper]
    ... law = "bingham"
    ... max_force = "2 kN"
    ... [limits]
    ... stroke = "20 mm"
    ... speed = "250 mm/s"
    ... command = ["0 V", "5 V"]
    ... rate = "100 Hz"
    ... duration = "5 s"
    ... ''')
    >>> tests = bristle.plan(sheet, see="coil_lag", runs=2)
    >>> [run.role for run in tests.runs()]
    ['train', 'holdout']
    """
    request = PlanRequest(*(_names(one) for one in (separate, see, sharpen, learn)))
    _refuse_seed(seed)
    if isinstance(study, str | Path) and Path(study).is_file():
        if rig is not None:
            raise StudyError(f"{study} is a rig.toml itself; rig = {written(rig)} is one too many.")
        _refuse_of_building(study, limits, record)
        return plan_new(Path(study), request, limits=limits, seed=seed)
    opened = study if isinstance(study, Study) else Study(study)
    given = limits_given(limits, opened.drive)
    of_file = read_rig(Path(rig), opened.drive) if rig is not None else {}
    if not opened.settings.has_building:
        _refuse_of_building(opened.folder, limits, record)
    limits = {**of_file, **given}
    opened.model()
    opened.refuse_if_changed()  # where it was opened before others wrote in it
    found: Plan
    if opened.settings.has_building:
        names = [str(one) for one in ((record,) if isinstance(record, str | Path) else record)]
        found = plan_building(opened, request, limits=limits, records=names, seed=seed)
    else:
        found = plan_study(opened, request, limits=limits, seed=seed)
    opened.refuse_if_changed()
    notes = (*notes_of_change(opened), *found.notes)
    return replace(found, notes=notes, first=_first_free(opened))


def _first_free(study: Study) -> int:
    """Return the number of the first test: the next one where an earlier plan is measured.

    Its runs, and their files, would else have the names of those that the study has.
    """
    files = [path.stem for path in (study.folder / "data").glob("*")]
    taken = [re.fullmatch(f"{NAMED}([0-9]{{1,6}})", one, re.IGNORECASE) for one in files]
    return 1 + max((int(one[1]) for one in taken if one), default=0)


def _names(names: Names) -> tuple[str, ...] | None:
    """Return names as a tuple: None for none, empty for all."""
    if names is None or names is False:
        return None
    if names is True:
        return ()
    return (names,) if isinstance(names, str) else tuple(names)


def _refuse_seed(seed: int) -> None:
    if seed < 0:
        raise StudyError(f"seed = {seed}: 0 or a positive whole number is right.")


def _refuse_of_building(bench: str | Path, limits: Mapping[str, Any], record: Any) -> None:
    """Refuse what a damper on a bench does not have, in place of leaving it out."""
    wrong = [name for name in ("damper_stroke", "drift") if name in limits]
    if record or wrong:
        what = "ground motion; record" if record else f"storeys; {joined(wrong)}"
        are = "is" if record or len(wrong) == 1 else "are"
        raise StudyError(f"{bench}: a damper on a bench has no {what} {are} for a building.")
