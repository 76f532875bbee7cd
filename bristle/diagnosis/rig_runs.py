"""The runs of a bench, or of a building, as a diagnosis takes them.

Equilibrium parts the question. Each storey's shear is known from the accelerations above it,
whatever happens below; what the isolation layer carries is known where the damper's force was
measured; and the damper's force is then held against the damper's law. Without a measured force the
layer and the damper are one unknown, and effects that act alike are named together.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

from ..core.finding import Finding
from ..core.progress import tell
from ..core.text import joined
from ..data.channels import DRIVE
from ..data.checks.runs import tells_a_bend
from ..data.cut_off import derived_velocity
from ..data.measurement import Measurement
from ..identification.building_motion import responses
from ..identification.building_sites import ANY_LAW, StructurePair, StructureProblem, problems_of
from ..identification.fit import fit_from_starts, refine
from ..identification.problem import Problem
from ..identification.rig import DAMPER, at_site, bench_rig, corrected_for_delay, linear_storeys
from ..identification.rig_fit import fit_damper
from ..model.model import Model
from ..physics.building import GROUND, Building, with_damper
from .building_numbers import (
    Shaken,
    moved_numbers,
    suited_masses,
    text_of_masses,
    with_storeys,
    within_prior,
)
from .clocks import clock_faults
from .conclusion import VerdictContext
from .load_cell import load_cell
from .model_faults import limited_drive, model_based_faults
from .prepared import (
    DRAWS,
    Insufficient,
    Prepared,
    corrected,
    lacking_in_building,
    lacking_on_bench,
    median_noise,
    part_of,
    too_few,
    with_samples,
)
from .rule import BENCH, INSIDE, RECONSTRUCTED, SITE, DecisionRule
from .sensor_faults import sensor_faults
from .site import excused_by_sensor, left_by_filter, prepare_line, shortened
from .site_diagnosis import SiteDiagnosis
from .trials import SHOWN, Trial, judge
from .verdict import late_values

# Faults of the sensors at a building's damper, as those of a bench are told.
#
# The levels at the damper's ends are looked at one by one, the damper's force against the motion
# across it.

BLURRED = ("lag", "high-pass", "delay", "derived")
"""Faults for which a building's velocity is left out: displacement and accelerometer say the same
without them, and what is left of a delay would be held against the law at each reversal."""

_MOTION = ("displacement", "velocity")


def faults_in_building(runs: Sequence[Measurement], building: Building) -> list[Finding]:
    """Return the faults that the channels at a building's damper show of each other.

    Parameters
    ----------
    runs : of the building, the damper's channels called `force` and `voltage`
    building : which knows where its damper is

    Returns
    -------
    list of Finding
        Of the one level of a damper on the ground by the names of a bench, `displacement` and
        `velocity`; of two levels by theirs.
    """
    ends = _ends(building)
    if len(ends) == 1:
        return sensor_faults([_as_bench(run, ends[0]) for run in runs])
    found = [
        replace(
            fault,
            channel=f"{end}_{fault.channel}",
            either=fault.either and f"{end}_{fault.either}",
            text=f"{end}: {fault.text}",
        )
        for end in ends
        for fault in sensor_faults([_as_bench(run, end, force=False) for run in runs])
    ]
    across = sensor_faults([_across(run, *ends) for run in runs])
    return [*found, *(fault for fault in across if fault.channel == "force")]


def without_faults(
    runs: Sequence[Measurement], faults: Sequence[Finding], building: Building
) -> list[Measurement]:
    """Return measurements without the faults of the damper's channels.

    Of velocities that are late or rounded the displacement says the same.

    Parameters
    ----------
    runs : of the building
    faults : as `faults_in_building` found them
    building : which knows where its damper is
    """
    end = _ends(building)[0]
    names = {what: f"{end}_{what}" for what in _MOTION}
    theirs = [replace(f, channel=names.get(f.channel, f.channel)) for f in faults]
    late = {f.channel for f in theirs if _blurs(f)}
    out = corrected(runs, [f for f in theirs if not _blurs(f)])
    if not late:
        return out
    return [
        replace(one, channels={n: v for n, v in one.channels.items() if n not in late})
        for one in out
    ]


def _blurs(fault: Finding) -> bool:
    return fault.channel.endswith("velocity") and fault.kind in BLURRED


def _ends(building: Building) -> list[str]:
    """Return the levels that the damper acts on, the upper one first."""
    lower, upper = building.device(building.studied).levels
    return [building.levels()[i] for i in (upper, lower) if i != GROUND]


def _as_bench(run: Measurement, level: str, force: bool = True) -> Measurement:
    """Return a measurement whose channels of a level are named as those of a bench."""
    names = {f"{level}_{what}": what for what in _MOTION}
    keep = {k: v for k, v in run.channels.items() if k in names or (k == "force" and force)}
    channels = {names.get(k, k): v for k, v in keep.items()}
    noise = {names.get(k, k): v for k, v in run.noise.items() if k in keep}
    return replace(run, channels=channels, noise=noise)


def _across(run: Measurement, upper: str, lower: str) -> Measurement:
    """Return the motion between two levels and the force, named as those of a bench."""
    ends = [_as_bench(run, level) for level in (upper, lower)]
    channels = {k: v for k, v in ends[0].channels.items() if k == "force"}
    noise = {k: v for k, v in ends[0].noise.items() if k == "force"}
    for what in _MOTION:
        if all(end.has(what) for end in ends):
            channels[what] = ends[0][what] - ends[1][what]
            noise[what] = sum(end.noise.get(what, 0.0) ** 2 for end in ends) ** 0.5
    return replace(run, channels=channels, noise=noise)


OF_STOREY = (
    "The damper's force is what a storey carries beside the spring that the building's file has "
    "there: what is found at the damper may be the storey's own."
)

NOT_ANCHORED = (
    "{} was not measured: what of it is slow follows from the springs of the storeys, and {} has "
    "more than a spring. Measure it: without it the damper is not judged."
)

SEARCHED = 12.0
"""Seconds of each run, from its begin, on which the damper's effects are searched: the strongest
shaking is over. The best are then fitted to all that was recorded; held-out runs stay whole."""


class RigRuns(ABC):
    """The runs of a rig as a diagnosis takes them, in turn: the lines first, then the damper.

    Attributes
    ----------
    lacking : why the runs carry no verdict, None where they do; else nothing more is asked of them
    bends : whether the command has levels enough for a parabola
    """

    lacking: Insufficient | None
    bends: bool
    _present: Model

    @property
    @abstractmethod
    def damper(self) -> tuple[Problem, Problem]:
        """The damper's runs for training and held out, where the rig shows that site."""

    def sites(self) -> tuple[str, ...]:
        """Return the names of the sites that the runs show."""
        return (DAMPER,)

    def lines(self) -> tuple[str, ...]:
        """Return the sites beside the damper, whose models are lines."""
        return tuple(site for site in self.sites() if site != DAMPER)

    def part(self, site: str) -> Model:
        """Return the part of the model at a site."""
        return at_site(self._present, site, self.sites())

    @abstractmethod
    def prepare(self, site: str, before: Trial | None = None) -> Prepared:
        """Return what the diagnosis of a site that the runs show begins with.

        Parameters
        ----------
        site : "damper", "layer", "storey1" ...
        before : of the damper, the trial of a model that was fitted to its runs; None fits that of
            the rig
        """

    def in_part(self) -> RigRuns:
        """Return the same with a part of the training runs, where that says nearly as much."""
        return self

    def suppose(self, damper: Model) -> None:
        """Take a damper's law, fitted, in the place of the model's, whose other effects stay."""
        self._present = damper

    def correct(self, findings: dict[str, SiteDiagnosis]) -> None:  # noqa: B027  # a bench has none
        """Set right what the lines tell of the load cell, and of the building's numbers."""

    def suit(self, _found: SiteDiagnosis) -> bool:
        """Adjust the rig's numbers beside what was found at the damper; return whether so."""
        return False

    def excused(
        self, found: SiteDiagnosis, _findings: Mapping[str, SiteDiagnosis]
    ) -> SiteDiagnosis:
        """Return a site's diagnosis, none where instruments explain what is left.

        Parameters
        ----------
        found : what the site lacks
        _findings : what the other sites lack, as far as they were diagnosed
        """
        return found

    @abstractmethod
    def context(self, damper: Prepared | None) -> VerdictContext:
        """Return what the verdict tells beside the sites, from what the damper's began with."""


def runs_of_rig(
    train: Sequence[Measurement],
    holdout: Sequence[Measurement],
    present: Model,
    building: Building | None,
    *,
    identified: bool = False,
    any_law: bool = False,
) -> RigRuns:
    """Return the runs of a bench, or of a building where there is one.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is: the damper's law with the effects of all sites
    building : the building that the damper is in, None for a test bench
    identified, any_law : as `BenchRuns` and `BuildingRuns` take them
    """
    if building is None:
        return BenchRuns(train, holdout, present, identified=identified)
    return BuildingRuns(train, holdout, present, building, any_law=any_law)


class BuildingRuns(RigRuns):
    """The runs of a building.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is, with the effects of all sites
    building : its masses are taken as known
    any_law : whether the damper's law is sought: then those samples count that every law tells

    Attributes
    ----------
    lacking : why the runs carry no verdict, None where they do
    bends : whether the command has levels enough for a parabola
    """

    def __init__(
        self,
        train: Sequence[Measurement],
        holdout: Sequence[Measurement],
        present: Model,
        building: Building,
        *,
        any_law: bool = False,
    ) -> None:
        building = with_damper(building)
        self._device = building.device(building.studied)
        self._building, self._any_law = building, any_law
        self.bends = tells_a_bend(train)
        tell("looking for sensor faults")
        self._sensors = tuple(faults_in_building([*train, *holdout], building))
        right = [without_faults(list(runs), self._sensors, building) for runs in (train, holdout)]
        self._noise = median_noise([*right[0], *right[1]])
        ends = [f"{end}_displacement" for end in _ends(building)]
        self._anchored = [n for n in ends if not all(r.has(n) for part in right for r in part)]
        self.lacking = lacking_in_building([*train, *holdout], right, self._sensors, self._noise)
        tell("smoothing the motion of each level")
        found = responses([*right[0], *right[1]], building)
        found, self._present = corrected_for_delay(found, replace(present, law=present.base_law))
        self._train, self._holdout = found[: len(right[0])], found[len(right[0]) :]
        self._straight = linear_storeys(self._present.effects)
        shaken = Shaken(self._train, self._holdout, self._present.law, self._straight)
        self._building = suited_masses(shaken, building)
        self._masses = text_of_masses(building, self._building, shaken.measured)
        self._problems = self._made(self._building)
        self._notes: list[str] = []

    def _made(self, building: Building) -> dict[str, StructurePair]:
        law = ANY_LAW if self._any_law else self._present.law
        return problems_of(self._train, self._holdout, building, law, self._straight)

    def sites(self) -> tuple[str, ...]:
        """Return the names of the sites that the runs show."""
        return tuple(self._problems)

    def correct(self, findings: dict[str, SiteDiagnosis]) -> None:
        """Set right what the lines tell of the load cell, and of the building's numbers."""
        if DAMPER not in self._problems:
            return
        site = self._beside
        if site in findings and findings[site].kind != "none":
            self._correct_load_cell(site, findings)
        if self._problems[DAMPER][0].reconstructed:
            self._correct_building(findings)

    @property
    def _beside(self) -> str:
        """The site beside the damper whose equilibrium has its force, "" where there is none."""
        if not self._building.isolated and not self._device.name:
            return ""
        level = self._device.lower + 1
        storey = level if self._building.isolated else level + 1
        return f"storey{storey}" if storey else "layer"

    def _correct_load_cell(self, site: str, findings: dict[str, SiteDiagnosis]) -> None:
        tell(f"{site}: the load cell")
        level = self._device.lower + 1
        late = load_cell(findings[site], self._train, self._holdout, self._building, level=level)
        if late is None:
            return
        findings[site], (self._train, self._holdout) = late
        shown = self._problems[DAMPER]
        self._problems = self._made(self._building)
        if _rounded(findings[site]):
            self._problems[DAMPER] = shown
            self._present = _late(self._present, findings[site])

    def _correct_building(self, findings: Mapping[str, SiteDiagnosis]) -> None:
        tell("damper: what the building's file leaves open")
        storeys = {one: found for one, found in findings.items() if one.startswith("storey")}
        self._straight = self._straight and all(one.kind == "none" for one in storeys.values())
        given = 0 if self._building.isolated else 1
        lines = {
            int(site.removeprefix("storey")) - given: found.before.model
            for site, found in storeys.items()
            if found.kind == "none" and found.before is not None and not found.before.effects
        }
        self._building = with_storeys(self._building, lines)
        self._problems = self._made(self._building)
        self._suit(self.part(DAMPER))

    def suit(self, found: SiteDiagnosis) -> bool:
        """Adjust the building's numbers beside what was found at the damper; return whether so.

        Where the force follows from equilibrium, the file's numbers show in what an effect leaves,
        and hardly before. They may do what a second effect does, so that no pair comes before them.
        """
        if not self._problems[DAMPER][0].reconstructed or found.kind == "none":
            return False
        pair = found.together is not None and found.after is found.together
        alone = found.kind != "unknown" and not pair
        best = found.after if alone else next(iter(found.trials), None)
        if best is None or max(best.z, best.train) <= BENCH.adequate:
            return False
        return self._suit(best.model)

    def _suit(self, damper: Model) -> bool:
        """Take the building that suits a damper's model best, within what is known; or leave it."""
        law, straight = self._present.law, self._straight
        given, rule = self._problems[DAMPER], BENCH
        fitted = fit_damper(given[0], damper).model
        known = within_prior(fitted, self._train, self._building, law, straight)
        suited = self._made(known)
        # Held-out runs say too whether the numbers explain what the file's leave: what an effect
        # does they may follow in part, and then they are the file's still.
        left = judge(fit_damper(suited[DAMPER][0], damper).model, *suited[DAMPER]).z
        if rule.excess(left) > rule.building_excess * rule.excess(judge(fitted, *given).z):
            return False
        self._problems, self._notes = suited, moved_numbers(self._building, known)
        return True

    def planned(self, runs: Sequence[Measurement], draws: int) -> dict[str, StructureProblem]:
        """Return, by site, runs that were not measured yet: the channels that they would show.

        Parameters
        ----------
        runs : with one sampling step
        draws : how many draws of the smoother's error

        Raises
        ------
        RecordError
            If a channel is missing, or the base moves in no run.
        """
        found = responses(list(runs), self._building, draws)
        law = ANY_LAW if self._any_law else self._present.law
        made = problems_of(found, [], self._building, law, self._straight)
        return {site: pair[0] for site, pair in made.items()}

    @property
    def damper(self) -> StructurePair:
        """The damper's runs for training and held out, where the rig shows that site."""
        return self._problems[DAMPER]

    def suppose(self, damper: Model) -> None:
        """Take a damper's law, fitted, in the place of the model's, whose other effects stay."""
        own = self.part(DAMPER).effects
        elsewhere = tuple(name for name in self._present.effects if name not in own)
        values = {n: v for n, v in self._present.values.items() if n.partition(".")[0] in elsewhere}
        effects = (*damper.effects, *elsewhere)
        self._present = replace(damper, effects=effects, values={**values, **damper.values})

    def prepare(self, site: str, before: Trial | None = None) -> Prepared:
        """Return what the diagnosis of a site begins with; see `RigRuns`."""
        train, held_out = self._problems[site]
        if site != DAMPER:
            return prepare_line(site, train, held_out, self.part(site), self._sensors, self._noise)
        if before is None:
            tell("damper: its law, then effects")
            model = refine(fit_damper(train, self.part(DAMPER)).model, train)
            before = judge(model, train, held_out)
        # A force that no load cell shows cannot be late.
        shown, rule = ((), RECONSTRUCTED) if train.reconstructed else (SHOWN, INSIDE)
        return Prepared(
            before, train, held_out, self._sensors, self._noise, shown,
            shortened(train, SEARCHED), rule, bench=False,
        )  # fmt: skip

    def excused(self, found: SiteDiagnosis, findings: Mapping[str, SiteDiagnosis]) -> SiteDiagnosis:
        """Return a site's diagnosis, none where instruments explain what is left; see `RigRuns`."""
        if found.site != DAMPER:
            return found
        bent = [s for s, one in findings.items() if s.startswith("storey") and one.kind != "none"]
        if found.kind != "none" and self._anchored and bent:
            why = NOT_ANCHORED.format(joined(self._anchored), joined(bent))
            return replace(found, kind="insufficient", effects=(), reasons=(why,))
        beside = findings.get(self._beside)
        if beside is not None and late_values(beside):
            most = left_by_filter(self._present.law, *self._problems[DAMPER])
            why = "The load cell is late in a different functional form."
            found = excused_by_sensor(found, most, why)
        return found

    def context(self, _damper: Prepared | None) -> VerdictContext:
        """Return what the verdict tells beside the sites."""
        reconstructed = DAMPER in self._problems and self._problems[DAMPER][0].reconstructed
        force = "reconstructed" if reconstructed else "measured"
        beside = self._device.on_first
        notes = (*self._masses, *self._notes)
        if reconstructed and not beside:
            notes = (*notes, OF_STOREY)
        return VerdictContext(force, self._sensors, self._noise, notes, beside_layer=beside)


def _rounded(layer: SiteDiagnosis, rule: DecisionRule = SITE) -> bool:
    """Return whether a load cell is late in a way that moving its record ahead does not undo.

    A filter rounds the force besides. That cannot be taken back, but it can be put on the model.
    """
    return bool(late_values(layer)) and layer.z_after > rule.clean


def _late(present: Model, layer: SiteDiagnosis) -> Model:
    """Return the model whose damper's force is shown as late as equilibrium says."""
    effects = (*present.effects, *layer.effects)
    return replace(present, effects=effects, values={**present.values, **late_values(layer)})


class BenchRuns(RigRuns):
    """The runs of a damper on a bench: one site, the damper.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is, whose effects must act on a bench
    identified : whether its values were fitted before: they are then refined, not sought anew

    Attributes
    ----------
    lacking : why the runs carry no verdict, None where they do
    faults : those that channels show of each other
    """

    def __init__(
        self,
        train: Sequence[Measurement],
        holdout: Sequence[Measurement],
        present: Model,
        *,
        identified: bool = False,
    ) -> None:
        self._present = replace(present, law=present.base_law)
        self._identified = identified
        recorded = [*train, *holdout]
        self.bends = tells_a_bend(train)
        self._driven = any(run.has(name) for run in recorded for name in DRIVE)
        tell("looking for sensor faults")
        self.faults = tuple(sensor_faults(recorded))
        self._noise = median_noise(recorded)
        reasons = lacking_on_bench(recorded, self.faults)
        if not reasons:
            tell("smoothing the motion")
            right = corrected(train, self.faults), corrected(holdout, self.faults)
            used = with_samples(right[0]), with_samples(right[1])
            roles = zip(("for training", "held out"), right, used, strict=True)
            reasons = [too_few(role, runs) for role, runs, left in roles if not left]
            reasons += [fault.text for fault in self.faults] if reasons else []
        self.lacking = Insufficient(tuple(reasons), self.faults, self._noise) if reasons else None
        if not reasons:
            self._damper = bench_rig(*used, DRAWS).sites(present)[DAMPER].pair
        redundant = any(
            run.has("displacement", "velocity") and not derived_velocity(run) for run in train
        )
        self._shown = SHOWN if redundant else (*SHOWN, "velocity")

    @property
    def damper(self) -> tuple[Problem, Problem]:
        """The runs as every model is held against them, freed of the faults, and smoothed."""
        return self._damper

    def part(self, _site: str) -> Model:
        """Return the model: a bench has one site."""
        return self._present

    def prepare(self, _site: str, before: Trial | None = None) -> Prepared:
        """Return what the diagnosis begins with; see `RigRuns`."""
        problem, held_out = self.damper
        if before is None:
            tell("fitting the present model")
            present = self._present
            if self._identified:
                model = refine(present, problem)
            else:
                model = fit_from_starts(problem, replace(present, values={})).model
            before = judge(model, problem, held_out)
        faults = self.faults
        shown = model_based_faults(before, problem, held_out)
        if shown is not None:
            faults += shown.faults
            problem, held_out, before = shown.train, shown.held_out, shown.trial
            if shown.faults[0].kind == "bias":  # found without the effects that are tried next
                problem, held_out = problem.with_free_zero(), held_out.with_free_zero()
                before = judge(before.model, problem, held_out)
        else:
            for look in (limited_drive, clock_faults):
                shown = look(before, problem, held_out)
                if shown is not None:
                    faults += shown.faults
                    problem, held_out, before = shown.train, shown.held_out, shown.trial
        return Prepared(
            before, problem, held_out, faults, self._noise, self._shown, part_of(problem)
        )

    def in_part(self) -> BenchRuns:
        """Return the same with a part of the training runs, where that says nearly as much."""
        train, held_out = self.damper
        part = part_of(train)
        if part is None:
            return self
        made = copy(self)
        made._damper = part, held_out
        return made

    def context(self, damper: Prepared | None) -> VerdictContext:
        """Return what the verdict tells beside the sites."""
        assert damper is not None
        return VerdictContext(sensors=damper.faults, noise=damper.noise, driven=self._driven)
