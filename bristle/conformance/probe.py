"""What a probe is. Probes are plain functions in `probes/`, listed here in their order."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field
from typing import Literal

from ..core.finding import Finding
from .bench import Bench, ProbePlan

Needs = Literal["file", "library", "run"]
Rule = Literal["standard", "robustness", "bristle"]
Try = Callable[[Bench], Finding]


@dataclass
class Probe:
    """One row to be: what it tries, the rule it holds the FMU to, and the code that tries it.

    It decorates that code, which enters it into the list of probes. `needs` is what must have
    worked before: "file" nothing, "library" that the library loads, "run" that a legal run gave a
    reference. `unless` returns why a probe does not apply, or None. `bare` runs it in an
    interpreter without site-packages. `rule` says what a failure is: a violation of the "standard";
    a lack of "robustness" against what the standard forbids the importer or says nothing of; or a
    violation of a rule of "bristle" for its own FMUs. `fmi3` is the rule of FMI 3.0, where that is
    another one and not only told in other names; `only_fmi2` why it does not apply to FMI 3.0.
    """

    name: str
    _: KW_ONLY
    tried: str
    standard: str
    needs: Needs = "run"
    unless: Callable[[ProbePlan], str | None] = lambda plan: None
    bare: bool = False
    rule: Rule = "standard"
    fmi3: str = ""
    only_fmi2: str = ""
    run: Try = field(init=False)

    def __call__(self, run: Try) -> Try:
        """Take a function as the code that tries it."""
        self.run = run
        PROBES[self.name] = self
        return run


PROBES: dict[str, Probe] = {}


def passed(seen: str) -> Finding:
    """Return the finding that an FMU does what the standard says."""
    return Finding("", "pass", seen)


def failed(seen: str, rule: str = "") -> Finding:
    """Return the finding that a rule is broken, the probe's own or another, or the host dies."""
    return Finding(rule, "error", seen)


def noted(seen: str) -> Finding:
    """Return a finding that a user should know and the standard leaves open."""
    return Finding("", "note", seen)


def unless_claimed(flag: str) -> Callable[[ProbePlan], str | None]:
    """Return a condition: the probe applies to FMUs that claim a capability only."""

    def unless(plan: ProbePlan) -> str | None:
        return None if plan.claims(flag) else f"{flag} is not claimed"

    return unless


def unless_single(plan: ProbePlan) -> str | None:
    """Return why an FMU may be instantiated once only, None if it may be more often."""
    flag = "canBeInstantiatedOnlyOncePerProcess"
    return f"{flag} is claimed" if plan.claims(flag) else None


_RULE = re.compile(r"FMI 2\.0(?: sections? \d[\d.]*\d(?:(?:,| and) \d[\d.]*\d)*)?")
_FUNCTION = re.compile(r"\bfmi2([A-Z]\w*)")
_NAMES = {
    "Instantiate": "InstantiateCoSimulation",
    "GetReal": "GetFloat64", "SetReal": "SetFloat64",
    "GetInteger": "GetInt32", "SetInteger": "SetInt32",
    "SetupExperiment": "EnterInitializationMode",
    "Terminated": "the flag to terminate",
    "DeSerializeFMUstate": "DeserializeFMUState",
}  # fmt: skip
"""Functions that FMI 3.0 calls otherwise, beside the spelling of FMUState."""


def in_fmi3(text: str) -> str:
    """Return a text about FMI 2.0 with the functions and names of FMI 3.0.

    Sections are left out: those of FMI 3.0 are others.

    >>> in_fmi3("FMI 2.0 section 2.1.8: fmi2GetFMUstate, then fmi2GetReal")
    'FMI 3.0: fmi3GetFMUState, then fmi3GetFloat64'
    """
    text = _FUNCTION.sub(_function, _RULE.sub("FMI 3.0", text))
    return text.replace("FMUstate", "FMUState").replace("nvr", "nValueReferences")


def _function(found: re.Match[str]) -> str:
    name = _NAMES.get(found[1], found[1])
    return name if name.startswith("the ") else f"fmi3{name}"
