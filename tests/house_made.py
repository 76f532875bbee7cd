"""A study of a house of one floor on isolation springs, its springs as modelled or not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from shaken import building, shake

from bristle.data.channels import channel_unit
from bristle.study.steps import create_study
from bristle.study.study import Study

STIFF = 1.5e7  # N/m3, of a cubic spring that the files may hide

Force = Callable[[Any, Any], Any]


def stiffening(x, v):
    """Return the forces [N] of isolation springs that grow stiffer with displacement."""
    return [STIFF * x[0] ** 3, 0.0]


def study_of(folder: Path, damper: Force | None = None, hidden: Force | None = stiffening) -> Study:
    """Return a study of three runs of 5 s, one held out, with 1 % noise on every channel."""
    b = building(1, True, 6)
    file = folder / "house.toml"
    file.write_text(
        'schema = 1\nname = "house"\nbase = "isolated"\ndamping_ratio = 0.02\n'
        f"masses = {np.diag(b.M).tolist()}\nstiffnesses = {list(b.stiffnesses)}\n",
        encoding="utf-8",
    )
    runs = []
    for k, role in enumerate(("train", "train", "holdout")):
        clean = shake(b, 20 + k, damper, hidden, samples=2500)
        random = np.random.default_rng(k)
        named = {
            f"{c} [{'s' if c == 'time' else channel_unit(c)}]": y
            + (c != "time") * 0.01 * np.std(y) * random.standard_normal(len(y))
            for c, y in clean.items()
        }
        runs.append(folder / f"{role}_{k}.csv")
        np.savetxt(
            runs[-1], np.column_stack(list(named.values())), "%.9g", ",", header=",".join(named),
            comments="",
        )  # fmt: skip
    return create_study(folder / "rig", runs, rig="structure", building=file, law="bingham").study
