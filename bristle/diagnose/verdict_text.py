"""A verdict in words: what a damper lacks, or what is missing at the sites of a building."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..physics.effect import EFFECTS
from .faults import SensorFault, words_of
from .finding import Finding
from .remaining_residual import sentences


def of_damper(found: Finding, faults: Sequence[SensorFault]) -> str:
    """Return the verdict on a bench: the damper's reasons, and what the channels show."""
    texts = [*found.reasons, *words_of(faults)]
    if found.kind == "none":
        texts.append(
            f"An effect that leaves {found.detectable:.2%} of the force would have been seen."
        )
    if found.kind == "unknown":
        texts += sentences(found.coordinate, found.patterns)
    return " ".join(texts)


def of_sites(
    kind: str,
    effects: tuple[str, ...],
    sites: Mapping[str, str],
    alike: Mapping[str, str],
    coordinate: str,
) -> str:
    """Return the verdict on a building.

    Parameters
    ----------
    kind, effects : of the verdict, as in verdict.json
    sites : the site of each effect
    alike : what acts like an effect where no load cell tells, and why
    coordinate : along which an unknown residual is organised
    """
    texts = []
    if kind == "none":
        texts.append("No effect is missing at any site that these runs test.")
    elif kind == "effect":
        texts.append(f"Missing: {', '.join(f'{e} ({sites[e]})' for e in effects)}.")
    elif kind == "class":
        others = [twin for twin in alike if twin not in EFFECTS]
        texts.append(
            f"Missing is one of {', '.join([*effects, *others])}; these runs cannot say which."
        )
    else:
        texts.append(f"Something is missing that no effect explains, along {coordinate}.")
        texts += [f"Besides, {e} is missing ({sites[e]})." for e in effects if e in sites]
    for reason in alike.values():
        texts.append(f"Without a measured force {reason}: a load cell at the damper would tell.")
    return " ".join(texts)
