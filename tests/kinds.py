"""Components that stand for others in tests of what they share."""

from __future__ import annotations

ONE_OF_EACH = (
    "Structure", "BinghamDamper", "LuGreDamper", "GroundMotion", "SignalSource", "Sensors",
    "ClippedOptimal", "Skyhook",
)  # fmt: skip
"""A component of each slave class; of dampers a law without states and one with."""
