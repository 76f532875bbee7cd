"""A bench's runs as a diagnosis takes them: one site, the damper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..data.channels import DRIVE
from ..data.checks.levels import tells_a_bend
from ..data.measurement import Measurement
from ..identify.model import Model
from ..identify.rig import DAMPER
from ..identify.structure import StructureProblem
from .conclusion import About
from .finding import Finding
from .law_trials import better_law, try_laws
from .opening import Insufficient, Opening, Progress, opening

NOT_THE_LAW = "No other law leaves a smaller error: it is not the form of the law."


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

    def sites(self) -> tuple[str, ...]:
        """Return the names of the sites that the runs show."""
        return (DAMPER,)

    def open_site(self, site: str) -> Opening | Insufficient | None:
        """Return a site's model fitted and judged; None for another site than the damper."""
        return self.open_damper() if site == DAMPER else None

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

    def beside_other_laws(self, finding: Finding, opened: Opening) -> Finding:
        """Return a finding that leaves an error with how much of it is the form of the law."""
        judged = finding.before if finding.kind == "unknown" else finding.after
        if finding.kind == "insufficient" or judged is None or judged.z <= opened.rule.clean:
            return finding
        if not finding.noise_known:
            return finding
        self._say("trying every law")
        bends = tells_a_bend(self._train)
        laws = try_laws(opened.searched, opened.held_out, judged.model, bends=bends)
        other = better_law(judged, laws, opened.rule)
        told = NOT_THE_LAW if other is None else other.sentence(added=finding.kind != "unknown")
        return replace(finding, other_law=other, reasons=(*finding.reasons, told))

    def about(self) -> About:
        """Return what the verdict tells beside the damper's finding."""
        assert self._opened is not None
        driven = any(m.has(name) for m in (*self._train, *self._holdout) for name in DRIVE)
        return About(sensors=self._opened.faults, noise=self._opened.noise, driven=driven)
