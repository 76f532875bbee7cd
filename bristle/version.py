"""The version of the package; its files say which one wrote them."""

__version__ = "1.0.0"

DATE = "2026-11-27"
"""The day of this version; an FMU that is built without SOURCE_DATE_EPOCH bears it."""
