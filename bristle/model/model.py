"""A model: the damper's law, its parameters and the effects that were added, as values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

from ..core.arrays import Array
from ..core.config import Document, Key, Spec
from ..core.text import shown
from ..core.toml_lines import KeyPath
from ..errors import TrustError, UnitError
from ..physics.drive import DRIVES, VOLTAGE, declared_for, unit_for
from ..physics.effect import EFFECTS, plain_name
from ..physics.laws import DEFAULT, base_and_variant
from ..physics.parameter import CHOICES, Parameter, fields_of
from ..units import canonical, convert
from ..user_code.load import waiting
from .uncertainty import Correlation, correlation_of_covariance, covariance_of

# A value of a model.toml, and what can be read of a law or effect without its code.

ORIGINS = ("reconstructed", "measured", "assumed", "identified")
VALUE = Spec({
    "value": Key(float, None), "unit": Key(str, None), "low": Key(float, None),
    "high": Key(float, None), "free": Key(bool, None), "std": Key(float, None, least=0.0),
    "origin": Key(str, "assumed", choices=ORIGINS),
})  # fmt: skip
"""What a parameter's table may hold; its bounds are asked for where the parameter is known."""


@dataclass(frozen=True)
class Value:
    """A parameter: `value`, `low`, `high`, `std` in `unit`; whether a fit moves it; its origin."""

    value: float
    unit: str
    low: float
    high: float
    free: bool = True
    std: float | None = None
    origin: str = "assumed"


def waiting_law(folder: Path, law: str) -> TrustError | None:
    """Return why a law of a folder, or the one that it is a variant of, may not run yet."""
    for file in sorted(folder.glob("*.py")) if folder.is_dir() else []:
        if law == file.stem or law.startswith(f"{file.stem}_"):
            untrusted = waiting(file)
            if untrusted:
                return untrusted
    return None


def as_written(document: Document, keys: KeyPath, given: Mapping[str, Any]) -> dict[str, Value]:
    """Return values as the file has them, without knowing the law or effect that they belong to."""
    out = {}
    for own, entry in given.items():
        if not isinstance(entry, dict) or not isinstance(entry.get("value"), int | float):
            continue  # a table of values, or what only the law or effect can judge
        found = document.read(VALUE, (*keys, own), entry)
        try:
            unit = canonical(found["unit"] or "1")
        except UnitError as error:
            document.error((*keys, own, "unit"), f"{own}: {error}")
            continue
        value = found["value"]
        low, high = (value if found[key] is None else found[key] for key in ("low", "high"))
        free = found["free"] is not False
        out[own] = Value(value, unit, low, high, free, found["std"], found["origin"])
    return out


# What a law or an effect declares for a model.toml: its parameters, tables and defaults.


def declared_of(law: str, effect: str = "", drive: str = VOLTAGE.name) -> dict[str, Parameter]:
    """Return the declarations of an effect's parameters, or of a law's, for a command."""
    declared = dict(EFFECTS[effect].parameters) if effect else _of_law(law)
    if drive == VOLTAGE.name:
        return declared
    return {name: declared_for(one, DRIVES[drive]) for name, one in declared.items()}


def _of_law(law: str) -> dict[str, Parameter]:
    """Return the declarations of a law's parameters, with the values of its variant."""
    base, variant = base_and_variant(law)
    declared = dict(base.parameters)
    for name, value in variant.values.items():
        declared[name] = declared[name]._replace(value=value)
    return declared


def table_names(law: str, effect: str = "") -> dict[str, tuple[str, ...]]:
    """Return the tables of an effect, or of a law: name to the parameters that it lists."""
    owner = EFFECTS[effect] if effect else base_and_variant(law)[0]
    fields = fields_of(owner.parameters, owner.tables)
    return {name: fields[name] for name in owner.tables}


def defaults_of(law: str, effect: str = "", drive: str = VOLTAGE.name) -> dict[str, Value]:
    """Return the parameters of an effect, or of a law, at their defaults."""
    if effect:
        fixed: tuple[str, ...] = (*CHOICES, *EFFECTS[effect].assumed)
    else:
        base, variant = base_and_variant(law)
        fixed = (*base.fixed(), *variant.idle)
    return {
        name: Value(p.value, p.unit, *p.bounds, free=name not in fixed)
        for name, p in declared_of(law, effect, drive).items()
    }


@dataclass(frozen=True)
class StudyModel:
    """The content of a model.toml; all parameters of the law and its effects are there.

    `parameters` of the law by name; `effects` name to parameters; `building` the file of the
    structure, relative to the study, "" on a bench; `only_shown` the effects, and the law, whose
    code must not run yet: the model can be shown, not used; `correlation` of the identified
    parameters' errors, None where none was stored; `drive` is the channel that commands the damper,
    on whose unit those of parameters depend.
    """

    law: str
    parameters: dict[str, Value]
    effects: dict[str, dict[str, Value]] = field(default_factory=dict)
    building: str = ""
    only_shown: tuple[str, ...] = ()
    correlation: Correlation | None = None
    drive: str = VOLTAGE.name

    def __repr__(self) -> str:
        values = (
            f"{name} = {value.value:.6g}" + (f" {value.unit}" if value.unit != "1" else "")
            for name, value in self.flat().items()
        )
        return shown(self, " + ".join([self.law, *self.effects]), values)

    @property
    def base_law(self) -> str:
        """The law without its variant: "bingham" of "bingham_standard"."""
        return base_and_variant(self.law)[0].name

    def flat(self) -> dict[str, Value]:
        """Return all parameters by the names of FMUs: "f_c", "gas_spring.k"."""
        out = dict(self.parameters)
        for effect, values in self.effects.items():
            out.update({f"{effect}.{name}": value for name, value in values.items()})
        return out

    def values(self) -> dict[str, float]:
        """Return all values in SI by the names of FMUs."""
        return {
            name: convert(value.value, value.unit, self.declared(name).unit)
            for name, value in self.flat().items()
        }

    def free(self) -> list[str]:
        """Return the names of the parameters that a fit may move."""
        return [name for name, value in self.flat().items() if value.free]

    def declared(self, name: str) -> Parameter:
        """Return the declaration of a parameter: default, SI unit, bounds, text.

        Of an effect or law that is only shown the file tells what there is.
        """
        effect, _, own = name.rpartition(".")
        if (effect or self.law) in self.only_shown:
            value = self.effects[effect][own] if effect else self.parameters[own]
            return Parameter(value.value, value.unit, (value.low, value.high), "")
        return declared_of(self.law, effect, self.drive)[own]

    def with_values(
        self,
        values: Mapping[str, float],
        std: Mapping[str, float] | None = None,
        origin: str = "identified",
    ) -> StudyModel:
        """Return the model with values in SI, and their standard deviations, put in its units."""
        std = std or {}
        flat = self.flat()
        for name, value in values.items():
            unit = self.declared(name).unit
            own = flat[name].unit
            spread = convert(std[name], unit, own) if name in std else None
            flat[name] = replace(
                flat[name], value=convert(value, unit, own), std=spread, origin=origin
            )
        # Errors of other values say nothing of these.
        kept = (
            self.correlation.of([n for n in flat if n not in values]) if self.correlation else None
        )
        return replace(
            self,
            parameters={name: flat[name] for name in self.parameters},
            effects={
                effect: {own: flat[f"{effect}.{own}"] for own in named}
                for effect, named in self.effects.items()
            },
            correlation=kept,
        )

    def with_covariance(self, names: Sequence[str], covariance: Array) -> StudyModel:
        """Return the model with how the errors of these parameters go together.

        Parameters
        ----------
        names : parameters, whose standard deviations the model has
        covariance : (p, p) of their errors, in SI
        """
        return replace(self, correlation=correlation_of_covariance(names, covariance))

    def uncertain(self) -> list[str]:
        """Return the names of the parameters that have a standard deviation."""
        return [n for n, v in self.flat().items() if v.std is not None and isfinite(v.std)]

    def covariance(self) -> tuple[tuple[str, ...], Array]:
        """Return the identified parameters and the covariance (p, p) of their errors in SI.

        Without a stored correlation errors count as independent.
        """
        names, flat = self.uncertain(), self.flat()
        own = [(flat[name].std or 0.0, flat[name].unit, self.declared(name).unit) for name in names]
        return tuple(names), covariance_of(names, [convert(*one) for one in own], self.correlation)

    def at(self, site: str, bench: bool) -> StudyModel:
        """Return the model with the effects of one site alone, by their plain names.

        Parameters
        ----------
        site : one of `physics.effect.SITES`
        bench : whether the model is of a damper on a bench, whose effects are all the damper's
        """
        own = [name for name in self.effects if _site_of(name, bench) == site]
        return replace(self, effects={plain_name(name): self.effects[name] for name in own})

    def with_effect(self, effect: str) -> StudyModel:
        """Return the model with one more effect, its parameters at their defaults."""
        added = defaults_of("", effect, self.drive)
        return replace(self, effects={**self.effects, effect: added})

    def with_drive(self, drive: str) -> StudyModel:
        """Return the model for another command: the same numbers, per ampere in place of per volt.

        Parameters
        ----------
        drive : one of `data.channels.DRIVE`
        """
        if drive == self.drive:
            return self
        old = DRIVES[self.drive].unit

        def in_unit(value: Value) -> Value:
            return replace(value, unit=unit_for(value.unit, DRIVES[drive], old))

        return replace(
            self,
            drive=drive,
            parameters={name: in_unit(value) for name, value in self.parameters.items()},
            effects={
                effect: {name: in_unit(value) for name, value in values.items()}
                for effect, values in self.effects.items()
            },
        )


def _site_of(name: str, bench: bool) -> str:
    effect = EFFECTS[name]
    return "damper" if bench and "damper" in effect.sites else effect.site


def new_model(
    law: str = DEFAULT,
    effects: tuple[str, ...] = (),
    building: str = "",
    drive: str = VOLTAGE.name,
) -> StudyModel:
    """Return a model with every parameter at its default.

    Parameters
    ----------
    law, effects : names of the law and of effects that join it
    building : file of the structure, relative to the study; "" on a bench
    drive : the channel that commands the damper
    """
    model = StudyModel(law, defaults_of(law, "", drive), {}, building, drive=drive)
    for effect in effects:
        model = model.with_effect(effect)
    return model
