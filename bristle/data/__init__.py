"""What was measured: ground motions, measurements, and the checks of both.

Ground motions are built in, come from an extra package, or from the user's files.
"""

from __future__ import annotations

from .ground_motion import (
    baked_in,
    ground_motion_file,
    list_ground_motions,
    read_ground_motion,
)
from .listing import Listing

__all__ = ["Listing", "baked_in", "ground_motion_file", "list_ground_motions", "read_ground_motion"]
