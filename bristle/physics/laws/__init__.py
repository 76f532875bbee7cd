"""The laws, one per file: every module of this folder is imported, which registers it.

A new law is a new file beside these: see `law.Law`. Whoever asks for laws takes them from here.
"""

import importlib
import pkgutil

from ..law import LAWS as LAWS
from ..law import LEAST as LEAST
from ..law import Law as Law
from ..law import base_and_variant as base_and_variant
from ..law import law_code as law_code
from ..law import law_names as law_names
from ..law import law_of_part as law_of_part
from ..law import laws_of as laws_of

DEFAULT = "lugre"
"""The damper's law where nobody says another."""

DEFAULT_OF_DESIGN = "bingham"
"""The law of a damper to which a controller is designed, where nobody says another."""

for _module in sorted(found.name for found in pkgutil.iter_modules(__path__)):
    importlib.import_module(__name__ + "." + _module)
