"""Judge an FMU: every rule of FMI 2.0 or 3.0 co-simulation that can be tried from outside.

`conform(path)` tries each probe in a process of its own, so that an FMU that crashes, hangs or
leaves the process ends one row of the table and nothing else.
"""

from __future__ import annotations

from .runner import conform

__all__ = ["conform"]
