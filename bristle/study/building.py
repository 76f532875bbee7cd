"""The building of a study alone: its stiffnesses and damping ratios from its own response."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..data.files import write_whole
from ..errors import StudyError
from ..identify.building import StructureFit, equilibrium, identify_structure
from ..identify.building_file import building_text
from ..physics.building import Building, frequencies
from ..progress import tell
from ..quantity import plain
from .history import Step
from .rig import building_of
from .study import Study


@dataclass(frozen=True)
class IdentifiedBuilding:
    """What the response said of the building.

    `given` as it was, `fit` as found on the training runs; `before`, `after` the worst level's z
    and share of its shear on training and held-out runs; `file` the building file that was
    written and `step` the history's new step, None where nothing was.
    """

    given: Building
    fit: StructureFit
    before: dict[str, float]
    after: dict[str, float]
    notes: tuple[str, ...]
    file: Path | None = None
    step: Step | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        fit = self.fit
        stiffness = zip(fit.building.levels(), fit.stiffnesses, fit.std_stiffnesses, strict=True)
        modes = zip(
            fit.frequencies, fit.std_frequencies, fit.damping_ratios, fit.std_damping_ratios,
            strict=True,
        )  # fmt: skip
        return {
            "schema": 1,
            "building": fit.building.name,
            "stiffnesses": [
                {"below": level, "value": float(k), "unit": "N/m", "interval95": _half(s)}
                for level, k, s in stiffness
            ],
            "modes": [
                {
                    "frequency": float(f), "unit": "Hz", "interval95": _half(s),
                    "damping_ratio": float(ratio), "damping_ratio_interval95": _half(spread),
                }
                for f, s, ratio, spread in modes
            ],
            "z": [None if np.isnan(z) else float(z) for z in fit.z],
            "unidentified": list(fit.unidentified),
            "before": self.before,
            "after": self.after,
            "notes": list(self.notes),
            "file": str(self.file.absolute()) if self.file else None,
            "step": self.step.number if self.step else None,
        }  # fmt: skip


def identify_building_alone(study: Study, *, write: bool = True) -> IdentifiedBuilding:
    """Identify the building of a study from its training runs, and judge it on those held out.

    Its masses are taken as given; from motion alone only ratios of stiffness to mass can be told.

    Parameters
    ----------
    write : whether the building found becomes that of the model, as a step of the history

    Raises
    ------
    StudyError
        If the study's rig is no structure, or the study cannot be written.
    RecordError
        If a file cannot be read, a channel is missing, or a stiffness comes out negative.
    """
    model = study.model()
    given = building_of(study, model)
    if given is None:
        raise StudyError(
            f'{study.folder}: rig = "{study.settings.rig}": there is no building in it. '
            "--structure needs a study made with  --rig structure --building FILE"
        )
    runs = study.runs()
    tell("identifying the building")
    fit = identify_structure(runs.train, given)
    tell("holding the building against the runs")
    before: dict[str, float] = {}
    after: dict[str, float] = {}
    for role, part in (("train", runs.train), ("holdout", runs.holdout)):
        for errors, building in ((before, given), (after, fit.building)):
            left = equilibrium(part, building)
            errors[f"z_equilibrium_{role}"] = float(np.nanmax(left.z))
            errors[f"share_equilibrium_{role}"] = float(np.nanmax(left.share))
    found = IdentifiedBuilding(given, fit, before, after, (*runs.notes, *fit.notes))
    if not write:
        return found
    names = study.history.numbers()
    path = study.folder / f"building_{names[-1] + 1 if names else 0}.toml"
    counted = f"{len(runs.train)} training run(s), tested on {len(runs.holdout)} held out"
    origin = (
        f"Identified from the response: {counted}.",
        f"Masses and start values: {model.building or 'the built-in building'}.",
        "Frequencies [Hz]: " + ", ".join(plain(f, 4) for f in frequencies(fit.building)),
        "Comments give half of the 95 % interval.",
    )
    with study.writing():
        write_whole(path, building_text(fit, origin))
    lost = f"; the data do not identify {', '.join(fit.unidentified)}" if fit.unidentified else ""
    step = study.add_step(
        "identify the building", f"its response in {counted}{lost}",
        replace(model, building=path.name), before, after,
    )  # fmt: skip
    return replace(found, file=path, step=step)


def _half(std: float) -> float | None:
    return 1.96 * float(std) if np.isfinite(std) else None
