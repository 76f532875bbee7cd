"""What the parent tells its child processes about the FMU: one JSON file."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..fmu.description import Description, Variable


@dataclass
class Plan:
    """An unpacked FMU and how to try it; times in s.

    `steps` is how many communication steps the comparing probes take, `instances` how often
    the repeating ones instantiate; both shrink for an FMU that is slow. `driven` says whether
    real inputs may be moved. `tolerance` [1] is that of the FMU's solver, 0 where it states none:
    two runs are equal if they differ by less of a variable's largest value. `ours` says that
    bristle's rules for faults apply. `fmi3` is also known where the variables cannot be read.
    """

    fmu: str
    folder: str
    work: str
    timeout: float
    description: Description | None = None
    start: float = 0.0
    stop: float | None = None
    step: float = 0.01
    steps: int = 60
    instances: int = 30
    driven: bool = True
    tolerance: float = 0.0
    repeatable: bool = True
    ours: bool = False
    fmi3: bool = False
    categories: list[str] = field(default_factory=list)
    beside: Plan | None = None

    @property
    def about(self) -> Description:
        """Return the description; probes that run the FMU are only started with one."""
        assert self.description is not None
        return self.description

    @property
    def resources(self) -> str:
        """Return where the resources are: an URI, in FMI 3.0 a path that ends like a folder's."""
        folder = Path(self.folder) / "resources"
        return f"{folder}{os.sep}" if self.about.version == "3.0" else folder.as_uri()

    @property
    def end(self) -> float:
        """Return where the default experiment ends; one second after its start if not said."""
        return self.start + 1.0 if self.stop is None else self.stop

    def claims(self, flag: str) -> bool:
        """Return whether a capability flag of the FMU is set."""
        return self.about.capabilities.get(flag, "false").strip() in ("true", "1")

    def variables(self, causality: str, *kinds: str) -> list[Variable]:
        """Return the variables of a causality, of certain kinds or of all."""
        return [v for v in self.about.of(causality) if not kinds or v.kind in kinds]

    def save(self, file: Path) -> None:
        """Write the plan as JSON."""
        file.write_text(json.dumps(asdict(self)))

    @staticmethod
    def load(file: Path) -> Plan:
        """Read what `save` wrote."""
        return _plan(json.loads(file.read_text()))


def _plan(raw: dict[str, Any]) -> Plan:
    if raw["description"] is not None:
        raw["description"] = _description(raw["description"])
    if raw["beside"] is not None:
        raw["beside"] = _plan(raw["beside"])
    return Plan(**raw)


def _description(raw: dict[str, Any]) -> Description:
    variables = {}
    for name, fields in raw["variables"].items():
        causes = fields["dependencies"]
        fields["dependencies"] = None if causes is None else tuple(causes)
        variables[name] = Variable(**fields)
    return Description(**{**raw, "variables": variables})
