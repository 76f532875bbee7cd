"""A toy FMU for the tests of `bristle conform`: a first-order lag that can be made to misbehave.

The tests put one word in place of "healthy" below, and each word spoils one thing.
"""

import importlib.util
import os
import random
import signal
import sys
import time
from pathlib import Path
from xml.etree.ElementTree import SubElement

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String

TRAIT = "healthy"
SHARED = {"memory": 0.0, "leak": []}


class Toy(Fmi2Slave):
    """y' = (gain u - y) / tau."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.gain, self.tau, self.mode = 0.0, 2.0, 0.3, "lag"
        self.y, self.twice, self.steps, self.high = 0.0, 0.0, 0, False
        self.hidden = 0.0
        self.ready = False
        output = {"causality": Fmi2Causality.output}
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        discrete = {"variability": Fmi2Variability.discrete}
        self.register_variable(
            Real("u", causality=Fmi2Causality.input, variability=Fmi2Variability.continuous)
        )
        self.register_variable(Real("y", **output))
        self.register_variable(Real("twice", **output))
        self.register_variable(Integer("steps", **output, **discrete))
        self.register_variable(Boolean("high", **output, **discrete))
        self.register_variable(Real("gain", **fixed))
        self.register_variable(Real("tau", **fixed))
        self.register_variable(String("mode", **fixed))
        if TRAIT == "crash at instantiation":
            os.kill(os.getpid(), signal.SIGSEGV)
        if TRAIT == "leak":
            SHARED["leak"].append(bytearray(1024 * 1024))
        if TRAIT == "remember gain" and "gain" in SHARED:
            self.gain = SHARED["gain"]

    def exit_initialization_mode(self):
        self.ready = True
        self.twice = 2.0 * self.u
        if TRAIT == "remember gain":
            SHARED["gain"] = self.gain
        if TRAIT == "gain at entry":
            self.gain = self.entered
        if TRAIT == "NaN at the start":
            self.y = float("nan")

    def enter_initialization_mode(self):
        self.entered = self.gain

    def terminate(self):
        if TRAIT == "hang at terminate":
            time.sleep(1000.0)

    def set_real(self, references, values):
        if TRAIT == "forget inputs":
            return
        super().set_real(references, values)
        if TRAIT == "secret dependency" and self.ready:
            self.y = self.y + self.u

    def do_step(self, current_time, step):
        if TRAIT == "abort" and self.steps == 5:
            os.abort()
        if TRAIT == "exit" and self.steps == 5:
            os._exit(3)
        if TRAIT == "hang" and self.steps == 5:
            time.sleep(1000.0)
        if TRAIT == "end early" and self.steps == 10:
            return False
        if TRAIT == "never step":
            return None
        if TRAIT == "raise" and self.steps == 5:
            raise ValueError("a toy that raises")
        if TRAIT == "crash on NaN" and self.u != self.u:
            os.kill(os.getpid(), signal.SIGSEGV)
        if TRAIT == "crash on infinity" and abs(self.u) == float("inf"):
            os.kill(os.getpid(), signal.SIGSEGV)
        if TRAIT == "crash on large numbers" and 1e200 < abs(self.u) < float("inf"):
            os.kill(os.getpid(), signal.SIGSEGV)
        if TRAIT == "hang on infinity" and step == float("inf"):
            time.sleep(1000.0)
        if TRAIT == "crash before initialisation" and not self.ready:
            os.kill(os.getpid(), signal.SIGSEGV)
        if TRAIT == "one step size" and abs(step - 0.01) > 1e-12:
            return False
        if TRAIT == "need a package":
            import filelock  # noqa: F401
        self.steps += 1
        self.y += step / self.tau * (self.gain * self.u - self.y)
        self.twice = 2.0 * self.u
        self.high = self.y > 0.0
        if TRAIT == "hidden state":
            self.hidden += self.u * step
            self.y += self.hidden
        if TRAIT == "shared state":
            SHARED["memory"] += self.u * step
            self.y += SHARED["memory"]
        if TRAIT == "random":
            self.y += 1e-6 * random.random()
        if TRAIT == "NaN":
            self.y = float("nan") if self.steps > 5 else self.y
        if TRAIT == "NaN when driven" and self.u != 0.0 and self.steps > 5:
            self.y = float("nan")
        if TRAIT == "remember NaN":
            SHARED["spoilt"] = SHARED.get("spoilt", 0.0) + (self.u != self.u)
            self.y += SHARED["spoilt"]
        if TRAIT == "count in the process":
            sys.toy_steps = getattr(sys, "toy_steps", 0) + 1
            self.y += 1e-3 * sys.toy_steps
        if TRAIT == "look at the path":
            self.y += 1e-3 * len(sys.path)
        if TRAIT == "use numpy if there is one":
            self.y += 1e-3 * (importlib.util.find_spec("numpy") is not None)
        if TRAIT == "leave a file":
            Path("left.txt").write_text("left")
        if TRAIT == "strange category":
            self.log("a word", category="logStrange")
        return True

    def _set_fmu_state(self, state):
        super()._set_fmu_state(state)
        if TRAIT == "crash on restore":
            os.kill(os.getpid(), signal.SIGSEGV)

    @staticmethod
    def _fmu_state_to_bytes(state):
        if TRAIT == "lossy bytes":
            state = {**state, "y": round(state["y"], 3)}
        return Fmi2Slave._fmu_state_to_bytes(state)

    def to_xml(self, model_options=None):
        root = super().to_xml(model_options or {})
        del root.attrib["generationDateAndTime"]
        names = [v.name for v in self.vars.values()]
        definitions = SubElement(root, "UnitDefinitions")
        SubElement(SubElement(definitions, "Unit", name="m"), "BaseUnit", m="1")
        root.remove(definitions)
        root.insert(1, definitions)
        for node in root.find("ModelVariables"):
            if node[0].tag == "Real":
                node[0].set("unit", "m")
        structure = root.find("ModelStructure")
        unknowns = SubElement(structure, "InitialUnknowns")
        for node in structure.find("Outputs"):
            node.set("dependencies", "")
            SubElement(unknowns, "Unknown", index=node.get("index"))
        experiment = {"startTime": "0.0", "stopTime": "0.5", "stepSize": "0.01"}
        root.insert(3, root.makeelement("DefaultExperiment", experiment))
        assert names[0] == "u"
        return root
