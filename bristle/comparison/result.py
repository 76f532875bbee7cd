"""What a comparison found: a prediction held against measured runs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from ..identification.error import ForceError
from ..physics.drive import DRIVES, Drive
from ..view import Viewable
from .conditions import LabelError, Regime
from .misfit import CLOSE, RunMisfit, SiteMisfit
from .patterns import ResidualPattern
from .predictions import RunPrediction
from .spectrum import Spectrum


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Viewable):
    """A prediction held against measured runs; `bristle.compare` returns it, a notebook shows it.

    Attributes
    ----------
    quantity, unit : str
        What is compared: "force", "N".
    runs : tuple of RunMisfit
        The error of each run; `total` over all.
    z_interval : tuple of float
        The 95 % interval of the total z, which is error / noise.
    patterns : tuple of ResidualPattern
        On which coordinate the residual depends, the most telling first; `second` is that of what
        is left after the first, None where chance explains the rest.
    spectrum : Spectrum
        The residual's against the noise's.
    regimes : tuple of Regime
        z in classes of speed and command.
    predictions : tuple of RunPrediction
        The runs themselves, measured and predicted.
    sentences : tuple of str
        What an engineer would say.
    seen : bool or None
        Whether the runs were those of the fit, None where nobody knows.
    role : str
        "test" where the runs are those that neither a fit nor a verdict has seen.
    sites : tuple of SiteMisfit
        The errors of a building's sites, the worst first, of which this is the comparison of one,
        `site`.
    labels : tuple of LabelError
        The error by what is known of whole runs, where that differs between them.

    Examples
    --------
    >>> import bristle, numpy as np
    >>> t = np.arange(0.0, 8.0, 0.004)  # s
    >>> v = 72e-3 * np.cos(9.0 * t)  # m/s
    >>> noise = np.random.default_rng(1).normal(0.0, 0.05, t.size)
    >>> run = {"time": t, "velocity": v, "force": 5.0 * np.sign(v) + 90.0 * v + noise}  # s, m/s, N
    >>> comparison = bristle.compare(run, "bingham_standard")  # at its defaults
    >>> comparison.right, comparison.z > 2.0
    (False, True)
    """

    quantity: str
    unit: str
    runs: tuple[RunMisfit, ...]
    total: RunMisfit
    z_interval: tuple[float, float]
    patterns: tuple[ResidualPattern, ...]
    second: ResidualPattern | None
    spectrum: Spectrum
    regimes: tuple[Regime, ...]
    predictions: tuple[RunPrediction, ...]
    sentences: tuple[str, ...] = ()
    seen: bool | None = False
    sites: tuple[SiteMisfit, ...] = ()
    role: str = ""
    labels: tuple[LabelError, ...] = ()

    @property
    def site(self) -> str:
        """The site of a building that is compared, "" on a bench."""
        return self.predictions[0].site

    @property
    def drive(self) -> Drive:
        """What commands the damper in these runs."""
        return DRIVES[self.predictions[0].drive]

    @property
    def z(self) -> float:
        """RMS(residual)/noise expected of a true model, over all runs."""
        return self.total.z

    @property
    def error(self) -> ForceError:
        """The error over all runs."""
        return self.total.error

    @property
    def noise_known(self) -> bool:
        """Whether z says something: else it is NaN."""
        return self.z == self.z

    @property
    def right(self) -> bool:
        """Whether noise explains the error; of a building's site, with all sites looked at."""
        if not self.noise_known:
            return False
        if self.sites:
            return not next(one.fails for one in self.sites if one.site == self.site)
        return self.z <= CLOSE

    @property
    def first(self) -> ResidualPattern | None:
        """The coordinate that organises the residual most, None where chance explains all."""
        return self.patterns[0] if self.patterns and self.patterns[0].significant else None

    @property
    def worst(self) -> RunPrediction:
        """The run with the largest z."""
        name = max(self.runs, key=lambda run: run.z).name
        return next(one for one in self.predictions if one.name == name)

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as JSON has it, without the samples."""
        of_building = {"site": self.site, "sites": [one.as_dict() for one in self.sites]}
        return {
            **(of_building if self.sites else {}),
            "quantity": self.quantity,
            "unit": self.unit,
            "held_out": None if self.seen is None else not self.seen,
            "sentences": list(self.sentences),
            "z": self.z,
            "z_interval": list(self.z_interval),
            "total": self.total.as_dict(),
            "runs": [run.as_dict() for run in self.runs],
            "places": [one.as_dict() for one in self.patterns],
            "second": self.second.as_dict() if self.second else None,
            "bands": [asdict(band) for band in self.spectrum.bands],
            "regimes": [one.as_dict() for one in self.regimes],
            **({"labels": [one.as_dict() for one in self.labels]} if self.labels else {}),
        }
