"""The old name of `bristle.study.data_check`, here for one release."""

from __future__ import annotations

import warnings

from .data_check import DataCheck as FirstLook
from .data_check import check_data as first_look

__all__ = ["FirstLook", "first_look"]

warnings.warn(
    "bristle.study.first_look is now bristle.study.data_check, first_look() is check_data() and "
    "FirstLook is DataCheck",
    DeprecationWarning,
    stacklevel=2,
)
