"""A building's runs as a diagnosis takes them: what equilibrium tells at each site, and of what.

Equilibrium parts the question. Each storey's shear is known from the accelerations above it,
whatever happens below; what the isolation layer carries is known where the damper's force was
measured; and the damper's force is then held against the damper's law. Without a measured force the
layer and the damper are one unknown, and effects that act alike are named together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ..data.measurement import Measurement
from ..errors import StudyError
from ..identify.assigned import at_site, corrected_for_delay, linear_storeys
from ..identify.model import Model
from ..identify.response import responses
from ..identify.rig import DAMPER
from ..identify.search_context import refine
from ..identify.site_fit import fit_damper
from ..identify.structure import ANY_LAW, StructureProblem, problems_of
from ..physics.building import Building, with_damper
from .building_prior import moved_numbers, with_storeys, within_prior
from .building_sensors import blurred, faults_in_building, moves_measured, without_faults
from .candidates import SHOWN, Trial, judge
from .conclusion import About
from .damper import excused_by_sensor, left_by_filter
from .finding import Finding
from .load_cell import load_cell
from .masses import Shaken, suited_masses, text_of_masses
from .opening import IN_BUILDING, Opening, Progress, lacking_in_building, median_noise
from .rule import BENCH, INSIDE, RECONSTRUCTED, SITE, DecisionRule
from .sites import present_at, shortened
from .verdict import late_values

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

    def correct(self, findings: dict[str, Finding]) -> None:
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

    def _correct_load_cell(self, site: str, findings: dict[str, Finding]) -> None:
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

    def _correct_building(self, findings: Mapping[str, Finding]) -> None:
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

    def suited_to(self, found: Finding) -> bool:
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

    def excused(self, finding: Finding, findings: Mapping[str, Finding]) -> Finding:
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

    def beside_other_laws(self, finding: Finding, _opened: Opening) -> Finding:
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


def _rounded(layer: Finding, rule: DecisionRule = SITE) -> bool:
    """Return whether a load cell is late in a way that moving its record ahead does not undo.

    A filter rounds the force besides. That cannot be taken back, but it can be put on the model.
    """
    return bool(late_values(layer)) and layer.z_after > rule.clean


def _late(present: Model, layer: Finding) -> Model:
    """Return the model whose damper's force is shown as late as equilibrium says."""
    effects = (*present.effects, *layer.effects)
    return replace(present, effects=effects, values={**present.values, **late_values(layer)})
