"""Devices that no law of the library has: what the commands make of them, beside floors.

    python -m benchmarks devices --first 0 --cases 12

Each case is a folder of files. Nothing is typed but `study new`, `study auto --closure` and
`export`. The floors see the same runs: gradient boosting and a small network on histories of motion
and command, and modified Bouc-Wen by least squares, its command quadratic where there is one. The
least of them on the held-out runs counts, which favours them.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.identification.rig import DAMPER, Site
from bristle.identification.rig_fit import fit_site
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS
from bristle.study.study import Study

from . import _odd_devices
from ._answers import Answer, Answers
from ._floor import LEARNERS, fitted, judged, least_squares, share_of
from ._rows import Row, show

RATIO, MOST = 1.1, 240.0
"""Goals: error over the floor, processor time of `study auto --closure` [s]."""

SETTINGS: dict[str, dict[str, float]] = {
    "gradient boosting": {"max_leaf_nodes": 31, "max_iter": 300},
    "neural network": {"width": 32, "alpha": 1e-3},
}


def answer(case: int, floors: bool = True) -> Answer:
    """Return what the commands and the floors find on a case."""
    with TemporaryDirectory() as place:
        files = Path(place) / "lab"
        files.mkdir()
        rig = _odd_devices.write(case, files)
        found: Answer = {
            "case": case, "device": rig.device, "rate": rig.rate, "noise": round(rig.noise, 4),
        }  # fmt: skip
        said = _typed(place, found, "study", "new", "rig", "--data", "lab/*.csv")
        if said is None:
            return found
        said = _typed(place, found, "study", "auto", "rig", "--closure", "--json")
        if said is None:
            return found
        _typed(place, found, "export", "rig")
        study = Study(Path(place) / "rig", trust=True)
        found.update(_read(study, json.loads(said), rig))
        if floors:
            found["floors"] = _floors(study, rig)
            found["ratio"] = found["error"] / min(found["floors"].values())
        return found


def _typed(place: str, found: Answer, *words: str) -> str | None:
    """Return what a command prints, None where it fails; its processor time [s] goes to `found`."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    made = subprocess.run(
        [sys.executable, "-m", "bristle.cli", *words], cwd=place, capture_output=True, text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"}, check=False,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    found.setdefault("cpu", {})[words[1] if words[0] == "study" else words[0]] = round(
        after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    )
    if made.returncode:
        found.setdefault("failed", {})[" ".join(words)] = made.stderr[-600:]
        return None
    return made.stdout


def _read(study: Study, said: dict[str, object], rig: _odd_devices.Rig) -> Answer:
    """Return error, model and verdict of a study that `study auto` has made."""
    steps, verdict = study.steps(), said["verdict"]
    assert isinstance(verdict, dict)
    study.usable_effects()
    model = study.model()
    errors = [
        one.after["error_share_holdout"] for one in steps if "error_share_holdout" in one.after
    ]
    closed = said.get("closure")
    kept = isinstance(closed, dict) and bool(closed.get("kept"))
    labels = {
        label
        for name in model.effects if not (kept and name == model.effects[-1])
        for label in EFFECTS[name].labels.values()
    }  # fmt: skip
    proven = {
        label
        for name in verdict.get("effects", ()) if name in EFFECTS
        for label in EFFECTS[name].labels.values()
    }  # fmt: skip
    by_name = {label.partition("_")[0]: label for label in labels | proven}
    sure = {label.partition("_")[0] for label in proven}
    named = verdict.get("effects", ()) if verdict["kind"] == "effect" else ()
    own = [name for name in named if name in EFFECTS and not EFFECTS[name].labels]
    return {
        "error": errors[-1], "errors": errors, "law": model.law, "effects": list(model.effects),
        "verdict": verdict["kind"], "named": list(named), "closed": kept,
        "wrong": sorted({*own} - rig.near),
        "labels found": sorted(rig.matter & {*by_name}), "labels proven": sorted(rig.matter & sure),
        "labels wrong": sorted({*by_name} - rig.matter),
        "labels known": sorted({label for run in study.runs().all for label in run.labels}),
    }  # fmt: skip


def _floors(study: Study, rig: _odd_devices.Rig) -> dict[str, float]:
    """Return the errors on the held-out runs of models that anyone can make."""
    runs = study.runs()
    train, held = ([prepare(run) for run in part] for part in (runs.train, runs.holdout))
    found = {}
    for learner in LEARNERS:
        for span in (0.1, 0.4):
            settings = {"span": span, "position": True, **SETTINGS[learner.name]}
            predict = fitted(learner, settings, train, [judged(run) for run in train], most=2)
            errors = [(run.force - predict(run))[judged(run)] for run in held]
            found[f"{learner.name} {span:g} s"] = share_of(errors, held)
    problem, judging = Problem(train), Problem(held)
    commanded = rig.device in _odd_devices.COMMANDED
    law = Model("modified_bouc_wen" + ("[quadratic]" if commanded else ""))
    site = Site(DAMPER, lambda _: problem)
    begun = fit_site(law, site, {DAMPER: site}, 2, {}).model
    found["modified Bouc-Wen"] = least_squares(begun, problem, judging)
    return found


def run() -> list[Row]:
    """Return the figures of the cases that this code has run."""
    return rows([*Answers("devices", ALSO).kept().values()])


ALSO = ("learning", "study")


def rows(done: Sequence[Answer]) -> list[Row]:
    """Return the figures of answers."""
    ended = [one for one in done if "error" in one]
    if not ended:
        return []
    ratios = np.array([one["ratio"] for one in ended if "ratio" in one])
    text = f"{len(done)} devices that no law has"
    matter = sum(len(one["labels found"]) for one in ended)
    spent = [one["cpu"].get("auto", 0) for one in ended]
    made = [
        Row(f"labels that matter, in the model: {text}", f"{matter} of {2 * len(ended)}",
            ">= 90 %", 0.9 * 2 * len(ended) / max(1, matter)),
        Row(f"labels that do not, in the model: {text}",
            str(sum(bool(one["labels wrong"]) for one in ended)), "none",
            2.0 * any(one["labels wrong"] for one in ended)),
        Row(f"verdicts that name what is not in it: {text}",
            str(sum(bool(one["wrong"]) for one in ended)), "none",
            2.0 * any(one["wrong"] for one in ended)),
        Row(f"ended: {text}", f"{len(ended)}", "all", len(done) / len(ended)),
        Row(f"processor time of study auto --closure, longest: {text}", f"{max(spent)} s",
            f"<= {MOST:g} s", max(spent) / MOST),
    ]  # fmt: skip
    if len(ratios):
        made += [
            Row(f"held-out error over the least floor, median: {text}",
                f"{np.median(ratios):.2f}", "<= 1", float(np.median(ratios))),
            Row(f"the same, 90 % of cases: {text}", f"{np.quantile(ratios, 0.9):.2f}",
                "<= 1.15", float(np.quantile(ratios, 0.9)) / 1.15),
        ]  # fmt: skip
    return made


def main(given: Sequence[str]) -> int:
    """Run the cases that are asked for, show their figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks devices", description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="the first case")
    parser.add_argument("--cases", type=int, default=12, help="how many")
    asked = parser.parse_args(given)
    jobs = [(case,) for case in range(asked.first, asked.first + asked.cases)]
    show(rows([*Answers("devices", ALSO).complete(jobs, answer).values()]))
    return 0
