"""Toy FMUs with outputs that can be worked out by hand, built by pythonfmu into a folder."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pythonfmu.builder import FmuBuilder

HEAD = """
import os
import time

from pythonfmu import (
    Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real, String
)
from pythonfmu.enums import Fmi2Status


class {name}(Fmi2Slave):
    inputs = {inputs}
    outputs = {outputs}
    parameters = {parameters}
    follows = {follows}
    kinds = {{float: Real, int: Integer, bool: Boolean, str: String}}

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for ports, causality in ((self.inputs, "input"), (self.outputs, "output")):
            for port, start in ports.items():
                setattr(self, port, start)
                kind = self.kinds[type(start)]
                changes = "continuous" if kind is Real else "discrete"
                self.register_variable(kind(
                    port,
                    causality=Fmi2Causality[causality],
                    variability=Fmi2Variability[changes],
                    initial=Fmi2Initial.calculated if causality == "output" else None,
                ))
        for port, start in self.parameters.items():
            setattr(self, port, start)
            self.register_variable(self.kinds[type(start)](
                port, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed,
            ))

    def to_xml(self, model_options=dict()):
        root = super().to_xml(model_options)
        names = [variable.name for variable in self.vars.values()]
        for unknown in root.find("ModelStructure").find("Outputs"):
            output = names[int(unknown.attrib["index"]) - 1]
            if self.follows is not None:
                causes = [str(names.index(cause) + 1) for cause in self.follows.get(output, ())]
                unknown.set("dependencies", " ".join(causes))
        return root
"""

RAMP = """
    def do_step(self, t, h):
        self.value = t + h
        return True
"""

INTEGRATOR = """
    def get_real(self, vrs):
        self.y = self.x + self.gain * self.u
        return super().get_real(vrs)

    def do_step(self, t, h):
        self.x += h * self.u
        return True
"""

GAIN = """
    def get_real(self, vrs):
        self.y = self.gain * self.u + self.offset
        return super().get_real(vrs)

    def do_step(self, t, h):
        self.steps += 1
        self.y_last = self.gain * self.u + self.offset
        return True
"""

LOGIC = """
    def do_step(self, t, h):
        self.count = self.number + 1
        self.flipped = not self.flag
        return True
"""

TEXTS = """
    def do_step(self, t, h):
        self.number = len(self.heard)
        return True
"""

FAILING = """
    def exit_initialization_mode(self):
        if self.at == 0.0:
            self.fault = 5

    def do_step(self, t, h):
        if t + h < self.at - 1e-9:
            self.value = t + h
            return True
        if self.how == "discard":
            return False
        if self.how == "raise":
            raise ValueError("this component breaks")
        if self.how == "fault":
            self.fault = 4
            return True
        if self.how == "fault and discard":
            self.fault = 1
            return False
        if self.how == "nan":
            self.value = float("nan")
            return True
        if self.how == "warning":
            self.log("it gets warm", Fmi2Status.warning)
        if self.how == "abort":
            os.abort()
        if self.how.startswith("hang"):
            open(self.how[5:] or os.devnull, "w").close()  # tells that it does
            while True:
                time.sleep(0.05)
        if self.how == "slow":
            time.sleep(0.01)
        self.value = t + h
        return True
"""

TOYS = {
    "Ramp": ({}, {"value": 0.0}, {}, {}, RAMP),
    "Integrator": (
        {"u": 0.0},
        {"x": 0.0, "y": 0.0},
        {"gain": 1.0},
        {"y": ["u"]},
        INTEGRATOR,
    ),
    "Gain": ({"u": 0.0}, {"y": 0.0}, {"gain": 2.0, "offset": 0.0}, {"y": ["u"]}, GAIN),
    "Untold": ({"u": 0.0}, {"y": 0.0}, {"gain": 2.0, "offset": 0.0}, None, GAIN),
    "Delay": (
        {"u": 0.0},
        {"y_last": 0.0},
        {"gain": 1.0, "offset": 0.0},
        {},
        GAIN.replace("self.y =", "self.dummy ="),
    ),
    "Logic": (
        {"number": 0, "flag": False},
        {"count": 0, "flipped": False},
        {},
        {},
        LOGIC,
    ),
    "Texts": ({"heard": "nothing"}, {"said": "something", "number": 0}, {}, {}, TEXTS),
    "Failing": (
        {"u": 0.0},
        {"value": 0.0, "fault": 0},
        {"how": "discard", "at": 0.5},
        {},
        FAILING,
    ),
}


def build_toys(folder: Path) -> dict[str, Path]:
    """Build all toys into a folder; return their files by name."""
    before = list(sys.path), set(sys.modules)
    built = {}
    try:
        for name, (inputs, outputs, parameters, follows, body) in TOYS.items():
            script = folder / f"{name.lower()}_toy.py"
            head = HEAD.format(
                name=name, inputs=inputs, outputs=outputs, parameters=parameters, follows=follows
            )
            extra = "\n    steps = 0\n" if body in (GAIN, TOYS["Delay"][4]) else ""
            script.write_text(head + extra + body)
            path = FmuBuilder.build_FMU(script, dest=folder, needsExecutionTool=False)
            built[name] = Path(path)
    finally:
        sys.path[:] = before[0]
        for module in set(sys.modules) - before[1]:
            if module.endswith("_toy"):
                del sys.modules[module]
    return built


class Maker:
    """Writes scenarios: components as "name: Toy", wires as "target.input": "source.output"."""

    def __init__(self, toys: Mapping[str, Path], folder: Path) -> None:
        self.toys = toys
        self.folder = folder

    def __call__(
        self,
        components: Mapping[str, str],
        wires: Mapping[str, str] | None = None,
        *,
        parameters: Mapping[str, Mapping[str, Any]] | None = None,
        steps: Mapping[str, float] | None = None,
        stop: float = 1.0,
        step: float = 0.1,
        algorithm: str = "gauss-seidel",
    ) -> Path:
        lines = ["schema = 1", 'title = "toys"', "[run]", f"stop = {stop!r}", f"step = {step!r}"]
        lines.append(f'algorithm = "{algorithm}"')
        for name, toy in components.items():
            lines += [f"[components.{name}]", f"fmu = {json.dumps(str(self.toys[toy]))}"]
            if name in (steps or {}):
                lines.append(f"step = {steps[name]!r}")
            given = (parameters or {}).get(name, {})
            pairs = ", ".join(f"{key} = {json.dumps(value)}" for key, value in given.items())
            lines.append(f"parameters = {{ {pairs} }}")
        lines.append("[connections]")
        lines += [f'"{target}" = "{source}"' for target, source in (wires or {}).items()]
        file = self.folder / "toys.toml"
        file.write_text("\n".join(lines) + "\n")
        return file
