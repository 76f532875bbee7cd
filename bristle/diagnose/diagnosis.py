"""A diagnosis: from measurements to a verdict, with the evidence for every claim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..data.measurement import Measurement
from ..identify.model import Model
from ..identify.rig import DAMPER
from ..identify.structure import StructureProblem
from ..physics.building import Building
from ..physics.laws import DEFAULT
from .bench import BenchRuns
from .conclusion import conclude
from .damper import look_at_damper
from .detail import detailed
from .equilibrium import BuildingRuns
from .finding import Finding
from .inconsistent_runs import contradicted
from .opening import IN_BUILDING, Insufficient, Opening, Progress, silent
from .rule import SITE
from .sites import look_at
from .verdict import Diagnosis


def diagnose(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    *,
    law: str = DEFAULT,
    effects: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
    fixed: Sequence[str] = (),
    limits: Mapping[str, tuple[float, float]] | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Return which effect a damper's model misses on a test bench.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    law : a damper's law, such as "bingham"
    effects : the effects that the model has already
    values : its parameters where they were identified before, by name in SI; else they are
        identified here
    fixed, limits : parameters that stay as they are, and a user's bounds; see `identify.Model`
    progress : called with a sentence at each stage

    Raises
    ------
    RecordError
        If a run lacks a channel that is needed, or is too short for a fit.
    """
    present = Model(law, tuple(effects), dict(values or {}), tuple(fixed), dict(limits or {}))
    known = values is not None
    return diagnose_rig(train, holdout, present, identified=known, say=progress or silent)


def diagnose_rig(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    building: Building | None = None,
    *,
    identified: bool = False,
    profile: bool = False,
    say: Progress = silent,
) -> Diagnosis:
    """Return what a rig's model is missing, and at which of its sites.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is: the damper's law with the effects of all sites
    building : the building that the damper is in, None for a test bench; its masses are taken as
        known, stiffnesses and damping are fitted anew
    identified : whether the law was fitted on this bench before: it is then refined, not sought
        anew; in a building it always is
    profile : whether the model is fitted again at every limit of an effect
    say : called with a few words at each stage

    Raises
    ------
    RecordError
        If a run lacks a channel that is needed, is too short for a fit, or the building has other
        levels than were measured.
    """
    runs: BenchRuns | BuildingRuns
    if building is None:
        runs = BenchRuns(train, holdout, present, identified, say)
    else:
        runs = BuildingRuns(train, holdout, present, building, say)
        if runs.lacking is not None:
            return _insufficient(runs.lacking)
    findings = look_at_lines(runs, say, profile=profile)
    runs.correct(findings)
    opened = runs.open_damper()
    if isinstance(opened, Insufficient):
        return _insufficient(opened)
    if opened is not None:
        found, opened = look_at_damper(opened, say)
        if isinstance(runs, BuildingRuns) and runs.suited_to(found):
            again = runs.open_damper()
            assert again is not None
            found, opened = look_at_damper(again, say)
        excused = runs.excused(found, findings)
        say("intervals")
        # What an instrument explains contradicts nothing.
        settled = excused if excused is not found else contradicted(found, opened)
        findings[DAMPER] = detailed(
            runs.beside_other_laws(settled, opened), opened, profile=profile
        )
    return conclude(findings, runs.about())


def _insufficient(why: Insufficient) -> Diagnosis:
    return Diagnosis("insufficient", (), why.reasons, sensors=why.faults, noise=why.noise)


def look_at_lines(
    runs: BenchRuns | BuildingRuns, say: Progress = silent, *, profile: bool = False
) -> dict[str, Finding]:
    """Return what the isolation layer and the storeys show, by site; nothing on a bench."""
    findings: dict[str, Finding] = {}
    for name, pair in runs.lines().items():
        say(f"{name}: effects of the structure")
        findings[name] = _line(name, pair, runs.part(name), profile)
    return findings


def _line(
    name: str, pair: tuple[StructureProblem, StructureProblem], present: Model, profile: bool
) -> Finding:
    """Return what a layer or storey shows, on its runs for training and held out."""
    found = look_at(name, *pair, present)
    assert found.before is not None
    opened = Opening(found.before, *pair, rule=SITE, scope=IN_BUILDING)
    return detailed(contradicted(found, opened), opened, profile=profile)
