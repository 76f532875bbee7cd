"""A bench's runs as a diagnosis takes them: one site, the damper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..data.channels import DRIVE
from ..data.measurement import Measurement
from ..identify.model import Model
from ..identify.rig import DAMPER
from ..identify.structure import StructureProblem
from .faults import instruments_of
from .finding import Finding
from .opening import Insufficient, Opening, Progress, opening
from .verdict import Diagnosis
from .verdict_text import of_damper


class BenchRuns:
    """The runs of a damper on a bench; what is asked of them in turn, `diagnosis.diagnose_rig` has.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is
    identified : whether its values were fitted before
    """

    def __init__(
        self,
        train: Sequence[Measurement],
        holdout: Sequence[Measurement],
        present: Model,
        identified: bool,
        say: Progress,
    ) -> None:
        self._train, self._holdout, self._say = train, holdout, say
        self._present, self._identified = present, identified
        self._opened: Opening | None = None

    def lines(self) -> dict[str, tuple[StructureProblem, StructureProblem]]:
        """Return the sites beside the damper: a bench has none."""
        return {}

    def part(self, _site: str) -> Model:
        """Return the part of the model at a site."""
        return self._present

    def correct(self, _findings: dict[str, Finding]) -> None:
        """Do nothing: on a bench no equilibrium tells of the load cell."""

    def open_damper(self) -> Opening | Insufficient:
        """Return the damper's model fitted and judged, or why the data carry no verdict."""
        opened = opening(
            self._train, self._holdout, self._present, identified=self._identified, say=self._say
        )
        self._opened = opened if isinstance(opened, Opening) else None
        return opened

    def excused(self, finding: Finding, _findings: Mapping[str, Finding]) -> Finding:
        """Return the damper's finding as it is."""
        return finding

    def verdict(self, findings: Mapping[str, Finding]) -> Diagnosis:
        """Return the verdict, which is the damper's finding with the instruments that show."""
        opened, found = self._opened, findings[DAMPER]
        assert opened is not None
        renewed = {(one.channel, one.fault) for one in found.sensors}
        first = [one for one in opened.faults if (one.channel, one.fault) not in renewed]
        faults = (*first, *found.sensors)
        made = Diagnosis(
            found.kind, found.effects, of_damper(found, faults), findings,
            sensors=faults, untestable=found.untestable, coordinate=found.coordinate,
            noise=opened.noise,
        )  # fmt: skip
        return without_drive(with_instrument(made), [*self._train, *self._holdout])


def without_drive(found: Diagnosis, runs: Sequence[Measurement]) -> Diagnosis:
    """Return the diagnosis with the doubt that a drive which nobody recorded leaves."""
    driven = any(run.has(channel) for run in runs for channel in DRIVE)
    if driven or found.kind != "unknown":
        return found
    doubt = "Neither voltage nor current was recorded: a drive that changed would look like this."
    return replace(found, words=f"{found.words} {doubt}")


def with_instrument(found: Diagnosis) -> Diagnosis:
    """Return the diagnosis with the instrument named whose effect the channels show."""
    named = instruments_of(found.sensors)
    if not named or found.kind not in ("none", "effect"):
        return found
    return replace(found, kind="effect", effects=(*named, *found.effects))
