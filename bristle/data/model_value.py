"""A value of a model.toml, and what can be read of a law or effect without its code."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import TrustError, UnitError
from ..lines import KeyPath
from ..physics.user import waiting
from ..units import canonical
from .files import Toml

ORIGINS = ("reconstructed", "measured", "assumed", "identified")
VALUE_KEYS = ("value", "unit", "low", "high", "free", "std", "origin")


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


def as_written(toml: Toml, keys: KeyPath, given: Any) -> dict[str, Value]:
    """Return values as the file has them, without knowing the law or effect that they belong to."""
    out = {}
    for own, entry in (given if isinstance(given, dict) else {}).items():
        if not isinstance(entry, dict) or not isinstance(entry.get("value"), int | float):
            continue  # a table of values, or what only the law or effect can judge
        try:
            unit = canonical(toml.text((*keys, own), entry, "unit") or "1")
        except UnitError as error:
            toml.error((*keys, own, "unit"), f"{own}: {error}")
            continue
        low, high, std = (toml.number((*keys, own), entry, key) for key in ("low", "high", "std"))
        value = float(entry["value"])
        out[own] = Value(
            value, unit, value if low is None else low, value if high is None else high,
            entry.get("free", True) is True, std,
            toml.text((*keys, own), entry, "origin", "assumed"),
        )  # fmt: skip
    return out
