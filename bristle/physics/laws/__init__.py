"""The laws, one per file; importing this package registers them.

A new law is a new file beside these, and its name in the first line of imports: see `law.Law`.
Whoever asks for laws takes them from here.
"""

from ..law import LAWS as LAWS
from ..law import LEAST as LEAST
from ..law import Law as Law
from ..law import base_and_variant as base_and_variant
from ..law import law_code as law_code
from ..law import law_names as law_names
from ..law import law_of_part as law_of_part
from ..law import laws_of as laws_of
from . import bingham, linear_layer, linear_storey, lugre  # noqa: F401

DEFAULT = "lugre"
"""The damper's law where nobody says another."""

DEFAULT_OF_DESIGN = "bingham"
"""The law of a damper to which a controller is designed, where nobody says another."""
