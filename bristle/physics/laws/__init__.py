"""The laws, one per file; importing this package registers them.

A new law is a new file beside these and its name in the first line of imports. See `law.Law`.
"""

from . import bingham, linear_layer, linear_storey, lugre  # noqa: F401

DEFAULT = "lugre"
"""The damper's law where nobody says another."""

DEFAULT_OF_DESIGN = "bingham"
"""The law of a damper to which a controller is designed, where nobody says another."""
