"""bristle: base-isolated buildings with MR dampers, as FMUs and as models that learn.

`bristle.run("scenario.toml")` returns a pandas frame with units; heavy modules are imported
on first use, so that `import bristle` stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from .batch.execute import ensemble as ensemble
    from .simulate.run import run as run

_LAZY = {"ensemble": "batch.execute", "run": "simulate.run"}

__all__ = ["__version__", "ensemble", "run"]


def __getattr__(name: str) -> object:
    if name in _LAZY:
        return getattr(import_module(f".{_LAZY[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
