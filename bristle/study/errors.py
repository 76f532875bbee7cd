"""What can go wrong with a study."""

from __future__ import annotations

from ..errors import BristleError


class StudyError(BristleError):
    """A study's folder or one of its files that cannot be read, or must not be changed."""
