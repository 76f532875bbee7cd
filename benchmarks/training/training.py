"""What a policy is trained on and how: a design file with a table [motions]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from bristle.component.controller_file import POLICY
from bristle.core.config import ANY, Document, Spec
from bristle.data.ground_motion import GroundMotion, read_ground_motion
from bristle.errors import DesignError, RecordError
from bristle.synthesis.design_file import task_of
from bristle.synthesis.task import Task

ALIKE = 1e-3
"""Largest difference, as a share of the peak, of two records that are the same motion."""


@dataclass(frozen=True)
class Training:
    """The motions of a training, and its size.

    Attributes
    ----------
    synthetic : int
        Number of synthetic motions.
    records : tuple of str
        Names or files of ground motions that train beside them, each at four intensities.
    reported : tuple of str
        Those that the controller will be judged on: refused among `records`.
    weakest, strongest : float
        Peak ground acceleration over the damper's largest force per mass of the building.
    spread, noise, delay : float
        Wrong parameters (share), noise (share of a signal's peak) and delay [s] up to which seven
        of ten motions are trained.
    hidden, rounds, seed : int
        Hidden units of the network; steps of the descent; what the draws follow.
    folder : Path
        What relative paths of records are relative to.
    """

    synthetic: int = 0
    records: tuple[str, ...] = ()
    reported: tuple[str, ...] = ()
    weakest: float = 0.4
    strongest: float = 2.4
    spread: float = 0.1
    noise: float = 0.01
    delay: float = 0.004
    hidden: int = 16
    rounds: int = 600
    seed: int = 1
    folder: Path = Path()

    def __post_init__(self) -> None:
        for name, (low, high) in {
            "synthetic": (0, 10_000), "weakest": (1e-3, 1e3), "strongest": (self.weakest, 1e3),
            "spread": (0.0, 0.5), "noise": (0.0, 1.0), "delay": (0.0, 1.0), "hidden": (0, 200),
            "rounds": (1, 100_000), "seed": (0, 2**32 - 1),
        }.items():  # fmt: skip
            value = getattr(self, name)
            whole = isinstance(getattr(type(self), name), int)
            if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
                kind = "whole number" if whole else "number"
                raise DesignError(f"motions: {name} = {value!r}: expected a {kind}.")
            if not (isfinite(value) and low <= value <= high):
                raise DesignError(f"motions: {name} = {value!r} lies outside {low:g} .. {high:g}.")
        for name in ("records", "reported"):
            if not isinstance(value := getattr(self, name), list | tuple):
                raise DesignError(
                    f"motions: {name} = {value!r}: expected a list of names or files."
                )
        if not self.synthetic and not self.records:
            raise DesignError(
                "motions: there is none to train on; synthetic = 300 is usual, records = "
                '["kobe_1995_nishi_akashi_000"] adds a record.'
            )

    def recorded(self) -> list[GroundMotion]:
        """Return the records to train on.

        Raises
        ------
        DesignError
            If one cannot be read, or is among those that are reported.
        """
        found = {name: self._read(name) for name in self.records}
        for other in self.reported if found else ():
            shown = found.get(other) or self._read(other)
            seen = [name for name, motion in found.items() if same_motion(motion, shown)]
            if seen:
                raise DesignError(
                    f"motions: {', '.join(seen)} is trained on and reported ({other}); a policy "
                    "is judged on motions that it has not seen. Take it out of one of the lists."
                )
        return list(found.values())

    def _read(self, name: str) -> GroundMotion:
        try:
            return read_ground_motion(name, self.folder)
        except RecordError as error:
            raise DesignError(f"motions: {error}") from None

    def data(self) -> dict[str, object]:
        """Return the table of a design file."""
        content = {name: value for name, value in vars(self).items() if name != "folder"}
        return {**content, "records": list(self.records), "reported": list(self.reported)}


def same_motion(a: GroundMotion, b: GroundMotion) -> bool:
    """Return whether two records are one motion, whatever their names, files and scales."""
    if a.name == b.name:
        return True
    time = a.time - a.time[0]
    other = np.interp(time, b.time - b.time[0], b.acceleration / b.peak, right=0.0)
    return float(np.abs(a.acceleration / a.peak - other).max()) < ALIKE


@dataclass(frozen=True)
class PolicyTask(Task):
    """A training: building, damper and motions.

    Like an LQG design a policy takes the measured force, which holds what the damper's springs do:
    so it is a task of that kind, without its weights.
    """

    kind: str = "lqg"
    motions: Training = field(default_factory=lambda: Training(synthetic=300))

    def data(self) -> dict[str, Any]:
        """Return the task as the content of a design file, the building by name."""
        content = {**super().data(), "kind": POLICY, "motions": self.motions.data()}
        del content["lqg"]
        return content


def read_policy_task(path: Path) -> PolicyTask:
    """Return the training that a design file describes.

    Raises
    ------
    DesignError, PhysicsError
        Naming the file and what was expected.
    """
    document = Document(path, DesignError)
    data = document.data
    if data.get("kind") != POLICY or "lqg" in data:
        document.error(("kind",), f'expected kind = "{POLICY}" and a table [motions].')
    elif not isinstance(data.get("motions"), Mapping):
        document.error(("motions",), "a policy is trained on motions: expected a table [motions].")
    document.check()
    every = {one.name: ANY._replace(default=one.default) for one in fields(Training)[:-1]}
    found = document.read(Spec(every), ("motions",), data.pop("motions"))
    document.check()
    try:
        motions = Training(**found, folder=path.parent)
    except DesignError as error:
        document.error_of(("motions",), str(error))
        document.check()
        raise
    data["kind"] = "lqg"
    return PolicyTask(**vars(task_of(document, path.parent)), motions=motions)
