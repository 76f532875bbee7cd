"""A model: the damper's law, its parameters and the effects that were added, as values."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.config import ANY, Document, Key, Spec
from ..core.text import shown, unknown, written
from ..core.toml_lines import KeyPath
from ..errors import StudyError, TrustError, UnitError
from ..physics.drive import DRIVES, VOLTAGE, declared_for, unit_for
from ..physics.effect import AT, EFFECTS, plain_name
from ..physics.laws import DEFAULT, LAWS, Law, base_and_variant
from ..physics.parameter import CHOICES, Parameter, fields_of
from ..units import canonical, convert
from ..user_code.load import waiting

_DIGITS = 9
_SLACK = 1e-7
"""How far below zero rounding may put an eigenvalue of a matrix of correlations, by its size."""


@dataclass(frozen=True)
class Correlation:
    """How the errors of identified parameters go together.

    `names` as FMUs have them ("f_c", "gas_spring.k"); `rows` the lower triangle of the matrix,
    diagonal included.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]

    def matrix(self) -> Array:
        """Return the whole matrix (p, p), symmetric."""
        out = np.zeros((len(self.names), len(self.names)))
        for i, row in enumerate(self.rows):
            out[i, : i + 1] = out[: i + 1, i] = row
        return out

    def of(self, names: Sequence[str]) -> Correlation:
        """Return the part that is about some of the parameters, in this order."""
        index = [self.names.index(name) for name in self.names if name in names]
        return correlation_of([self.names[i] for i in index], self.matrix()[np.ix_(index, index)])


def correlation_of(names: Sequence[str], matrix: Array) -> Correlation:
    """Return a matrix of correlations (p, p) as a file holds it."""
    rows = [tuple(round(float(v), _DIGITS) for v in matrix[i, : i + 1]) for i in range(len(names))]
    return Correlation(tuple(names), tuple(rows))


def correlation_of_covariance(names: Sequence[str], covariance: Array) -> Correlation:
    """Return the correlations of parameters whose covariance is given, (p, p)."""
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    safe = np.where(spread > 0.0, spread, 1.0)
    matrix = np.clip(covariance / np.outer(safe, safe), -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    return correlation_of(names, matrix)


def covariance_of(
    names: Sequence[str], std: Sequence[float], correlation: Correlation | None
) -> Array:
    """Return the covariance (p, p) of errors with these standard deviations.

    What has no correlation stored counts as independent.
    """
    whole = np.eye(len(names))
    if correlation is not None:
        known = correlation.of(names)
        index = [list(names).index(name) for name in known.names]
        whole[np.ix_(index, index)] = known.matrix()
    return whole * np.outer(std, std)


def _names(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or len({str(name) for name in value}) != len(value):
        raise StudyError(f"is {written(value)}: expected a list of names, each once.")
    return tuple(map(str, value))


CORRELATION = Spec({"parameters": Key(_names, None), "rows": ANY})


def read_correlation(
    document: Document, found: Mapping[str, Any], parameters: Collection[str],
    uncertain: Collection[str],
) -> Correlation | None:  # fmt: skip
    """Return the correlations of a file, None after an error, which `document` then has.

    Parameters
    ----------
    document, found : takes what is wrong; the table
    parameters, uncertain : names of all parameters, and of those with a standard deviation
    """
    names, rows = found["parameters"], found["rows"]
    here = "correlation", "parameters"
    if names is None:
        document.error(here, "[correlation] parameters is missing: expected a list of names.")
        return None
    for name in names:
        if name not in parameters:
            document.error(here, unknown("parameter", name, list(parameters)))
        elif name not in uncertain:
            document.error(here, f"{name} has no std, which its covariance needs.")
    if not _is_triangle(rows, len(names)):
        document.error(
            ("correlation", "rows"),
            f"[correlation] rows: expected the lower triangle for {len(names)} parameters: row i "
            "has i numbers of -1 to 1, the last one 1.",
        )
        return None
    made = Correlation(names, tuple(tuple(map(float, row)) for row in rows))
    if names and (least := float(np.linalg.eigvalsh(made.matrix())[0])) < -_SLACK * len(names):
        document.error(
            ("correlation", "rows"),
            f"no errors can correlate like this: the matrix has the eigenvalue {least:.3g}, below "
            "zero. Identify again, or remove the table.",
        )
    return made


def _is_triangle(rows: Any, count: int) -> bool:
    """Return whether rows are the lower triangle of a matrix of correlations."""
    return (
        isinstance(rows, list)
        and len(rows) == count
        and all(isinstance(row, list) and len(row) == i for i, row in enumerate(rows, 1))
        and all(map(_is_share, (value for row in rows for value in row)))
        and all(float(row[-1]) == 1.0 for row in rows)
    )


def _is_share(value: Any) -> bool:
    """Return whether a value is a number of -1 to 1."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -1.0 <= value <= 1.0


def set_correlation(
    document: Any, correlation: Correlation | None, uncertain: Sequence[str]
) -> None:
    """Put the correlations of what has a standard deviation into a file in place of its own."""
    import tomlkit

    document.pop("correlation", None)
    found = correlation.of(uncertain) if correlation is not None else None
    if found is None or not found.names:
        return
    table, rows = tomlkit.table(), tomlkit.array()
    for row in found.rows:
        rows.append(list(row))
    table["parameters"], table["rows"] = list(found.names), rows.multiline(True)
    document["correlation"] = table


# A value of a model.toml, and what can be read of a law or effect without its code.

ORIGINS = ("reconstructed", "measured", "assumed", "identified")
VALUE = Spec({
    "value": Key(float, None), "unit": Key(str, None), "low": Key(float, None),
    "high": Key(float, None), "free": Key(bool, None), "std": Key(float, None, least=0.0),
    "origin": Key(str, "assumed", choices=ORIGINS),
})  # fmt: skip
"""What a parameter's table may hold; its bounds are asked for where the parameter is known."""


@dataclass(frozen=True)
class Fact:
    """A parameter as a model.toml has it: its numbers in `unit`, as they were typed.

    `value`, `low`, `high` and `std`; whether a fit moves it; its origin.
    """

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


def as_written(document: Document, keys: KeyPath, given: Mapping[str, Any]) -> dict[str, Fact]:
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
        out[own] = Fact(value, unit, low, high, free, found["std"], found["origin"])
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


def defaults_of(law: str, effect: str = "", drive: str = VOLTAGE.name) -> dict[str, Fact]:
    """Return the parameters of an effect, or of a law, at their defaults."""
    if effect:
        fixed: tuple[str, ...] = (*CHOICES, *EFFECTS[effect].assumed)
    else:
        base, variant = base_and_variant(law)
        fixed = (*base.fixed(), *variant.idle)
    return {
        name: Fact(p.value, p.unit, *p.bounds, free=name not in fixed)
        for name, p in declared_of(law, effect, drive).items()
    }


def parameter(law: str, name: str) -> Parameter:
    """Return the declaration of a law's or effect's parameter, for a voltage as the command."""
    effect, _, own = name.rpartition(".")
    if effect:
        return EFFECTS[effect].parameters[own]
    base, variant = base_and_variant(law)
    declared = base.parameters[own]
    return declared._replace(value=variant.values[own]) if own in variant.values else declared


@dataclass(frozen=True)
class Model:
    """A damper's law with effects, and their parameters by the names of FMUs: "gas_spring.k".

    Attributes
    ----------
    law : str
        As a model.toml names it, in a variant ("bingham_standard") or a form ("lugre[quadratic]").
    effects : tuple of str
        Their names.
    values : dict
        In SI; what is missing is at its default. A search replaces these alone.
    fixed : tuple of str
        Parameters that a fit leaves alone.
    limits : dict
        A user's bounds (low, high) in SI, inside of what is physical.
    facts : dict
        What a model.toml tells: units, standard deviations, origins, and numbers as typed. There
        are none of a model that a search made of a law's name.
    correlation : Correlation, optional
        Of the identified parameters' errors, None where none was stored.
    drive : str
        The channel that commands the damper, on whose unit those of parameters depend.
    building : str
        The file of the structure, relative to the study; "" on a bench.
    only_shown : tuple of str
        The effects, and the law, whose code must not run yet: the model can be shown, not used.
    """

    law: str
    effects: tuple[str, ...] = ()
    values: dict[str, float] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)
    facts: dict[str, Fact] = field(default_factory=dict)
    correlation: Correlation | None = None
    drive: str = VOLTAGE.name
    building: str = ""
    only_shown: tuple[str, ...] = ()

    def __repr__(self) -> str:
        values = (
            f"{name} = {fact.value:.6g}" + (f" {fact.unit}" if fact.unit != "1" else "")
            for name, fact in self.written().items()
        )
        return shown(self, " + ".join([self.law, *self.effects]), values)

    @property
    def law_class(self) -> type[Law]:
        """The law's class, that of the law itself where it is a variant."""
        return base_and_variant(self.law)[0]

    @property
    def base_law(self) -> str:
        """The law without its variant: "bingham" of "bingham_standard"."""
        return self.law_class.name

    def free(self) -> list[str]:
        """Return the names of the parameters that a fit moves."""
        law = self.law_class
        fixed_of_law = law.fixed()
        names = [name for name in law.parameters if name not in fixed_of_law]
        for effect in self.effects:
            joined = EFFECTS[effect]
            idle = () if law.has("bristle") else joined.bristles
            fixed = (*CHOICES, *joined.assumed, *idle)
            names += [f"{effect}.{name}" for name in joined.parameters if name not in fixed]
        out = {*self.fixed, *law.idle(self.values)}
        return [name for name in names if name not in out]

    def value(self, name: str) -> float:
        """Return a parameter's value [SI], its default where none is given."""
        given = self.values.get(name)
        return float(parameter(self.law, name).value if given is None else given)

    def bounds(self, name: str) -> tuple[float, float]:
        """Return the bounds of a parameter [SI]: the user's, else those of what is physical."""
        low, high = parameter(self.law, name).bounds
        own = self.limits.get(name, (low, high))
        return max(low, own[0]), min(high, own[1])

    def declared(self, name: str) -> Parameter:
        """Return the declaration of a parameter for the model's drive: default, unit, bounds, text.

        Of an effect or law that is only shown the file tells what there is.
        """
        if (name.rpartition(".")[0] or self.law) in self.only_shown:
            fact = self.facts[name]
            return Parameter(fact.value, fact.unit, (fact.low, fact.high), "")
        declared = parameter(self.law, name)
        if self.drive == VOLTAGE.name:
            return declared
        return declared_for(declared, DRIVES[self.drive])

    # What a model.toml tells, and how a model follows from it.

    def written(self) -> dict[str, Fact]:
        """Return all parameters as a model.toml has them, numbers as typed where they still are."""
        return {name: self._written(name) for name in self.facts or self.values}

    def written_for(self, drive: str) -> dict[str, Fact]:
        """Return what `written` does; without a `drive` ("") not what acts through one alone."""
        driven = () if drive or self.law not in LAWS else LAWS[self.law].driven()
        return {name: fact for name, fact in self.written().items() if name not in driven}

    def written_of(self, effect: str = "") -> dict[str, Fact]:
        """Return the parameters of an effect, or of the law, by their own names; see `written`."""
        parts = ((name.rpartition("."), fact) for name, fact in self.written().items())
        return {own: fact for (of, _, own), fact in parts if of == effect}

    def _written(self, name: str) -> Fact:
        declared = self.declared(name)
        unit = declared.unit
        fact = self.facts.get(name) or Fact(declared.value, unit, *declared.bounds)

        def typed(number: float, before: float) -> float:
            same = convert(before, fact.unit, unit) == number
            return before if same else convert(number, unit, fact.unit)

        low, high = self.limits.get(name, declared.bounds)
        return replace(
            fact, value=typed(self.value(name), fact.value), low=typed(low, fact.low),
            high=typed(high, fact.high), free=name not in self.fixed,
        )  # fmt: skip

    def with_facts(self, facts: Mapping[str, Fact]) -> Model:
        """Return the model with parameters as a model.toml has them."""
        made = replace(self, facts={**self.facts, **facts})
        values, limits = dict(self.values), dict(self.limits)
        for name, fact in facts.items():
            unit = made.declared(name).unit
            values[name], low, high = (
                convert(number, fact.unit, unit) for number in (fact.value, fact.low, fact.high)
            )
            limits[name] = low, high
        held = (name for name, fact in facts.items() if not fact.free)
        fixed = (*(name for name in self.fixed if name not in facts), *held)
        return replace(made, values=values, limits=limits, fixed=fixed)

    def with_values(
        self,
        values: Mapping[str, float],
        std: Mapping[str, float] | None = None,
        origin: str = "identified",
    ) -> Model:
        """Return the model with values in SI, and their standard deviations, as facts."""
        facts = {}
        for name, value in values.items():
            before, unit = self._written(name), self.declared(name).unit
            spread = convert(std[name], unit, before.unit) if std and name in std else None
            # Through the file's unit: it reads back as the same number.
            value = convert(value, unit, before.unit)
            facts[name] = replace(before, value=value, std=spread, origin=origin)
        # Errors of other values say nothing of these.
        others = [name for name in self.facts if name not in values]
        correlation = self.correlation.of(others) if self.correlation else None
        return replace(self.with_facts(facts), correlation=correlation)

    def identified(
        self, values: Mapping[str, float], std: Mapping[str, float], lost: Sequence[str],
        covariance: Array,
    ) -> Model:  # fmt: skip
        """Return the model as its identification leaves it.

        Parameters
        ----------
        values : in SI
        std : of those that were searched [SI]
        lost : which of them the data do not identify, and others that they say nothing of
        covariance : (p, p) of the errors of `std`
        """

        def inside(names: Sequence[str]) -> dict[str, float]:
            """Return values that rounding has not put outside of their bounds."""
            given = {name: values.get(name, self.value(name)) for name in names}
            return {n: float(np.clip(v, *self.bounds(n))) for n, v in given.items()}

        told = [name for name in std if name not in lost]
        silent = [name for name in lost if name not in self.fixed]
        found = self.with_values(inside(told), std).with_values(inside(silent), origin="assumed")
        index = [list(std).index(name) for name in told]
        if not told:
            return found
        return found.with_covariance(told, covariance[np.ix_(index, index)])

    def with_covariance(self, names: Sequence[str], covariance: Array) -> Model:
        """Return the model with how the errors of these parameters go together.

        Parameters
        ----------
        names : parameters, whose standard deviations the model has
        covariance : (p, p) of their errors, in SI
        """
        return replace(self, correlation=correlation_of_covariance(names, covariance))

    def uncertain(self) -> list[str]:
        """Return the names of the parameters that have a standard deviation."""
        return [n for n, f in self.facts.items() if f.std is not None and isfinite(f.std)]

    def covariance(self) -> tuple[tuple[str, ...], Array]:
        """Return the identified parameters and the covariance (p, p) of their errors in SI.

        Without a stored correlation errors count as independent.
        """
        names, facts = self.uncertain(), self.facts
        std = [
            convert(facts[name].std or 0.0, facts[name].unit, self.declared(name).unit)
            for name in names
        ]
        return tuple(names), covariance_of(names, std, self.correlation)

    # Other effects, another law, another command.

    def only(self, effects: Sequence[str], law: bool = True) -> Model:
        """Return the model with these of its effects alone, and what is given of them.

        Parameters
        ----------
        effects : their names
        law : whether what is given of the law's parameters stays
        """

        def kept(name: str) -> str:
            effect = name.rpartition(".")[0]
            return name if (effect in effects if effect else law) else ""

        return replace(self._named(kept), effects=tuple(effects))

    def by_plain_names(self) -> Model:
        """Return the model of one site, whose effects have their plain names there."""
        if not any(AT in name for name in self.effects):
            return self
        return replace(self._named(plain_name), effects=tuple(map(plain_name, self.effects)))

    def _named(self, as_name: Callable[[str], str]) -> Model:
        """Return the model with parameters by other names; "" leaves one out."""
        fixed = tuple(new for name in self.fixed if (new := as_name(name)))
        return replace(
            self, values={new: v for name, v in self.values.items() if (new := as_name(name))},
            fixed=fixed,
            limits={new: v for name, v in self.limits.items() if (new := as_name(name))},
            facts={new: v for name, v in self.facts.items() if (new := as_name(name))},
        )  # fmt: skip

    def at(self, site: str, bench: bool) -> Model:
        """Return the model with the effects of one site alone, by their plain names.

        Parameters
        ----------
        site : one of `physics.effect.SITES`
        bench : whether the model is of a damper on a bench, whose effects are all the damper's
        """
        own = [name for name in self.effects if _site_of(name, bench) == site]
        return self.only(own).by_plain_names()

    def with_effect(self, effect: str) -> Model:
        """Return the model with one more effect, its parameters at their defaults."""
        added = {f"{effect}.{own}": f for own, f in defaults_of("", effect, self.drive).items()}
        return replace(self, effects=(*self.effects, effect)).with_facts(added)

    def with_law(self, law: str, effects: Sequence[str]) -> Model:
        """Return the model with another law at its defaults, and with these of its effects."""
        new, own = new_model(law, (), self.building, self.drive), self.only(effects, law=False)
        return replace(new, effects=own.effects).with_facts(own.written())

    def with_drive(self, drive: str) -> Model:
        """Return the model for another command: the same numbers, per ampere in place of per volt.

        Parameters
        ----------
        drive : one of `data.channels.DRIVE`
        """
        if drive == self.drive:
            return self
        old = DRIVES[self.drive].unit
        facts = {
            name: replace(fact, unit=unit_for(fact.unit, DRIVES[drive], old))
            for name, fact in self.facts.items()
        }
        return replace(self, drive=drive, facts=facts)


def unfit(law: type[Law], effects: Sequence[str]) -> list[str]:
    """Return the effects that act where a law does and cannot join it."""
    return [n for n in effects if law.site in EFFECTS[n].sites and not EFFECTS[n].joins(law)]


def _site_of(name: str, bench: bool) -> str:
    effect = EFFECTS[name]
    return "damper" if bench and "damper" in effect.sites else effect.site


def new_model(
    law: str = DEFAULT,
    effects: tuple[str, ...] = (),
    building: str = "",
    drive: str = VOLTAGE.name,
) -> Model:
    """Return a model with every parameter at its default.

    Parameters
    ----------
    law, effects : names of the law and of effects that join it
    building : file of the structure, relative to the study; "" on a bench
    drive : the channel that commands the damper
    """
    bare = Model(law, drive=drive, building=building)
    model = bare.with_facts(defaults_of(law, "", drive))
    for effect in effects:
        model = model.with_effect(effect)
    return model
