"""The runs of a bench, or of a building, as a diagnosis takes them.

Equilibrium parts the question. Each storey's shear is known from the accelerations above it,
whatever happens below; what the isolation layer carries is known where the damper's force was
measured; and the damper's force is then held against the damper's law. Without a measured force the
layer and the damper are one unknown, and effects that act alike are named together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ..core.finding import Finding
from ..data.channels import DRIVE
from ..data.checks.runs import tells_a_bend
from ..data.measurement import Measurement
from ..errors import StudyError
from ..identification.building_motion import responses
from ..identification.building_sites import ANY_LAW, StructureProblem, problems_of
from ..identification.problem import Model
from ..identification.rig import DAMPER, at_site, corrected_for_delay, linear_storeys
from ..identification.rig_fit import fit_damper
from ..identification.start_grid import refine
from ..physics.building import GROUND, Building, with_damper
from .building_numbers import (
    Shaken,
    moved_numbers,
    suited_masses,
    text_of_masses,
    with_storeys,
    within_prior,
)
from .conclusion import About
from .law_trials import better_law, try_laws
from .load_cell import load_cell
from .prepared import (
    IN_BUILDING,
    Insufficient,
    Opening,
    Progress,
    corrected,
    lacking_in_building,
    median_noise,
    opening,
)
from .rule import BENCH, INSIDE, RECONSTRUCTED, SITE, DecisionRule
from .sensor_faults import sensor_faults
from .site import excused_by_sensor, left_by_filter, present_at, shortened
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


def blurred(faults: Sequence[Finding]) -> bool:
    """Return whether a velocity at the damper is left out."""
    return any(map(_blurs, faults))


def moves_measured(runs: Sequence[Measurement], building: Building) -> bool:
    """Return whether the velocity of each end of the damper was measured, in every run."""
    return all(run.has(f"{end}_velocity") for run in runs for end in _ends(building))


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


Pair = tuple[StructureProblem, StructureProblem]

OF_STOREY = (
    "The damper's force is what a storey carries beside the spring that the building's file has "
    "there: what is found at the damper may be the storey's own."
)

SEARCHED = 12.0
"""Seconds of each run, from its begin, on which the damper's effects are searched: the strongest
shaking is over. The best are then fitted to all that was recorded; held-out runs stay whole."""


class BuildingRuns:
    """The runs of a building; what is asked of them in turn, `diagnosis.diagnose_rig` has.

    Parameters
    ----------
    train, holdout : measurements to fit to, and those that decide
    present : the model as it is, with the effects of all sites
    building : its masses are taken as known
    free : whether the damper's law is sought: then those samples count that every law tells

    Attributes
    ----------
    lacking : why the runs carry no verdict, None where they do
    """

    def __init__(
        self,
        train: Sequence[Measurement],
        holdout: Sequence[Measurement],
        present: Model,
        building: Building,
        say: Progress,
        free: bool = False,
    ) -> None:
        building = with_damper(building)
        self._device = building.device(building.studied)
        self._building, self._say, self._free = building, say, free
        say("looking for sensor faults")
        self._sensors = tuple(faults_in_building([*train, *holdout], building))
        right = [without_faults(list(runs), self._sensors, building) for runs in (train, holdout)]
        self._noise = median_noise([*right[0], *right[1]])
        self.lacking = lacking_in_building([*train, *holdout], right, self._sensors, self._noise)
        self._velocities = moves_measured([*right[0], *right[1]], building)
        say("smoothing the motion of each level")
        found = responses([*right[0], *right[1]], building)
        found, self._present = corrected_for_delay(found, present)
        self._train, self._holdout = found[: len(right[0])], found[len(right[0]) :]
        self._straight = linear_storeys(self._present.effects)
        shaken = Shaken(self._train, self._holdout, self._present.law, self._straight)
        self._building = suited_masses(shaken, building)
        self._masses = text_of_masses(building, self._building, shaken.measured)
        self._problems = self._made(self._building)
        self._notes: list[str] = []

    def _made(self, building: Building) -> dict[str, Pair]:
        law = ANY_LAW if self._free else self._present.law
        return problems_of(self._train, self._holdout, building, law, self._straight)

    def refuse_lacking(self, folder: Path) -> None:
        """Raise StudyError where the runs carry no verdict, and nothing that rests on one."""
        if self.lacking is not None:
            raise StudyError(f"{folder}: {' '.join(self.lacking.reasons)}")

    def lines(self) -> dict[str, Pair]:
        """Return the sites beside the damper, each with its runs for training and held out."""
        return {site: pair for site, pair in self._problems.items() if site != DAMPER}

    def part(self, site: str) -> Model:
        """Return the part of the model at a site."""
        return at_site(self._present, site, self._problems)

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
        self._say(f"{site}: the load cell")
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
        self._say("damper: what the building's file leaves open")
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

    def suited_to(self, found: SiteDiagnosis) -> bool:
        """Adjust the building's numbers beside what was found at the damper; return whether so.

        Where the force follows from equilibrium, the file's numbers show in what an effect leaves,
        and hardly before.
        """
        if not self._problems[DAMPER][0].reconstructed or found.kind == "none":
            return False
        best = found.after if found.kind != "unknown" else next(iter(found.trials), None)
        if best is None or max(best.z, best.train) <= BENCH.adequate:
            return False
        return self._suit(best.model)

    def _suit(self, damper: Model) -> bool:
        """Take the building that suits a damper's model best, within what is known; or leave it."""
        law, straight = self._present.law, self._straight
        train = self._problems[DAMPER][0]
        fitted = fit_damper(train, damper).model
        known = within_prior(fitted, self._train, self._building, law, straight)
        suited = self._made(known)
        if not _suits(suited[DAMPER], self._problems[DAMPER], damper):
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
        law = ANY_LAW if self._free else self._present.law
        made = problems_of(found, [], self._building, law, self._straight)
        return {site: pair[0] for site, pair in made.items()}

    def sites(self) -> tuple[str, ...]:
        """Return the names of the sites that the runs show."""
        return tuple(self._problems)

    def open_site(self, site: str) -> Opening | None:
        """Return a site's model fitted and judged, None where the runs do not show that site."""
        if site == DAMPER:
            return self.open_damper()
        if site not in self._problems:
            return None
        train, held_out = self._problems[site]
        before = present_at(site, train, held_out, self.part(site))
        return Opening(
            before, train, held_out, self._sensors, self._noise, rule=SITE, scope=IN_BUILDING
        )

    @property
    def damper(self) -> Pair | None:
        """The damper's runs for training and held out, None where no damper was measured."""
        return self._problems.get(DAMPER)

    def suppose(self, damper: Model) -> None:
        """Take a damper's law, fitted, in the place of the model's, whose other effects stay."""
        own = self.part(DAMPER).effects
        elsewhere = tuple(name for name in self._present.effects if name not in own)
        values = {n: v for n, v in self._present.values.items() if n.partition(".")[0] in elsewhere}
        effects = (*damper.effects, *elsewhere)
        self._present = replace(damper, effects=effects, values={**values, **damper.values})

    def open_damper(self) -> Opening | None:
        """Return the damper's law fitted and judged, None where no damper was measured."""
        if DAMPER not in self._problems:
            return None
        self._say("damper: its law, then effects")
        train, held_out = self._problems[DAMPER]
        model = refine(fit_damper(train, self.part(DAMPER)).model, train)
        return self.opened_with(judge(model, train, held_out))

    def opened_with(self, before: Trial) -> Opening:
        """Return what a look at the damper begins with.

        Parameters
        ----------
        before : the trial of a model that was fitted to its runs
        """
        train, held_out = self._problems[DAMPER]
        # A force that no load cell shows cannot be late.
        shown, rule = ((), RECONSTRUCTED) if train.reconstructed else (SHOWN, INSIDE)
        return Opening(
            before, train, held_out, self._sensors, self._noise, shown,
            shortened(train, SEARCHED), rule, IN_BUILDING,
        )  # fmt: skip

    def excused(
        self, finding: SiteDiagnosis, findings: Mapping[str, SiteDiagnosis]
    ) -> SiteDiagnosis:
        """Return the damper's finding, not unknown where an instrument explains what is left."""
        if blurred(self._sensors) or not self._velocities:
            why = "Without the velocity of the base, its reversals are not located exactly."
            finding = excused_by_sensor(finding, BENCH.blurred, why)
        beside = findings.get(self._beside)
        if beside is not None and late_values(beside):
            most = left_by_filter(self._present.law, *self._problems[DAMPER])
            why = "The load cell is late in a different functional form."
            finding = excused_by_sensor(finding, most, why)
        return finding

    def beside_other_laws(self, finding: SiteDiagnosis, _opened: Opening) -> SiteDiagnosis:
        """Return the damper's finding: the law decides which samples of a building count."""
        return finding

    def about(self) -> About:
        """Return what the verdict tells beside the findings of the sites."""
        reconstructed = DAMPER in self._problems and self._problems[DAMPER][0].reconstructed
        force = "reconstructed" if reconstructed else "measured"
        beside = self._device.on_first
        notes = (*self._masses, *self._notes)
        if reconstructed and not beside:
            notes = (*notes, OF_STOREY)
        return About(force, self._sensors, self._noise, notes, beside_layer=beside)


def _suits(suited: Pair, given: Pair, damper: Model, rule: DecisionRule = BENCH) -> bool:
    """Return whether moved numbers of a building explain what the file's leave, held-out runs too.

    What an effect does they may follow in part; then they are the file's still.
    """

    def left(pair: Pair) -> float:
        base = fit_damper(pair[0], damper)
        return rule.excess(judge(base.model, *pair).z)

    return left(suited) <= rule.moved * left(given)


def _rounded(layer: SiteDiagnosis, rule: DecisionRule = SITE) -> bool:
    """Return whether a load cell is late in a way that moving its record ahead does not undo.

    A filter rounds the force besides. That cannot be taken back, but it can be put on the model.
    """
    return bool(late_values(layer)) and layer.z_after > rule.clean


def _late(present: Model, layer: SiteDiagnosis) -> Model:
    """Return the model whose damper's force is shown as late as equilibrium says."""
    effects = (*present.effects, *layer.effects)
    return replace(present, effects=effects, values={**present.values, **late_values(layer)})


# A bench's runs as a diagnosis takes them: one site, the damper.

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

    def correct(self, _findings: dict[str, SiteDiagnosis]) -> None:
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

    def excused(
        self, finding: SiteDiagnosis, _findings: Mapping[str, SiteDiagnosis]
    ) -> SiteDiagnosis:
        """Return the damper's finding as it is."""
        return finding

    def beside_other_laws(self, finding: SiteDiagnosis, opened: Opening) -> SiteDiagnosis:
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
