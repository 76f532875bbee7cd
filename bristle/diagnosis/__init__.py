"""Where a model fails and which effect explains it."""

from __future__ import annotations

from .diagnosis import diagnose, diagnose_rig
from .verdict import Diagnosis

__all__ = ["Diagnosis", "diagnose", "diagnose_rig"]
