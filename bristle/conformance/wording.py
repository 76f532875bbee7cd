"""What a row says of an FMU of FMI 3.0. Probes are written once, in the names of FMI 2.0."""

from __future__ import annotations

import re

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
