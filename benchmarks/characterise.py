"""Answers of fixed cases, written to a file and compared with those of another version.

    python -m benchmarks characterise before.json
    python -m benchmarks characterise after.json --against before.json

The cases are every stock scenario on both engines, measured rigs with and without a hidden effect,
and buildings. They go through the command line alone, so that the same module runs on a version
whose package is laid out in another way. A refactoring changes none of the answers.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tests.independent import generate

from ._rows import Row

ROOT = Path(__file__).resolve().parents[1]
EVERY = 50  # rows of a run's table, of which one is kept
EXACT = 1e-9
"""What a run's columns may differ by, as a share of their peaks."""
Z = 1e-4
"""What an error in units of the noise may differ by, as a share."""
STD = 0.01
"""What a fitted parameter may differ by, in its standard deviations."""
BENCH = (
    ("none", "", 0.0, "bench_10N", "bingham"), ("none", "", 0.0, "bench_2kN", "lugre"),
    ("gas_spring", "", 0.15, "bench_10N", "lugre"), ("stribeck", "", 0.4, "bench_10N", "bingham"),
    ("presliding", "", 0.15, "bench_2kN", "bingham"), ("coil_lag", "", 0.4, "bench_10N", "lugre"),
    ("backlash", "", 0.4, "bench_2kN", "lugre"), ("delay", "", 0.15, "bench_10N", "bingham"),
    ("mount_compliance", "", 0.15, "bench_10N", "bingham"),
    ("fluid_inertia", "", 0.15, "bench_2kN", "lugre"),
    ("temperature", "", 0.4, "bench_10N", "bingham"), ("remanence", "", 0.4, "bench_2kN", "lugre"),
    ("quadratic_damping", "", 0.15, "bench_10N", "lugre"),
    ("sensor_gain", "velocity", 0.15, "bench_10N", "lugre"),
    ("gas_spring+coil_lag", "", 0.4, "bench_2kN", "bingham"),
    ("position_friction", "", 0.4, "bench_10N", "lugre"),
)  # fmt: skip
"""Hidden effect, its form or channel, strength, rig, law."""

BUILDINGS = (
    ("none", 0.0, "structure_10N", "bingham", False), ("none", 0.0, "structure_2kN", "lugre", True),
    ("duffing", 0.4, "structure_10N", "lugre", False),
    ("base_friction", 0.4, "structure_2kN", "bingham", False),
    ("end_stop", 0.4, "structure_10N", "bingham", False),
    ("storey_softening", 0.4, "structure_2kN", "lugre", True),
    ("gas_spring", 0.4, "structure_10N", "bingham", True),
    ("coil_lag", 0.4, "structure_2kN", "lugre", False),
)  # fmt: skip
"""Hidden effect, strength, rig, law, whether the force is left out of the record."""


def run() -> list[Row]:
    """Return no row: the answers are compared by `main`."""
    return []


def main(arguments: list[str]) -> int:
    """Write the answers to a file; with --against return 1 where they differ from another's."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks characterise", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--against", type=Path, metavar="FILE", help="answers of before")
    parser.add_argument("--only", default="", metavar="TEXT", help="cases whose name begins so")
    chosen = parser.parse_args(arguments)
    answers = json.loads(chosen.file.read_text()) if chosen.file.is_file() else {}
    for name, answer in cases():
        if name.startswith(chosen.only) and name not in answers:
            begun = time.perf_counter()
            answers[name] = answer()
            print(f"{name}: {time.perf_counter() - begun:.1f} s", file=sys.stderr)
            chosen.file.write_text(json.dumps(answers) + "\n")
    if chosen.against is None:
        return 0
    before = json.loads(chosen.against.read_text())
    found = [
        line
        for name in answers
        if name in before
        for line in differences(name, before[name], answers[name])
    ]
    print("\n".join(found) or f"{len(answers)} cases, no difference")
    return 1 if found else 0


def cases() -> Iterator[tuple[str, Any]]:
    """Yield the name of each case and the function that answers it."""
    for file in sorted((ROOT / "scenarios").glob("*.toml")):
        for engine in ("compiled", "fmu"):
            yield f"run {file.stem} {engine}", lambda f=file, e=engine: ran(f, e)
    for number, (effect, form, strength, rig, law) in enumerate(BENCH):
        what = (effect, form or None, strength or 0.15, 0.01, rig, law)
        yield (
            f"bench {effect} {rig} {law}",
            lambda n=number, w=what: studied(generate.make_case(1000 + n, *w), w[5]),
        )
    for number, (effect, strength, rig, law, without) in enumerate(BUILDINGS):
        what = (effect, None, strength or 0.15, 0.01, rig, law)
        yield (
            f"building {effect} {rig} {law}",
            lambda n=number, w=what, q=without: studied(
                generate.make_case(2000 + n, *w, measured_force=not q), w[5]
            ),
        )


def asked(*words: str) -> str:
    """Return what a command prints; it must end with 0."""
    from bristle.cli import main as bristle

    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        code = bristle(list(words))
    if code:
        raise SystemExit(f"bristle {' '.join(words)}: exit code {code}")
    return out.getvalue()


def ran(file: Path, engine: str) -> dict[str, Any]:
    """Return every so many rows of a scenario's columns, and their peaks."""
    with tempfile.TemporaryDirectory() as folder:
        asked("run", str(file), "--engine", engine, "--out", folder)
        table = pd.read_csv(Path(folder) / "results.csv", comment="#").astype(float)
    return {
        name: {"peak": float(column.abs().max()), "rows": column.iloc[::EVERY].tolist()}
        for name, column in table.items()
    }


def studied(case: Any, law: str) -> dict[str, Any]:
    """Return what identify, compare and diagnose say of a case."""
    with tempfile.TemporaryDirectory() as folder:
        data, study = Path(folder) / "data", str(Path(folder) / "study")
        generate.write(case, data, Path(folder) / "truth.json")
        more = ["--rig", "structure", "--building", str(data / "building.toml")]
        files = sorted(str(path) for path in data.glob("*.csv"))
        is_building = (data / "building.toml").is_file()
        asked("study", "new", study, "--law", law, *(more if is_building else []), "--data", *files)
        answers = {
            "identify": asked("identify", study, "--no-table", "--json"),
            "compare": asked("compare", study, "--json", "--out", f"{folder}/picture.png"),
            "diagnose": asked("diagnose", study, "--json"),
        }
    found = {name: json.loads(answer) for name, answer in answers.items()}
    for answer in found.values():
        answer.pop("picture", None)  # a path of this run
    return found


def differences(name: str, before: dict[str, Any], after: dict[str, Any]) -> Iterator[str]:
    """Yield a line for everything in which two answers differ."""
    if not name.startswith("run "):
        yield from (f"{name}: {line}" for line in _unlike("", before, after))
        return
    if set(before) != set(after):
        yield f"{name}: columns {sorted(set(before) ^ set(after))}"
    for column in set(before) & set(after):
        peak = before[column]["peak"]
        rows = np.array(before[column]["rows"]), np.array(after[column]["rows"])
        if rows[0].shape != rows[1].shape:
            yield f"{name}: {column} has {len(rows[1])} rows, not {len(rows[0])}"
        elif (off := float(np.max(np.abs(rows[1] - rows[0]), initial=0.0))) > EXACT * peak:
            yield f"{name}: {column} differs by {off / max(peak, 1e-300):.2e} of its peak"


def _unlike(path: str, before: Any, after: Any) -> Iterator[str]:
    """Yield where two JSON values differ by more than they may."""
    if isinstance(before, dict) and isinstance(after, dict):
        if set(before) != set(after):
            yield f"{path}: keys {sorted(set(before) ^ set(after))}"
        if "interval95" in before and before.get("value") is not None:
            yield from _parameter(path, before, after)
            return
        for key in set(before) & set(after):
            yield from _unlike(f"{path}.{key}", before[key], after[key])
    elif isinstance(before, list) and isinstance(after, list):
        if len(before) != len(after):
            yield f"{path}: {len(after)} entries, not {len(before)}"
        for k, pair in enumerate(zip(before, after, strict=False)):
            yield from _unlike(f"{path}[{k}]", *pair)
    elif isinstance(before, float) or isinstance(after, float):
        if before is None or after is None or abs(after - before) > Z * max(abs(before), 1e-3):
            yield f"{path}: {after}, not {before}"
    elif before != after:
        yield f"{path}: {after!r}, not {before!r}"


def _parameter(path: str, before: dict[str, Any], after: dict[str, Any]) -> Iterator[str]:
    std = (before["interval95"] or 0.0) / 1.96
    if abs(after["value"] - before["value"]) > max(STD * std, 1e-9 * abs(before["value"])):
        yield f"{path}: {after['value']}, not {before['value']} (standard deviation {std:.3g})"
