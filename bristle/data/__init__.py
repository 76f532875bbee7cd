"""What was measured: ground motions, measurements, the checks of both, and a study's model file.

Ground motions are built in, come from an extra package, or from the user's AT2 and CSV files.
"""

from __future__ import annotations

from .ground_motion import (
    GroundMotion,
    baked_in,
    ground_motion_file,
    list_ground_motions,
    read_ground_motion,
)
from .listing import Listing

__all__ = [
    "GroundMotion",
    "Listing",
    "baked_in",
    "ground_motion_file",
    "list_ground_motions",
    "read_ground_motion",
]
