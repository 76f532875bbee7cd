"""A value of a model.toml, and what can be read of a law or effect without its code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.config import Document, Key, Spec
from ..core.toml_lines import KeyPath
from ..errors import TrustError, UnitError
from ..physics.user import waiting
from ..units import canonical

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
