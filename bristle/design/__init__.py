"""Controller synthesis, offline: a task in, a verified controller out.

    from bristle.design import design, read_task
    result = design(read_task("my_design.toml"))
    result.controller.save("my_controller.json")

`facts` of the result hold gamma, the closed-loop norms computed anew, and the poles.
"""

from __future__ import annotations

from ..control.controller import Controller, read_controller
from .file import damper_from_model, read_task, task_from_data
from .result import DesignResult
from .sliding import Damper
from .task import Scheduling, Task
from .weights import LqgWeights, Weight, Weights

__all__ = [
    "Controller",
    "Damper",
    "DesignResult",
    "LqgWeights",
    "Scheduling",
    "Task",
    "Weight",
    "Weights",
    "damper_from_model",
    "design",
    "read_controller",
    "read_task",
    "task_from_data",
]


def design(task: Task) -> DesignResult:
    """Return the verified controller of a task.

    Raises
    ------
    DesignError
        If there is none that could be used: with the numbers, and what would help.
    """
    from .hinf import design_hinf
    from .lpv import design_lpv
    from .lqg import design_lqg

    return {"hinf": design_hinf, "lpv": design_lpv, "lqg": design_lqg}[task.kind](task)
