"""What can be judged before any code of the FMU runs: the archive and modelDescription.xml."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
import zipfile
from collections import Counter, defaultdict
from pathlib import Path

from ...core.finding import Finding
from ...errors import FmuError
from ...fmu.description import Variable, describe, read_root
from ...fmu.library import UnexpectedError
from ..bench import Bench, ProbePlan, some
from ..probe import Probe, failed, noted, passed

_UNIT_IN_WORDS = re.compile(r"\[.+\]|\bin the unit of\b")
"""What a description says where FMI has no way to write the unit, or any will do."""


def _root(bench: Bench) -> ElementTree.Element:
    return read_root(Path(bench.plan.fmu), any_platform=True)


def _unreadable(plan: ProbePlan) -> str | None:
    return None if plan.description is not None else "the variables cannot be read"


@Probe(
    "archive",
    tried="member names of the zip file",
    standard="FMI 2.0 section 2.3: one zip file with modelDescription.xml at its root; names in a "
    "zip file use forward slashes. A name that occurs twice is left to chance.",
    needs="file",
)
def archive(bench: Bench) -> Finding:
    """Look for names that tools read differently."""
    with zipfile.ZipFile(bench.plan.fmu) as file:
        names = [info.orig_filename for info in file.infolist()]
    slashed = [n for n in names if "\\" in n]
    if slashed:
        return failed(f"names with backslashes: {some(slashed)}")
    twice = [n for n, times in Counter(names).items() if times > 1]
    if twice:
        return noted(f"names that occur twice: {some(twice)}")
    return passed(f"{len(names)} members, all named soundly")


@Probe(
    "modelDescription.xml",
    tried="the XML schema; names, causalities, required starts, units, ModelStructure",
    standard="FMI 2.0 section 2.2 and its schema files, with the rules of 2.2.7 (variables) and "
    "2.2.8 (every output in Outputs, every unknown of initialisation in InitialUnknowns)",
    needs="file",
)
def model_description(bench: Bench) -> Finding:
    """Validate with fmpy, and read with bristle's own reader."""
    from fmpy.validation import validate_fmu

    problems = list(validate_fmu(bench.plan.fmu))
    try:
        describe(_root(bench))
    except FmuError as error:
        problems.append(str(error))
    if problems:
        return failed(f"{len(problems)} problems: {some(problems)}")
    return passed("no problem found")


@Probe(
    "guid",
    tried="the guid in modelDescription.xml",
    standard="FMI 2.0 section 2.2.1: guid is required; it ties the file to the code",
    fmi3="FMI 3.0: instantiationToken, as it is called there, is required; it ties the file to the "
    "code",
    needs="file",
)
def guid(bench: Bench) -> Finding:
    """Ask for a guid that is there and says something."""
    text = _root(bench).get("instantiationToken" if bench.plan.fmi3 else "guid")
    if text is None or not text.strip():
        return failed("there is none")
    return passed(text)


@Probe(
    "value references",
    tried="whether two variables of one type share a reference",
    standard="FMI 2.0 section 2.2.7: variables of one base type with one value reference are "
    "aliases, and at most one of an alias set may be set",
    fmi3="FMI 3.0: a value reference belongs to one variable; further names of it are aliases "
    "inside that",
    needs="file",
    unless=_unreadable,
)
def value_references(bench: Bench) -> Finding:
    """Find aliases, and the ones that cannot be."""
    if bench.plan.fmi3:
        return _unique_references(bench)
    sets: dict[tuple[str, int], list[Variable]] = defaultdict(list)
    for v in bench.plan.about.variables.values():
        kind = "Integer" if v.kind == "Enumeration" else v.kind
        sets[kind, v.reference].append(v)
    aliases = [group for group in sets.values() if len(group) > 1]
    wrong = [
        " = ".join(v.name for v in group)
        for group in aliases
        if sum(v.causality in ("input", "parameter") for v in group) > 1
        or len({v.unit for v in group}) > 1
    ]
    if wrong:
        return failed(f"aliases that cannot be set or read as one: {some(wrong)}")
    return passed(f"{len(sets)} references, {len(aliases)} of them shared by aliases")


def _unique_references(bench: Bench) -> Finding:
    variables = _root(bench).findall("ModelVariables/*")
    counts = Counter(v.get("valueReference") for v in variables)
    wrong = [str(reference) for reference, times in counts.items() if times > 1]
    if wrong:
        return failed(f"references that two variables have: {some(wrong)}")
    aliases = sum(len(v.findall("Alias")) for v in variables)
    return passed(f"{len(counts)} references, {aliases} aliases")


@Probe(
    "start values",
    tried="start against min and max, and whether it is a finite number",
    standard="FMI 2.0 section 2.2.7: min <= start <= max; inputs and parameters have a start",
    needs="file",
    unless=_unreadable,
)
def start_values(bench: Bench) -> Finding:
    """Hold the start values against the bounds that the same file gives."""
    wrong = []
    for v in bench.plan.about.variables.values():
        if v.start is None:
            if v.causality in ("input", "parameter"):
                wrong.append(f"{v.name} has none")
        elif not isinstance(v.start, str):
            low = -math.inf if v.minimum is None else v.minimum
            high = math.inf if v.maximum is None else v.maximum
            if not math.isfinite(v.start) or not low <= v.start <= high:
                wrong.append(f"{v.name} = {v.start} outside {low} .. {high}")
    if wrong:
        return failed(f"{len(wrong)} wrong: {some(wrong)}")
    return passed("all inside their bounds")


@Probe(
    "units",
    tried="which real inputs, outputs and parameters have a unit, and whether it is defined",
    standard="FMI 2.0 sections 2.2.2 and 2.2.7: a unit in use is defined in UnitDefinitions. "
    "Having one is optional; without it nobody can check a connection, so bristle's own FMUs have "
    "one, or say in the description which it is.",
    needs="file",
    unless=_unreadable,
)
def units(bench: Bench) -> Finding:
    """Find units that are used and not defined, and reals that have none."""
    defined = {u.get("name") for u in _root(bench).iterfind("UnitDefinitions/Unit")}
    ports = [v for v in bench.plan.about.variables.values() if v.kind == "Real"]
    unknown = sorted({v.unit for v in ports if v.unit is not None} - defined)
    if unknown:
        return failed(f"used and not defined: {some(unknown)}")
    plain = [v for v in ports if v.unit is None and v.causality != "local"]
    untold = [v.name for v in plain if not _UNIT_IN_WORDS.search(v.description)]
    if bench.plan.ours and untold:
        return failed(f"{len(untold)} reals have no unit: {some(untold)}", rule="bristle")
    if plain:
        names = some([v.name for v in plain])
        return noted(f"{len(plain)} of {len(ports)} reals have no unit: {names}")
    return passed(f"{len(defined)} units defined, none missing")


@Probe(
    "default experiment",
    tried="start, stop and step of the default experiment",
    standard="FMI 2.0 section 2.2.5: optional; where it is given, the stop lies after the start",
    needs="file",
)
def default_experiment(bench: Bench) -> Finding:
    """Ask for times that a run can use."""
    element = _root(bench).find("DefaultExperiment")
    if element is None:
        return noted(f"there is none; tried with a step of {bench.plan.step:g} s")
    try:
        start = float(element.get("startTime", "0"))
        stop = float(element.get("stopTime", "inf"))
        step = float(element.get("stepSize", "1"))
    except ValueError as error:
        raise UnexpectedError(f"a time is no number: {error}") from None
    if not (math.isfinite(start) and stop > start and 0.0 < step < math.inf):
        return failed(f"start {start:g}, stop {stop:g}, step {step:g} s make no run")
    given = ", ".join(f"{name} = {value}" for name, value in element.attrib.items())
    return passed(given or "given, but empty")
