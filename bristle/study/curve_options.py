"""What may be asked of a learned curve: on which part of a model, along which signal."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from ..compare.names import site_name
from ..diagnose.learned.along import ALONG
from ..diagnose.learned.parts import may_change, parts_at
from ..diagnose.learned.place import Place
from ..errors import StudyError


def refuse_elsewhere(
    parts: Sequence[str], along: Sequence[str], place: Place, extra: Sequence[str] = ()
) -> None:
    """Refuse parts and signals that curves do not have at a place.

    Parameters
    ----------
    parts, along : that are asked for
    place : where the curve is to act
    extra : names of the channels that runs hold beside those that bristle knows

    Raises
    ------
    StudyError
        Naming what there is.
    """
    there = parts_at(place)
    signals = [one.name for one in ALONG.values() if place.offers(one.needs)]
    signals += extra if not place.is_line else []
    for asked, known, option in ((parts, list(there), "--as"), (along, signals, "--along")):
        wrong = [one for one in asked if one not in known and one not in there]
        if wrong:
            raise StudyError(
                f"{option}: {site_name(place.name)} has no {', '.join(wrong)}; there are "
                f"{', '.join(known)}."
            )
    pairs = product(parts or there, along or [*signals, *there])
    if not any(may_change(*pair, place) for pair in pairs):
        raise StudyError(
            f"--as {','.join(parts)} --along {','.join(along)}: at {site_name(place.name)} no such "
            "part is learned along such a signal. Leave one of the two options out."
        )
