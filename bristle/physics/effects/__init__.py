"""The library of physical effects: every module of this folder is imported, which registers it."""

import importlib
import pkgutil

for _module in sorted(found.name for found in pkgutil.iter_modules(__path__)):
    importlib.import_module(__name__ + "." + _module)
