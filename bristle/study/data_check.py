"""The data check: what to mend in a study's measurements before any model, what cannot be told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.finding import Finding
from ..core.text import command, plain
from ..data.channels import ChannelSpec
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
from ..data.titles import column
from ..units import conversion, same_dimension
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
        findings += _unmeasured(study, runs.all, at_damper)
    findings = _advised(findings, study, every, at_damper)
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


def _unmeasured(study: Study, runs: list[Measurement], at_damper: Place) -> list[Finding]:
    findings = []
    there = set.intersection(*(set(run.channels) for run in runs))
    if "ground_acceleration" not in there:
        text = "the ground's acceleration was not measured: the structure's response has no input."
        extra = study.settings.extra.values()
        able = [one.column for one in extra if one.unit and same_dimension(one.unit, "m/s2")]
        do = "Measure it, too."
        if able:
            named = ("--channel", f"ground_acceleration={able[0]}")
            do = f"If it is that one:  {command('study', 'channels', study.folder, *named)}"
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


# Advice to read a column in another unit or with the other sign: tried on the runs before it is
# given.

_UNITS = {
    "displacement": ("mm", "m", "cm", "um"), "velocity": ("mm/s", "m/s"), "force": ("N", "kN"),
    "voltage": ("V", "mV"), "current": ("A", "mA"), "duty": ("%", "1"), "field": ("T", "mT"),
    "time": ("s", "ms", "us"),
}  # fmt: skip
"""Units in which channels of a bench are recorded, the usual one first."""

_TRIED = 4
"""Runs that are in doubt, and as many that are not, on which an advice is tried."""


def _of_reading(finding: Finding) -> bool:
    """Return whether another unit or sign of a column may set right what was found."""
    kinds = ("sign", "gain") if finding.level == "error" else ("size", "command sign")
    return finding.kind in kinds


def _advised(
    findings: list[Finding], study: Study, runs: list[Measurement], at_damper: Place
) -> list[Finding]:
    """Return findings with the way to read a column that sets them right, where there is one."""
    doubted: dict[tuple[str, str], set[str]] = {}
    for one in filter(_of_reading, findings):
        doubted.setdefault((one.kind, one.channel), set()).add(one.run)
    advice = {
        key: _advice(*key, study, _some(runs, names), at_damper) for key, names in doubted.items()
    }
    return [
        replace(one, do=advice[one.kind, one.channel]) if _of_reading(one) else one
        for one in findings
    ]


def _some(runs: list[Measurement], names: set[str]) -> list[Measurement]:
    """Return runs of these names and others, a few of each."""
    apart = ([run for run in runs if (run.name in names) is there] for there in (True, False))
    return [run for part in apart for run in part[:_TRIED]]


def _advice(
    kind: str, channel: str, study: Study, runs: list[Measurement], at_damper: Place
) -> str:
    """Return the command that sets a finding right on all of some runs, else where to look."""
    bench = not study.settings.has_building
    before, options = _doubts(runs, at_damper, bench), []
    for name in dict.fromkeys((channel, "displacement") if kind == "gain" else (channel,)):
        spec = study.settings.channels.get(name)
        if spec is None or spec.step is not None or name not in _UNITS:
            continue
        for unit, sign, factor in _readings(kind, name, spec):
            after = _doubts([_scaled(run, name, factor) for run in runs], at_damper, bench)
            if (kind, channel) not in after and after <= before:
                turned = "-" if sign < 0 else ""
                options.append(("--channel", f"{name}={turned}{spec.column}@{unit}"))
                break
    if not options:
        return "No other unit or sign of a column sets all runs right: look into the test's log."
    ways = [command("study", "channels", study.folder, *one) for one in options]
    if len(ways) == 1:
        return f"Read so, it is right:  {ways[0]}"
    return f"Read so, it is right, by the one that the test's log says:  {'  or  '.join(ways)}"


def _readings(kind: str, channel: str, spec: ChannelSpec) -> Iterator[tuple[str, int, float]]:
    """Yield units and signs of a column, and the factors that they give its values."""
    now = spec.unit or column(0, spec.column).stated
    for sign in (1, -1) if kind == "gain" else (-1,) if "sign" in kind else (1,):
        for unit in dict.fromkeys((now, *(() if "sign" in kind else _UNITS[channel]))):
            if (unit, sign) != (now, 1):
                yield unit, sign * spec.sign, sign * conversion(unit, now)[0]


def _doubts(runs: list[Measurement], at_damper: Place, bench: bool) -> set[tuple[str, str]]:
    """Return what is found in runs that the reading of a column may set right."""
    level = "" if at_damper.ends else at_damper.level
    found: list[Finding] = []
    for run in runs:
        velocity = velocity_of_run(at_damper.seen(run), at_damper.level)
        found += [*(check_sizes(run, velocity) if bench else ()), *check_motion(run, level)]
        if "force" in run.channels and velocity is not None:
            found += check_force(run, velocity)
    return {(one.kind, one.channel) for one in found if _of_reading(one)}


def _scaled(run: Measurement, channel: str, factor: float) -> Measurement:
    """Return a run whose channel, or time, is so many times as large."""
    if channel == "time":
        sampling = replace(run.sampling, step=factor * run.step)
        return replace(run, time=factor * run.time, sampling=sampling)
    return replace(run, channels={**run.channels, channel: factor * run[channel]})
