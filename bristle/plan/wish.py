"""What a plan shall be for, as it is asked for, or as a verdict leaves it open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import StudyError
from ..findings import command, unknown
from ..physics.effect import EFFECTS, plain_name
from ..quantity import short_z
from ..study.added_runs import behind_data
from ..study.study import Study


@dataclass(frozen=True)
class Wish:
    """What a plan shall be for: None for a purpose that is not asked for, () for all it can be.

    Attributes
    ----------
    separate : tuple of str
        Rivals: effects, laws, or "none" for the model as it is.
    see : tuple of str
        Effects.
    sharpen : tuple of str
        Parameters of law and effects, or effects.
    learn : tuple of str
        Coordinates on which an unknown part may depend.
    """

    separate: tuple[str, ...] | None = None
    see: tuple[str, ...] | None = None
    sharpen: tuple[str, ...] | None = None
    learn: tuple[str, ...] | None = None

    @property
    def nothing(self) -> bool:
        """Whether no purpose is given."""
        return self == Wish()


def default_wish(study: Study) -> Wish:
    """Return what a plan is for where nobody says: what the verdict leaves open, or else all."""
    verdict = study.verdict() or {}
    kind = verdict.get("kind", "")
    named = tuple(dict.fromkeys(map(plain_name, verdict.get("effects", ()))))
    if kind == "ambiguous" and len(named) > 1 and all(name in EFFECTS for name in named):
        return Wish(separate=named)
    if kind == "unknown":
        return Wish(learn=())
    return Wish(see=(), sharpen=())


def parameters_of(free: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return the parameters that are meant by names of them or of effects; all where empty.

    Raises
    ------
    StudyError
        If a name is that of none.
    """
    out: list[str] = []
    for name in names:
        own = [one for one in free if one == name or one.startswith(f"{name}.")]
        if not own:
            raise StudyError(unknown("parameter", name, free))
        out += own
    return tuple(dict.fromkeys(out)) or tuple(free)


def notes_of_change(study: Study) -> tuple[str, ...]:
    """Return how the data are others than the present model, or its verdict, knows."""
    verdict = study.verdict() or {}
    stale = study.stale(verdict) if verdict else ""
    return tuple(note for note in (behind_data(study), stale) if note)


def note_of_missing(study: Study, there: Sequence[str]) -> tuple[str, ...]:
    """Return what is said of effects that a verdict names and a model lacks, nothing of others.

    Parameters
    ----------
    study : with its verdict
    there : the effects of the model
    """
    verdict = study.verdict() or {}
    if verdict.get("kind") != "effect":
        return ()
    named = [name for name in map(plain_name, verdict["effects"]) if name in EFFECTS]
    missing = [name for name in named if name not in there]
    if not missing:
        return ()
    add = command("add", study.folder, *missing)
    return (f"The model misses {', '.join(missing)}; a plan shows more after  {add} .",)


def errs(z: float) -> str:
    """Return what is said of a model's error over noise."""
    return f"errs by {short_z(z)} times the noise; the plan counts that as noise."
