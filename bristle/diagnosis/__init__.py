"""Where a model fails and which effect explains it."""

from __future__ import annotations

from .diagnosis import diagnose_rig
from .verdict import Diagnosis

__all__ = ["Diagnosis", "diagnose_rig"]
