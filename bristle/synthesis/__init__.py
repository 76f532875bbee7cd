"""Controller synthesis, offline: a task in, a verified controller out.

    from bristle.synthesis import design, read_task
    result = design(read_task("my_design.toml"))
    result.controller.save("my_controller.json")

`facts` of the result hold gamma, the closed-loop norms computed anew, and the poles;
`implausible(task)` tells beforehand what looks unmeant, with the plausible range.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..component.controller_file import Controller, read_controller
from ..core.config import SCHEMA
from ..core.text import written
from ..errors import DesignError
from .analysis import DesignResult, implausible
from .damper import DesignDamper
from .design_file import damper_from_model, read_task, task_from_data
from .task import Scheduling, Task
from .weights import LqgWeights, Weight, Weights

__all__ = [
    "Controller",
    "DesignDamper",
    "DesignResult",
    "LqgWeights",
    "Scheduling",
    "Task",
    "Weight",
    "Weights",
    "damper_from_model",
    "design",
    "implausible",
    "read_controller",
    "read_task",
    "task_from_data",
]


def design(task: Task | str | Path | Mapping[str, Any]) -> DesignResult:
    """Design a controller, and verify it.

    Parameters
    ----------
    task : Task, path or mapping
        A checked task, a design file, or the content of one; its paths are then relative to the
        current folder, and `schema` may be left out.

    Returns
    -------
    DesignResult
        `controller.save(path)` writes the controller file; `facts` holds gamma, the closed-loop
        norms computed anew, and the poles.

    Raises
    ------
    DesignError
        If the task is wrong, or there is no controller that could be used: with the numbers, and
        what would help.

    Examples
    --------
    >>> import bristle
    >>> result = bristle.design({"kind": "lqg"})  # for the paper's building
    >>> result.controller.n, result.facts["sampled_loop_modulus"] < 1.0
    (6, True)
    >>> figure = result.plot()
    """
    from .kinds import design_hinf, design_lpv, design_lqg

    chosen = _task(task)
    return {"hinf": design_hinf, "lpv": design_lpv, "lqg": design_lqg}[chosen.kind](chosen)


def _task(given: object) -> Task:
    if isinstance(given, Task):
        return given
    if isinstance(given, str | Path):
        return read_task(given)
    if isinstance(given, Mapping):
        return task_from_data({"schema": SCHEMA, **given}, Path())
    raise DesignError(
        f"design takes a task, a design file or its content, not {written(given)}: "
        'design({"kind": "hinf"}).'
    )
