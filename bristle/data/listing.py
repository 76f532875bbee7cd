"""What a list of ground motions says of each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Listing:
    """One ground motion that has a name, as `bristle list` shows it.

    `peak` is the largest absolute acceleration [m/s2], `duration` the time from first to last
    sample [s]; `needs` is the command that installs what is missing, "" where nothing is needed.
    """

    name: str
    station: str
    peak: float
    duration: float
    source: str
    needs: str = ""
