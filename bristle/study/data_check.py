"""The data check: what to mend in a study's measurements before any model, what cannot be told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.finding import Finding
from ..core.text import command, plain
from ..data.checks.channels import check_channels, check_sizes
from ..data.checks.differing_runs import check_differing_runs
from ..data.checks.motion import (
    check_force,
    check_motion,
    velocity_of_run,
)
from ..data.checks.recording import check_recording
from ..data.checks.runs import (
    Excitation,
    check_label_levels,
    check_labels,
    check_runs,
    excitation_of,
)
from ..data.corrections import Correction
from ..data.measurement import Measurement
from ..data.relation import band
from ..view import Viewable
from .rig import Place, place_of_damper
from .runs import read_runs
from .steps import runs_for_test
from .study import Study
from .study_file import TEST

if TYPE_CHECKING:
    from ..view.style import Page

_LEVELS = ("error", "warning", "note")


@dataclass(frozen=True, repr=False)
class DataCheck(Viewable):
    """What is found, worst first, and what each run excites; `place` is where the damper sits."""

    findings: tuple[Finding, ...]
    excitations: tuple[Excitation, ...]
    runs: tuple[Measurement, ...]
    place: Place = field(default_factory=lambda: Place())

    def page(self) -> Page:
        """Return the picture of all runs, drawn and not yet written."""
        from .pictures import draw_data_check

        return draw_data_check([self.place.seen(run) for run in self.runs], self.place.level)

    @property
    def ok(self) -> bool:
        """Whether nothing must be mended first."""
        return all(finding.level != "error" for finding in self.findings)

    def corrections(self) -> dict[str, list[Correction]]:
        """Return what can be set right, by the name of the run."""
        out: dict[str, list[Correction]] = {}
        for finding in self.findings:
            if finding.fixes:
                out.setdefault(finding.run, []).extend(finding.fixes)
        return out

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as JSON has it."""
        return {
            "ok": self.ok,
            "findings": [
                finding.as_dict("kind", "level", "text", "do", "run", "channel", "value")
                | {"corrections": [one._asdict() for one in finding.fixes]}
                for finding in self.findings
            ],
            "runs": [
                {
                    **asdict(excitation),
                    "rate": run.sampling.rate,
                    "samples": len(run.time),
                    "noise": run.noise,
                    "noise_colour": {
                        channel: facts.colour if facts else "given"
                        for channel, facts in run.noise_facts.items()
                    },
                    "ranges": {
                        channel: [float(values.min()), float(values.max())]
                        for channel, values in run.channels.items()
                    },
                    "extra": {
                        name: [float(one.values.min()), float(one.values.max()), one.unit]
                        for name, one in run.extra.items()
                    },
                }
                for run, excitation in zip(self.runs, self.excitations, strict=True)
            ],
        }


def check_data(study: Study, show: Callable[[int], None] | None = None) -> DataCheck:
    """Check all measurements of a study.

    Test runs are checked one by one: no advice on the other runs or on roles follows from them.

    Parameters
    ----------
    study : Study
    show : callable, optional
        Is told how many runs are done.

    Raises
    ------
    RecordError, StudyError
        If a file cannot be read, or runs cannot be told apart.
    """
    runs = study.runs()
    test = runs_for_test(study, runs) if study.files(TEST) else None
    every = [*runs.all, *(test.holdout if test else [])]
    level, at_damper = "", Place()
    if study.settings.has_building:
        at_damper = place_of_damper(study, runs.all)
        level = at_damper.level
    left_out = study.settings.excluded_text
    findings = [Finding("split", "warning", note) for note in runs.notes if note != left_out]
    findings += [Finding("left out", "note", left_out)] if left_out else []
    findings += [Finding("split", "warning", note) for note in (test.notes if test else ())]
    for done, run in enumerate(every, 1):
        findings += _check_run(run, at_damper)
        if not study.settings.has_building:
            findings += check_sizes(run, velocity_of_run(run))
        if show:
            show(done)
    recorded = every
    if study.settings.rate:  # nulls and lines are where the file has its samples
        recorded = read_runs(study.folder, replace(study.settings, rate=0.0))
    findings += check_recording(recorded)
    doubted = [] if study.settings.has_building else list(check_labels(every))
    findings += doubted
    findings += check_label_levels(runs.train, runs.holdout)
    # Where levels may be others than their runs' names say, no sensor is to blame for the force.
    stated = any(run.levels for run in study.settings.runs)
    if not study.settings.has_building and not (doubted and stated):
        findings += check_differing_runs(runs.all)
    fitted, judged, test_runs = (
        [at_damper.seen(run) for run in part]
        for part in (runs.train, runs.holdout, every[len(runs.all) :])
    )
    together, excitations = check_runs(fitted, judged, level)
    findings += [one for one in together if not (doubted and stated and one.kind == "two rigs")]
    excitations += [excitation_of(run, level) for run in test_runs]
    if study.settings.has_building:
        findings += _unmeasured(runs.all, at_damper)
    findings = [_of_study(_milder(finding, runs.all), study) for finding in findings]
    ordered = [finding for level in _LEVELS for finding in findings if finding.level == level]
    return DataCheck(tuple(ordered), tuple(excitations), tuple(every), at_damper)


def _check_run(run: Measurement, at_damper: Place) -> list[Finding]:
    level = "" if at_damper.ends else at_damper.level
    velocity = velocity_of_run(at_damper.seen(run), at_damper.level)
    findings = [*check_channels(run, velocity), *check_motion(run, level)]
    for other in _other_levels(run, at_damper.level):
        findings += check_motion(run, other)
    if "force" in run.channels and velocity is not None:
        findings += check_force(run, velocity)
    filled = float(np.mean(~run.measured))
    if filled > 0.05:
        text = f"{plain(100 * filled, 2)} % of the samples were missing and are filled."
        findings.append(
            Finding("filled", "warning", text, "Record at a steady rate.", run.name, value=filled)
        )
    if velocity is not None and np.ptp(velocity) > 0.0:
        top = band(velocity, run.step)
        if top > 0.2 / run.step:
            text = (
                f"motion reaches {plain(top / 1.5)} Hz at {plain(run.sampling.rate, 4)} samples "
                "per second: fewer than ten per period."
            )
            findings.append(
                Finding("rate", "warning", text, "Sample faster.", run.name, value=top * run.step)
            )
    return findings


def _milder(finding: Finding, runs: list[Measurement]) -> Finding:
    """Return a channel's standing still as a warning where it moves in other runs."""
    moves = any(np.ptp(run.channels.get(finding.channel, np.zeros(1))) > 0.0 for run in runs)
    if finding.kind == "still" and moves:
        return replace(finding, level="warning", do="Leave it out, unless it is meant to rest.")
    return finding


def _of_study(finding: Finding, study: Study) -> Finding:
    """Return a finding whose commands name the study's folder."""
    _, _, folder = command("study", study.folder).partition("study ")
    do = finding.do.replace("MY_RIG", folder).replace("check FOLDER", f"check {folder}")
    return replace(finding, do=do)


def _other_levels(run: Measurement, level: str) -> list[str]:
    """Return the levels that are not the one that was looked at; none on a bench."""
    if not level:
        return []
    names = [name.rpartition("_displacement")[0] for name in run.channels]
    return [name for name in names if name and name != level]


def _unmeasured(runs: list[Measurement], at_damper: Place) -> list[Finding]:
    findings = []
    there = set.intersection(*(set(run.channels) for run in runs))
    if "ground_acceleration" not in there:
        text = "the ground's acceleration was not measured: the structure's response has no input."
        do = "Name its column: bristle study channels MY_RIG --channel ground_acceleration=COLUMN"
        findings.append(Finding("ground", "error", text, do))
    if "force" not in there:
        text = (
            "the damper's force was not measured: it is reconstructed from the equilibrium of the "
            "base. base_friction, a duffing spring and the base's mass cannot be separated from it."
        )
        do = "Put a load cell between damper and base."
        if at_damper.ends and not at_damper.on_first:
            text = (
                f"the force of {at_damper.text} was not measured: it is reconstructed from "
                "equilibrium. What the storeys there have that is not in the building's file "
                "cannot be separated from it."
            )
            do = "Put a load cell at it."
        findings.append(Finding("force", "warning", text, do))
    return findings
