"""A damper in an ensemble as a study has identified it: its parameters are drawn together.

[identified]
model = "my_rig"            # the study's folder, or its model.toml
component = "damper"        # of the scenario; this is its name by default
structure = "structure"     # the component of effects in the building
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np

from ..core.config import Key, Spec
from ..core.files import read_json
from ..core.text import command, unknown
from ..errors import EnsembleError
from ..model.draws import OpenEffect, has_covariance, joint_errors, left_open
from ..model.model import Model
from ..model.model_file import read_model
from ..physics.effect import EFFECTS, plain_name
from ..system.model import System
from .distributions import Distribution, Value, Varied, share

IDENTIFIED = Spec({
    "model": Key(str, "", about="the folder of a study"), "component": Key(str, "damper"),
    "structure": Key(str, "structure"),
})  # fmt: skip
"""`[identified]` of an ensemble file."""
_DRAW, _JOINT = "left open", "identified"


@dataclass(frozen=True)
class Places:
    """Where a scenario has the parameters of a model: its components for damper and structure.

    `bench`: whether the model was identified on a bench; `mass` the name of the structure's mass
    that moves with the damper's rod, "" where the scenario has no structure.
    """

    damper: str
    structure: str
    bench: bool
    mass: str = ""

    def of(self, name: str) -> str:
        """Return the scenario's name of a model's parameter, "" for one of an instrument."""
        effect, _, own = name.rpartition(".")
        if not effect:
            return f"{self.damper}.{own}"
        at = self.at(effect)
        if at == self.damper and own == EFFECTS[effect].mass and self.mass:
            return self.mass  # from differences of velocity it would diverge
        return f"{at}.{plain_name(effect)}.{own}" if at else ""

    def at(self, effect: str) -> str:
        """Return the component that has an effect of a model, "" for one of an instrument."""
        known = EFFECTS[effect]
        site = "damper" if self.bench and "damper" in known.sites else known.site
        return {"damper": self.damper, "structure": self.structure}.get(site, "")

    def of_effect(self, effect: str, values: Mapping[str, float]) -> dict[str, float]:
        """Return an effect's values and its switch by the names of the scenario.

        Parameters
        ----------
        effect : as a model has it
        values : by the model's names of its parameters
        """
        if not self.at(effect):
            return {}
        place = f"{self.at(effect)}.{plain_name(effect)}"
        found: dict[str, float] = {f"{place}.on": True}
        for name, value in values.items():
            found[self.of(name)] = value
            if self.of(name) == self.mass:
                found[f"{place}.{EFFECTS[effect].mass}"] = 0.0
        return found


@dataclass(frozen=True)
class IdentifiedDraws:
    """The parameters of a component that are drawn together, and what limits leave open.

    `names` of the scenario ("damper.sigma_a") with their values `centre` and bounds `low`, `high`
    in SI; `root` rows that make their errors of independent standard normal numbers; `fixed` what
    the model sets besides; `places` of its parameters in the scenario; `left` effects that the
    study's runs do not exclude, drawn in turn; `notes` on effects that are not; `folder` of the
    study.
    """

    names: tuple[str, ...]
    centre: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    root: tuple[tuple[float, ...], ...]
    fixed: Mapping[str, Value]
    places: Places
    folder: str
    left: tuple[OpenEffect, ...] = ()
    notes: tuple[str, ...] = ()

    def draw(self, seed: int, run: int) -> dict[str, float]:
        """Return the values of a run, from its number and the seed alone."""
        count = len(self.root[0]) if self.root else 0
        normal = [NormalDist().inv_cdf(share(seed, run, f"{_JOINT} {k}")) for k in range(count)]
        drawn = np.array(self.centre) + np.array(self.root) @ np.array(normal)
        within = np.clip(drawn, self.low, self.high)
        return dict(zip(self.names, within.tolist(), strict=True))

    def varied(self) -> tuple[Varied, ...]:
        """Return the names as a plan lists what varies, each with its own error."""
        spread = np.linalg.norm(np.array(self.root), axis=1)
        return tuple(
            Varied(name, Distribution("normal", (centre, float(std)), (low, high)))
            for name, centre, std, low, high in zip(
                self.names, self.centre, spread, self.low, self.high, strict=True
            )
        )

    def open_at(self, seed: int, run: int) -> tuple[OpenEffect, float]:
        """Return the effect of a run, and its size over the limit."""
        effect = self.left[run % len(self.left)]
        return effect, effect.part(share(seed, run, _DRAW))

    def with_effect(self, values: Mapping[str, Value], seed: int, run: int) -> dict[str, Value]:
        """Return what a run's effect changes of the scenario's values.

        Parameters
        ----------
        values : drawn, by the names of the scenario
        seed, run : which tell the effect and its size
        """
        effect, part = self.open_at(seed, run)
        present = {**self.fixed, **values}
        bounds = dict(zip(self.names, zip(self.low, self.high, strict=True), strict=True))
        found: dict[str, Value] = {}
        for name, by in effect.moved.items():
            full = self.places.of(name)
            if full in bounds:
                low, high = bounds[full]
                found[full] = min(max(float(present[full]) + by * part, low), high)
        own = {f"{effect.name}.{name}": value for name, value in effect.own(part).items()}
        for full, value in self.places.of_effect(effect.name, own).items():
            added = full == self.places.mass and not isinstance(value, bool)
            found[full] = value + float(present.get(full, 0.0)) if added else value
        return found


def read_identified(
    table: Mapping[str, Any], beside: Path, base: System, *, with_limits: bool
) -> IdentifiedDraws:
    """Return what `[identified]` of an ensemble file says.

    Parameters
    ----------
    table : as read
    beside : folder of the ensemble file
    base : its scenario
    with_limits : whether effects that the study's verdict does not exclude are drawn as well

    Raises
    ------
    EnsembleError
        If a key is wrong, the model has no covariance, or the component lacks its parameters.
    StudyError
        If the model, or its verdict, cannot be read.
    """
    folder, model = _model_of(table, beside)
    damper, structure = table["component"], table["structure"]
    there = base.components
    mass = f"{structure}.attached_mass" if structure in there else ""
    places = Places(damper, structure, not model.building, mass)
    fixed = _fixed(model, places)
    _refuse_others(fixed, base, model)
    if not has_covariance(model):
        raise EnsembleError(
            f"{folder}: its model has no covariance of the parameters to draw from. Identify it "
            f"again:  {command('identify', folder)}"
        )
    left, notes = _left(folder, model) if with_limits else ([], [])
    errors = joint_errors(model)
    names = [places.of(name) for name in errors.names]
    keep = [k for k, name in enumerate(names) if name]
    if not keep:
        raise EnsembleError(f"{folder}: no parameter of its damper was identified.")
    centre, low, high = (
        tuple(float(values[k]) for k in keep) for values in (errors.centre, errors.low, errors.high)
    )
    root = tuple(tuple(map(float, errors.root[k])) for k in keep)
    return IdentifiedDraws(
        tuple(names[k] for k in keep), centre, low, high, root, fixed, places, str(folder),
        tuple(left), tuple(notes),
    )  # fmt: skip


def _model_of(table: Mapping[str, Any], beside: Path) -> tuple[Path, Model]:
    """Return the folder of the study that a table names, and its model."""
    if not table["model"]:
        words = 'model is missing: expected the folder of a study, as in model = "my_rig".'
        raise EnsembleError(words)
    path = beside / table["model"]
    folder = path if path.is_dir() else path.parent
    return folder, read_model(folder / "model.toml" if path.is_dir() else path)


def _fixed(model: Model, places: Places) -> dict[str, Value]:
    """Return all values of a model, and the switches of its effects, by a scenario's names.

    Not what follows a channel of the runs: the damper has it as an input.
    """
    values = model.values
    found: dict[str, Value] = {places.of(name): values[name] for name in values if "." not in name}
    for effect in model.effects:
        channels = {f"{effect}.{name}" for name in EFFECTS[effect].channels}
        own = {n: v for n, v in values.items() if n.startswith(f"{effect}.") and n not in channels}
        found |= places.of_effect(effect, own)
    return found


def _refuse_others(fixed: Mapping[str, Value], base: System, model: Model) -> None:
    """Refuse a scenario whose components lack the model's parameters."""
    there = base.components
    for full in fixed:
        name, _, rest = full.partition(".")
        if name not in there:
            raise EnsembleError(unknown("component", name, there))
        if rest not in there[name].description.variables:
            raise EnsembleError(
                f"the model's law is {model.law}, and {name} ({there[name].kind}) of the scenario "
                f"has no parameter {rest}. A scenario with a damper of that law is right."
            )


def _left(folder: Path, model: Model) -> tuple[list[OpenEffect], list[str]]:
    """Return what the verdict beside a model does not exclude."""
    path = folder / "verdict.json"
    return left_open(read_json(path) if path.is_file() else None, model, folder)
