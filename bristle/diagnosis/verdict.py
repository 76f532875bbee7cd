"""The verdict on a rig: what its sites show, and verdict.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..comparison.patterns import ResidualPattern
from ..core.finding import Finding
from ..errors import StudyError
from ..identification.error import ForceError, pooled
from ..identification.rig import DAMPER, late_effects
from ..physics.effect import EFFECTS
from ..view import Viewable
from . import words as verdict_text
from .decision import missing
from .effect_limits import EffectLimit
from .experiments import Experiment
from .law_choice import LawVerdict
from .rule import BENCH
from .sensor_faults import as_json
from .site_diagnosis import SiteDiagnosis, without_z
from .trials import Trial
from .words import TONES

# What known effects gain where none of them, nor a pair, explains what is missing.


def gains_of(found: SiteDiagnosis) -> list[dict[str, Any]]:
    """Return the effects that lower a site's held-out error by enough, and beyond chance.

    Single ones, the best first; last the pair that gains most, if it gains more than the best one.
    """
    before = found.before
    if found.kind != "unknown" or before is None:
        return []
    able = [trial for trial in found.trials if missing(before, trial, BENCH)]
    rows = [_row(trial, before, found.site) for trial in able[: BENCH.most_alternatives]]
    pair = found.together
    if able and pair is not None and missing(able[0], pair, BENCH):
        rows.append(_row(pair, before, found.site))
    return rows


def _row(trial: Trial, before: Trial, site: str) -> dict[str, Any]:
    return {
        "effects": list(trial.beyond(before)),
        "site": site, "z_holdout": round(trial.z, 4), "gain": round(1.0 - trial.z / before.z, 4),
    }  # fmt: skip


# verdict.json: which schema and kinds are read.

SCHEMA = 2


def current(verdict: Mapping[str, Any], where: str = "verdict.json") -> dict[str, Any]:
    """Return the content of a verdict file, checked.

    Parameters
    ----------
    verdict : the content as it was read
    where : the file, for messages

    Raises
    ------
    StudyError
        If the schema or the kind is none that this version knows.
    """
    schema, kind = verdict.get("schema"), verdict.get("kind")
    if schema != SCHEMA:
        raise StudyError(
            f"{where}: schema = {schema!r}; this version reads {SCHEMA}. "
            "bristle diagnose writes it again."
        )
    if kind not in TONES:
        raise StudyError(
            f"{where}: kind = {kind!r}; there are {', '.join(TONES)}. "
            "bristle diagnose writes it again."
        )
    return dict(verdict)


OF_WORST = (
    "z_holdout_before", "z_holdout_after", "z_train_before", "z_train_after",
    "error_holdout_before", "error_holdout_after", "explained", "organised",
)  # fmt: skip
"""What verdict.json tells of the worst site beside the list of all."""


@dataclass(frozen=True, repr=False)
class Diagnosis(Viewable):
    """The verdict on a rig's model; `bristle.diagnose` returns it, and a notebook shows it.

    Attributes
    ----------
    kind : str
        As in verdict.json: "none", "effect", "ambiguous", "unknown" or "insufficient".
    effects : tuple of str
        The effects that are missing; of "ambiguous" one of them is.
    reasons : tuple of str
        Why, in sentences.
    findings : mapping of SiteDiagnosis
        What each site shows, the damper's last.
    sensors : tuple of Finding
        Faults that the channels show of each other.
    untestable : tuple of str
        Effects that the runs do not excite, or that the model absorbs.
    coordinate : str
        What an unknown residual depends on.
    sites : mapping of str
        The site of each effect.
    alternatives : tuple of str
        What would look like one of them: what is no effect, or the same one at another site.
    force : str
        "measured" or "reconstructed".
    noise : mapping of float
        Noise of each channel, as far as it was asked for, in SI.
    laws : LawVerdict or None
        How all laws do, where laws and effects were sought together.
    error : mapping of mapping of ForceError
        By role, "train" or "holdout", and site: the error of the model as it was given, on the runs
        as they are; none where nobody fitted that model.
    written : mapping of str
        The text of each effect that this diagnosis made and names: how a parameter depends on a
        label of the runs. They stay defined; a study keeps them as files.

    Examples
    --------
    >>> import bristle
    >>> verdict = bristle.Diagnosis("none", (), ("On held-out runs z = 1.02.",))
    >>> verdict.kind, verdict.effects
    ('none', ())
    """

    kind: str
    effects: tuple[str, ...]
    reasons: tuple[str, ...]
    findings: Mapping[str, SiteDiagnosis] = field(default_factory=dict)
    sensors: tuple[Finding, ...] = ()
    untestable: tuple[str, ...] = ()
    coordinate: str = ""
    sites: Mapping[str, str] = field(default_factory=dict)
    alternatives: tuple[str, ...] = ()
    force: str = "measured"
    noise: Mapping[str, float] = field(default_factory=dict)
    laws: LawVerdict | None = None
    error: Mapping[str, Mapping[str, ForceError]] = field(default_factory=dict)
    written: Mapping[str, str] = field(default_factory=dict)

    @property
    def law(self) -> str:
        """The law that the runs prefer, "" where the law was given."""
        return self.laws.name if self.laws is not None else ""

    @property
    def words(self) -> str:
        """The verdict in sentences."""
        return str(self.as_dict()["words"])

    @property
    def worst(self) -> SiteDiagnosis | None:
        """What the site shows whose model errs the most on held-out runs, None without a site."""
        return max(self.findings.values(), key=lambda found: found.z_before, default=None)

    @property
    def before(self) -> Trial | None:
        """The trial of the model as it was, refitted, at the worst site."""
        return self.worst.before if self.worst is not None else None

    @property
    def after(self) -> Trial | None:
        """The trial of the model that the verdict names, at the worst site."""
        return self.worst.after if self.worst is not None else None

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The trials of single effects at the worst site, best first."""
        return self.worst.trials if self.worst is not None else ()

    @property
    def z_before(self) -> float:
        """z of the model as it was on held-out runs, at the worst site."""
        return self.worst.z_before if self.worst is not None else float("nan")

    @property
    def z_after(self) -> float:
        """z of the model that the verdict names, there."""
        return self.worst.z_after if self.worst is not None else float("nan")

    @property
    def reconstructed(self) -> bool:
        """Whether the damper's force was reconstructed from equilibrium."""
        return self.force == "reconstructed"

    @property
    def detectable(self) -> float:
        """The largest of the sites' smallest shares of the force that would have been seen."""
        known = [f.detectable for f in self.findings.values() if np.isfinite(f.detectable)]
        return max(known, default=float("nan"))

    @property
    def limits(self) -> dict[str, tuple[EffectLimit, ...]]:
        """By site, how large each effect that is not named may still be."""
        return {site: found.limits for site, found in self.findings.items() if found.limits}

    @property
    def patterns(self) -> tuple[ResidualPattern, ...]:
        """On which coordinates the residual of the worst site depends."""
        return self.worst.patterns if self.worst is not None else ()

    @property
    def experiment(self) -> Experiment | None:
        """The run that would distinguish alternatives, where one was sought."""
        found = (one.experiment for one in self.findings.values() if one.experiment is not None)
        return next(found, None)

    @property
    def std(self) -> Mapping[str, float]:
        """Standard deviations by parameter [SI] of what the data identify, of `values`."""
        out: dict[str, float] = {}
        for site, found in self.findings.items():
            own = {n: s for n, s in found.std.items() if n.partition(".")[0] in found.effects}
            out.update(found.std if site == DAMPER else own)
        return out

    @property
    def values(self) -> dict[str, float]:
        """Values of the parameters by name [SI], of the law and of the effects named."""
        out: dict[str, float] = {}
        if self._damper is not None and self._damper.model is not None:
            out.update(self._damper.model.values)
        lines = [found for site, found in self.findings.items() if site != DAMPER]
        for finding in lines:
            model = finding.model.values if finding.model is not None else {}
            out.update({n: v for n, v in model.items() if n.partition(".")[0] in finding.effects})
            out.update(late_values(finding))
        storeys = [site for site in self.findings if site.startswith("storey")]
        for name in dict.fromkeys(effect for finding in lines for effect in finding.effects):
            at = [finding.site for finding in lines if name in finding.effects]
            # One that is in every storey has the number 0, its default.
            in_one = name in EFFECTS and "which" in EFFECTS[name].parameters
            if in_one and len(at) == 1 < len(storeys):
                out[f"{name}.which"] = float(at[0].removeprefix("storey"))
        return out

    @property
    def refined(self) -> dict[str, Any]:
        """The effects that the refitted model holds beside the present one, and all its values.

        Those named, or of several alternatives the best; where nothing explains the error, the
        single effect at the damper that leaves the least of it, if one was refined. Empty where
        there is none. `values` by name [SI]: what the data do not identify is there as well, so
        that the model predicts what the diagnosis judged.
        """
        values = self.values
        effects = [one for one in self.effects if any(n.startswith(f"{one}.") for n in values)]
        damper = self._damper
        if self.kind == "unknown" and not effects and damper and damper.before and damper.trials:
            best = damper.trials[0]
            if best.refined:
                effects = [*best.beyond(damper.before)]
                values |= best.model.values
        return {"effects": effects, "values": values} if effects else {}

    @property
    def _damper(self) -> SiteDiagnosis | None:
        return self.findings.get(DAMPER)

    def as_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json."""
        out: dict[str, Any] = {
            "schema": SCHEMA, "kind": self.kind, "effects": list(self.effects),
            "sites": dict(self.sites), "force": self.force, "ranking": self._ranking(),
            "untestable": list(self.untestable),
            "sensors": [as_json(fault) for fault in self.sensors],
            "noise_floor": {name: float(noise) for name, noise in self.noise.items()},
            "findings": [found.as_dict() for found in self.findings.values()],
            "reasons": list(self.reasons),
        }  # fmt: skip
        if self.error:
            out["error"] = {
                role: pooled(one.values()).as_dict() for role, one in self.error.items()
            }
            out["error_by_site"] = {
                role: {site: error.as_dict() for site, error in one.items()}
                for role, one in self.error.items()
            }
        if self.worst is not None:
            shown = self.worst.as_dict()
            out |= {key: shown[key] for key in OF_WORST if key in shown}
        if self.experiment is not None:
            out["separate_by"] = self.experiment.sentence()
        if self.alternatives:
            out["alternatives"] = list(self.alternatives)
        if np.isfinite(self.detectable):
            out["detectable"] = round(self.detectable, 5)
        if self.coordinate:
            out["coordinate"] = self.coordinate
        if self.laws is not None:
            laws = self.laws.as_dict()
            out |= laws if self.noise_known else without_z(laws)
        if refined := self.refined:
            out["refined"] = refined
        if self.worst is not None and (gains := gains_of(self.worst)):
            out["gains"] = gains
        if not self.noise_known:
            out["noise_known"] = False
        return out | {"words": " ".join(verdict_text.sentences(out))}

    @property
    def noise_known(self) -> bool:
        """Whether the noise is known at every site, so that z says something."""
        return all(found.noise_known for found in self.findings.values())

    def _ranking(self) -> list[dict[str, Any]]:
        """Return one row per trial of all sites, the largest gain first."""
        rows: list[dict[str, Any]] = []
        for found in self.findings.values():
            own = [
                {
                    "effect": trial.effects[-1], "site": found.site, "z_holdout": round(trial.z, 4),
                    "z_train": round(trial.train, 4), "gain": round(found.gain(trial), 4),
                    "refined": trial.refined,
                }
                for trial in found.trials
            ]  # fmt: skip
            rows += own if found.noise_known else without_z(own)
        return sorted(rows, key=lambda row: -row["gain"])


def late_values(finding: SiteDiagnosis) -> dict[str, float]:
    """Return the parameter and the time [s] of a finding that the load cell is late, if it is."""
    if len(finding.effects) != 1 or not late_effects([n for n in finding.effects if n in EFFECTS]):
        return {}
    (name,) = finding.effects
    return {f"{name}.{EFFECTS[name].late[0]}": float(finding.coordinate.split()[0])}
