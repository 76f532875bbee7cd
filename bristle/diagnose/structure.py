"""What is missing in a model of a building with its damper, and at which of its sites.

Equilibrium parts the question. Each storey's shear is known from the accelerations above it,
whatever happens below; what the isolation layer carries is known where the damper's force was
measured; and the damper's force is then held against the damper's law. Without a measured force the
layer and the damper are one unknown, and effects that act alike are named together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..data.measurement import Measurement
from ..identify.fit import Model
from ..identify.placed import at_site, on_time
from ..identify.response import Response, responses
from ..identify.structure import StructureProblem, problems_of
from ..physics.building import Building
from ..physics.laws import DEFAULT
from .candidates import judge
from .decision import excess
from .known_building import as_known, told
from .load_cell import load_cell
from .mended import mended
from .sensors import SensorFault, sensor_faults
from .sites import CLEAN, Finding, look_at
from .structure_damper import damper_verdict, fit_damper, forgiven, left_by_filter
from .structure_verdict import INSTRUMENT, StructureDiagnosis, combine

Pair = tuple[StructureProblem, StructureProblem]

MOVED = 0.5
"""What moved numbers of a building may leave of the excess, as a share, to be taken."""

BLURRED = (*INSTRUMENT, "delay", "derived")
"""Faults for which a building's velocity is left out: displacement and accelerometer say the same
without them, and what is left of a delay would be held against the law at each reversal."""

BLIND = 1.25
"""z that a true law whose friction jumps may read where the base's velocity had to be left out: it
jumps when the velocity changes sign, which then displacement and accelerometer alone tell."""

_NOTHING = Finding("", "none", (), 1.0, 1.0, 0.0, 0.0)


Say = Callable[[str], None]


def diagnose_structure(
    train: list[Measurement],
    holdout: list[Measurement],
    building: Building,
    *,
    law: str = DEFAULT,
    present: Model | None = None,
    say: Say | None = None,
) -> StructureDiagnosis:
    """Return what is missing in the model of a building and its damper.

    Parameters
    ----------
    train, holdout : measurements with the channels of a building
    building : its masses are taken as known; stiffnesses and damping are fitted anew
    law : the damper's law
    present : the model as it is: effects of all sites with their values; its law counts
    say : is told what is being done

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """
    say = say or (lambda text: None)
    present = present or Model(law)
    law = present.law
    say("looking for sensor faults")
    sensors = tuple(sensor_faults([_as_bench(one, building) for one in (*train, *holdout)]))
    train, holdout = (_mended(runs, sensors, building) for runs in (train, holdout))
    say("smoothing the motion of each level")
    found, present = on_time(responses([*train, *holdout], building), present)
    ours, theirs = found[: len(train)], found[len(train) :]
    straight = "storey_softening" not in present.effects
    problems = problems_of(ours, theirs, building, law, linear_storeys=straight)
    findings = {}
    for site, (own, other) in problems.items():
        if site != "damper":
            say(f"{site}: effects of the structure")
            findings[site] = look_at(site, own, other, at_site(present, site, problems))
    if "damper" in problems and findings.get("layer", _NOTHING).kind != "none":
        say("layer: the load cell")
        late = load_cell(findings["layer"], ours, theirs, building, law)
        if late is not None:
            findings["layer"], (ours, theirs) = late
            shown = problems["damper"]
            problems = problems_of(ours, theirs, building, law)
            if _rounded(findings["layer"]):
                problems["damper"], present = shown, _late(present, findings["layer"])
    base, verdict = None, None
    notes: list[str] = []
    if "damper" in problems and problems["damper"][0].reconstructed:
        say("damper: what the building's file leaves open")
        softer = any(f.kind != "none" for s, f in findings.items() if s.startswith("storey"))
        straight = straight and not softer
        problems = problems_of(ours, theirs, building, law, straight)
        known = _as_known(present, ours, building, straight)
        suited = problems_of(ours, theirs, known, law, straight)
        if _suits(suited["damper"], problems["damper"], present):
            problems, notes = suited, told(building, known)
    if "damper" in problems:
        say("damper: its law, then effects")
        base = fit_damper(problems["damper"][0], at_site(present, "damper", problems))
        verdict = damper_verdict(base, *problems["damper"])
        if _blurred(sensors):
            verdict = forgiven(verdict, BLIND, "Without its velocity the base's reversals blur.")
        if _rounded(findings.get("layer", _NOTHING)):
            most = left_by_filter(law, *problems["damper"])
            verdict = forgiven(verdict, most, "The load cell's filter has another form than ours.")
    whole = combine(findings, base, verdict, problems, sensors)
    return replace(whole, words=" ".join([whole.words, *notes]))


def _as_known(
    present: Model, responses: list[Response], building: Building, straight: bool
) -> Building:
    """Return the building that makes the damper's force, its numbers as far as they are known."""
    problem = problems_of(responses, [], building, present.law, straight)
    damper = fit_damper(problem["damper"][0], at_site(present, "damper", problem))
    return as_known(damper.model, responses, building, present.law, straight)


def _suits(suited: Pair, given: Pair, present: Model) -> bool:
    """Return whether moved numbers of a building explain what the file's leave, held-out runs too.

    What an effect does they may follow in part; then they are the file's still.
    """

    def left(pair: Pair) -> float:
        base = fit_damper(pair[0], at_site(present, "damper", ("damper",)))
        return excess(judge(base.model, *pair))

    return left(suited) <= MOVED * left(given)


def _rounded(layer: Finding) -> bool:
    """Return whether a load cell is late in a way that moving its record ahead does not undo.

    A filter rounds the force besides. That cannot be taken back, but it can be put on the model.
    """
    return layer.effects == ("delay",) and layer.z_after > CLEAN


def _late(present: Model, layer: Finding) -> Model:
    """Return the model whose damper's force is shown as late as equilibrium says."""
    time = float(layer.coordinate.split()[0])
    effects = (*present.effects, "delay")
    return replace(present, effects=effects, values={**present.values, "delay.time": time})


def _blurred(faults: tuple[SensorFault, ...]) -> bool:
    return any(f.channel == "velocity" and f.fault in BLURRED for f in faults)


def _mended(
    runs: list[Measurement], faults: tuple[SensorFault, ...], building: Building
) -> list[Measurement]:
    """Return measurements without the faults of the damper's channels.

    Of velocities that are late or rounded the displacement says the same.
    """
    first = building.levels()[0]
    names = {"displacement": f"{first}_displacement", "velocity": f"{first}_velocity"}
    theirs = [replace(f, channel=names.get(f.channel, f.channel)) for f in faults]
    late = names["velocity"]
    out = mended(runs, [f for f in theirs if not (f.channel == late and f.fault in BLURRED)])
    if not _blurred(faults):
        return out
    return [
        replace(one, channels={n: v for n, v in one.channels.items() if n != late}) for one in out
    ]


def _as_bench(measurement: Measurement, building: Building) -> Measurement:
    """Return a measurement whose base channels are named as those of a bench."""
    first = building.levels()[0]
    names = {f"{first}_displacement": "displacement", f"{first}_velocity": "velocity"}
    keep = {k: v for k, v in measurement.channels.items() if k in names or k == "force"}
    channels = {names.get(k, k): v for k, v in keep.items()}
    noise = {names.get(k, k): v for k, v in measurement.noise.items() if k in keep}
    return replace(measurement, channels=channels, noise=noise)
