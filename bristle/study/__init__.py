"""Studies: a folder with measurements, the model held against them, and its history."""

from __future__ import annotations

from ..data.model import StudyModel, Value, new_model, read_model
from ..data.model_text import write_model
from ..errors import StudyError
from .create import Created, create_study
from .history import Step
from .run_file import RunFile
from .runs import Runs
from .settings import Settings
from .study import Study

__all__ = [
    "Created",
    "RunFile",
    "Runs",
    "Settings",
    "Step",
    "Study",
    "StudyError",
    "StudyModel",
    "Value",
    "create_study",
    "new_model",
    "read_model",
    "write_model",
]
