"""What a law or an effect declares for a model.toml: its parameters, tables and defaults."""

from __future__ import annotations

from ..physics.drive import DRIVES, VOLTAGE, declared_for
from ..physics.effect import EFFECTS
from ..physics.laws import base_and_variant
from ..physics.parameter import CHOICES, Parameter, fields_of
from .model_value import Value


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
