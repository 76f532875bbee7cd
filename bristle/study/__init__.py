"""Studies: a folder with measurements, the model held against them, and its history."""

from __future__ import annotations

from ..errors import StudyError
from ..model.model import Fact, Model, new_model
from ..model.model_file import read_model, write_model
from .history import Step
from .runs import Runs
from .steps import Created, create_study
from .study import Study
from .study_file import RunFile, Settings

__all__ = [
    "Created",
    "Fact",
    "Model",
    "RunFile",
    "Runs",
    "Settings",
    "Step",
    "Study",
    "StudyError",
    "create_study",
    "new_model",
    "read_model",
    "write_model",
]
