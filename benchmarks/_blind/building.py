"""The package under test on a building: asked with its building file and the recorded channels."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from bristle.data.measurement import Measurement
from bristle.diagnosis import Diagnosis, diagnose_rig
from bristle.diagnosis.site import try_effect
from bristle.identification.building_sites import StructurePair
from bristle.identification.building_sites import structure_problems as problems
from bristle.identification.fit import fit_from_starts, refine
from bristle.identification.rig_fit import fit_line
from bristle.model.model import Model
from bristle.physics.building import Building, from_data
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import law_of_part

from . import cases, inseparable
from .cases import Recorded
from .subject import halves, measurements, packed


def file_of(case: Recorded) -> Building:
    """Return the building as its file tells it: the drawing's masses, stiffnesses and damping."""
    told = case.truth["building"]
    return from_data(
        {
            "schema": 1, "name": case.task.rig, "base": "isolated",
            "masses": told["masses"], "stiffnesses": told["stiffnesses"],
            "rayleigh": {"ratio": told["ratio"], "modes": told["modes"]},
        }
    )  # fmt: skip


def ask(case: Recorded) -> dict[str, Any]:
    """Return what the diagnoser says of a building's case, and whether its class can be parted."""
    train, holdout = halves(case)
    building = file_of(case)
    begun, spent = time.perf_counter(), time.process_time()
    found = diagnose_rig(train, holdout, Model(case.task.law), building)
    said = found.as_dict()
    answer = packed(said) | {
        "sites": said["sites"], "force": said["force"],
        "seconds": time.perf_counter() - begun, "cpu": time.process_time() - spent,
    }  # fmt: skip
    return answer | follow_up(case, answer, found)


def follow_up(case: Recorded, answer: dict[str, Any], found: Diagnosis) -> dict[str, Any]:
    """Return how well noise-free runs part the rivals of a class from the hidden effect."""
    hidden = [one["effect"] for one in case.truth["effects"]]
    if answer["kind"] != "ambiguous" or len(hidden) != 1 or hidden[0] not in answer["effects"]:
        return {}
    rivals = [name for name in answer["effects"] if name != hidden[0]]
    site = _site(hidden[0], rivals, found)
    return {"resolved": resolve(case, hidden[0], rivals, site) if rivals and site else {}}


def _site(true: str, rivals: list[str], found: Diagnosis) -> str:
    """Return the site at which all of a class can act, "" where they act at different ones."""
    for site in found.findings:
        if all(_acts(name, site, found.reconstructed) for name in (true, *rivals)):
            return site
    return ""


def _acts(name: str, site: str, reconstructed: bool) -> bool:
    effect = EFFECTS[name]
    if effect.site != "structure":
        return site == "damper"
    if site.startswith("storey"):
        return "spring" in effect.hooks()
    return "force" in effect.hooks() and site == ("damper" if reconstructed else "layer")


def resolve(case: Recorded, true: str, rivals: list[str], site: str) -> dict[str, float]:
    """Return for each rival by how many standard deviations the data prefer the hidden effect.

    As `inseparable.resolve`, at one site: the noise-free runs are weighed with the noise of the
    recorded ones.
    """
    made = cases.make(case.task)
    parts = [
        [with_noise(m, made.spread) for m in measurements(made.clean(role), case.channels)]
        for role in ("train", "holdout")
    ]
    train, held = problems(parts[0], parts[1], file_of(case), case.task.law)[site]
    fits = {name: fitted(name, case.task.law, site, (train, held)) for name in (true, *rivals)}
    expected = held.expectation(fits[true])
    left = {
        name: [(r.force - held.predict(one, r))[r.skip :] for r in held.runs]
        for name, one in fits.items()
    }
    noise = [e[1][r.skip :] for e, r in zip(expected, held.runs, strict=True)]
    draws = [e[2][:, r.skip :] for e, r in zip(expected, held.runs, strict=True)]
    own = [run.noise for run in held.runs]
    return {
        name: inseparable.resolution(left[true], left[name], noise, draws, own) for name in rivals
    }


def with_noise(measurement: Measurement, spread: dict[str, float]) -> Measurement:
    """Return a noise-free measurement that is smoothed and weighed as the recorded one."""
    return replace(measurement, noise={name: float(value) for name, value in spread.items()})


def fitted(name: str, law: str, site: str, pair: StructurePair) -> Model:
    """Return a site's model with one effect, fitted to its training runs."""
    train, held = pair
    if site == "damper":
        base = fit_from_starts(train, Model(law), starts=2).model
        if EFFECTS[name].site != "structure":
            return inseparable.best_of(name, base, train)
        return refine(try_effect(name, base, train, held).model, train)
    line = law_of_part(site).name
    return try_effect(name, fit_line(train, line).model, train, held).model
