"""The description of a native FMU in FMI 2.0 or 3.0, and its declarations as C data."""

from __future__ import annotations

from math import inf, isfinite
from string import Formatter
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ..component import HELD
from ..errors import BuildError
from ..fmu.component import STEP_LENGTH, ComponentSlave, Played, SampleFile
from ..fmu.description import NATIVE
from ..fmu.model_description import type_definitions, unit_definitions
from ..version import __version__

_CAPABILITIES = {
    "needsExecutionTool": False,
    "canHandleVariableCommunicationStepSize": True,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
}


def description(slave: ComponentSlave, guid: str) -> str:
    """Return the model description of a component that runs without Python.

    Parameters
    ----------
    slave : ComponentSlave
        The component as a Python object, its parameters at their start values.
    guid : str
        Of the FMU.
    """
    return text_of(description_tree(slave, guid))


def description_tree(slave: ComponentSlave, guid: str) -> Element:
    """Return the XML tree of that description; the parameters are as in `description`."""
    options: dict[str, Any] = {**_CAPABILITIES, "canInterpolateInputs": bool(slave._inputs)}
    root: Element = slave.to_xml(options)
    root.set("guid", guid)
    root.set("generationTool", f"{NATIVE} {__version__}")
    return root


def text_of(root: Element) -> str:
    """Return an XML tree as the text of a file."""
    indent(root)
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text.decode()


# modelDescription.xml of a native FMU of FMI 3.0, made from that of FMI 2.0.
#
# What FMI 3.0 says otherwise: a variable is an element named by its type; the model structure names
# value references instead of places; an annotation has a type instead of a tool; there is one
# independent variable, the time.

TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}
"""What FMI 3.0 calls the types of FMI 2.0."""

_ROOT = (
    "modelName", "description", "author", "version", "copyright", "license", "generationTool",
    "generationDateAndTime", "variableNamingConvention",
)  # fmt: skip
_CAPABILITIES_FMI3 = (
    "modelIdentifier", "needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess",
    "canGetAndSetFMUstate", "canSerializeFMUstate", "canHandleVariableCommunicationStepSize",
)  # fmt: skip
"""Attributes of FMI 2.0 that FMI 3.0 has too, the state with a capital letter."""


def description_fmi3(slave: ComponentSlave, guid: str) -> str:
    """Return the model description, in FMI 3.0, of a component that runs without Python.

    Parameters
    ----------
    slave, guid
        As in `description.description`; the guid is the instantiation token.
    """
    old = description_tree(slave, guid)
    root = Element("fmiModelDescription", fmiVersion="3.0", instantiationToken=guid)
    root.attrib.update({key: old.attrib[key] for key in _ROOT if key in old.attrib})
    has = _part(old, "CoSimulation").attrib
    kept = {key: has[key] for key in _CAPABILITIES_FMI3 if key in has}
    capabilities = {key.replace("FMUstate", "FMUState"): value for key, value in kept.items()}
    SubElement(root, "CoSimulation", capabilities)
    names = [*slave._units.values(), "s"]
    root.append(unit_definitions(names))
    root.append(type_definitions(names, "Float64Type"))
    root.append(_log_categories(_part(old, "LogCategories")))
    root.append(_part(old, "DefaultExperiment"))
    variables = SubElement(root, "ModelVariables")
    variables.extend([_variable(node) for node in _part(old, "ModelVariables")])
    variables.append(_time(variables))
    root.append(_structure(old))
    optional = old.find("VendorAnnotations")
    if optional is not None:
        root.append(_annotations(optional))
    return text_of(root)


def _part(root: Element, tag: str) -> Element:
    found = root.find(tag)
    assert found is not None  # pythonfmu writes them all
    return found


def _log_categories(old: Element) -> Element:
    new = Element("LogCategories")
    for node in old:
        text = node.attrib["description"].replace("fmi2", "fmi3")
        SubElement(new, "Category", name=node.attrib["name"], description=text)
    return new


def _variable(old: Element) -> Element:
    """Return a variable as FMI 3.0 has it: annotations come first, a text's start is an element."""
    value = old[0]
    new = Element(TYPES[value.tag], {**old.attrib, **value.attrib})
    annotations = old.find("Annotations")
    if annotations is not None:
        new.append(_annotations(annotations))
    if value.tag == "String" and "start" in value.attrib:
        SubElement(new, "Start", value=new.attrib.pop("start"))
    return new


def _annotations(old: Element) -> Element:
    new = Element("Annotations")
    for tool in old:
        SubElement(new, "Annotation", type=tool.attrib["name"]).extend(list(tool))
    return new


def _time(variables: Element) -> Element:
    """Return the independent variable; its value reference is the one behind all others."""
    names, name = {node.attrib["name"] for node in variables}, "time"
    while name in names:
        name += "_"
    return Element(
        "Float64", name=name, valueReference=str(len(variables)), description="simulated time",
        causality="independent", variability="continuous", unit="s",
    )  # fmt: skip


def _structure(old: Element) -> Element:
    """Return outputs and initial unknowns, by value reference instead of by place from 1."""
    references = [node.attrib["valueReference"] for node in _part(old, "ModelVariables")]
    new, structure = Element("ModelStructure"), _part(old, "ModelStructure")
    for group, tag in (("Outputs", "Output"), ("InitialUnknowns", "InitialUnknown")):
        for node in structure.iterfind(f"{group}/Unknown"):
            known = " ".join(references[int(k) - 1] for k in node.attrib["dependencies"].split())
            reference = references[int(node.attrib["index"]) - 1]
            SubElement(new, tag, valueReference=reference, dependencies=known)
    return new


# What a component declares, as the C data that the shim reads: see shim/component.h.

_FORMATS = {("", None): "r", ("", "r"): "r", ("", "s"): "s", ("g", None): "g"}

_TABLES = """\
#include "component.h"

{words}static const Variable variables[] = {{
{variables}
}};

{pieces}static const Meaning meanings[] = {{
{meanings}    {{0, 0, -1, 0}},
}};

static const Signal signals[] = {{
{signals}    {{{{-1, -1, ""}}, {{-1, -1, ""}}, 0}},
}};

static const char *const bundled[] = {{{bundled}0}};

static const double baked[] = {{
{baked}
}};

const Component component = {{
    .name = {name},
    .guid = {guid},
    .variables = variables,
    .count = {count},
    .fault = {fault},
    .inputs_at = {inputs_at},
    .inputs = {inputs},
    .outputs_at = {outputs_at},
    .outputs = {outputs},
    .meanings = meanings,
    .baked = baked,
    .baked_size = {baked_size},
    .in_place = {in_place},
    .discretises = {discretises},
    .signals = signals,
    .played = {played},
    .bundled = bundled,
}};
"""


def tables(slave: ComponentSlave, guid: str) -> str:
    """Return the C source of a component's tables.

    Parameters
    ----------
    slave : ComponentSlave
        The component as a Python object, its parameters at their start values.
    guid : str
        Of the FMU.

    Raises
    ------
    BuildError
        If its ports do not lie as the shim takes them, or a text shows a value as C cannot.
    """
    baked = slave.bake()
    names = {variable.name: index for index, variable in slave.vars.items()}
    words, variables = [], []
    for index in slave.vars:
        listed = _words(slave, index)
        if listed:
            words.append(f"static const char *const words_{index}[] = {{{listed}, 0}};\n")
        variables.append(_variable_row(slave, index, bool(listed)))
    pieces, meanings = [], []
    for k, (code, text) in enumerate(sorted(slave.texts.items())):
        pieces.append(f"static const Piece pieces_{k}[] = {{\n{_pieces(text, names)}\n}};\n\n")
        first = slave.warns_first.get(code, 0)
        part = names.get(slave.part_of(code), -1)
        meanings.append(f"    {{{code}, {first}, {part}, pieces_{k}}},\n")
    inputs_at, inputs = _span(slave, slave._inputs)
    outputs_at, outputs = _span(slave, slave._outputs)
    return _TABLES.format(
        words="".join(words) + "\n" if words else "",
        variables="\n".join(variables),
        pieces="".join(pieces),
        meanings="".join(meanings),
        baked="\n".join(f"    {number(value)}," for value in [*baked, 0.0]),
        name=quoted(str(slave.modelName)),
        guid=quoted(guid),
        count=len(slave.vars),
        fault=names["fault"],
        inputs_at=inputs_at,
        inputs=inputs,
        outputs_at=outputs_at,
        outputs=outputs,
        baked_size=len(baked),
        signals="".join(_signal(one, names) for one in slave.played()),
        played=len(slave.played()),
        bundled="".join(f"{quoted(one)}, " for one in slave.bundled()),
        discretises=int(hasattr(slave.flat_functions(), "discretise")),
        in_place=int(slave.in_place),
    )


def _variable_row(slave: ComponentSlave, index: int, has_words: bool) -> str:
    variable, value = slave.vars[index], slave._values[index]
    kind = type(variable).__name__.upper()
    low, high, _ = slave._bounds.get(variable.name, (None, None, None))
    if variable.causality.name != "parameter" or isinstance(value, bool):
        low = high = None
    fields = [
        quoted(variable.name), kind, variable.causality.name.upper(),
        "0.0" if kind == "STRING" else number(float(value)),
        quoted(value) if kind == "STRING" else "0",
        number(-inf if low is None else low), number(inf if high is None else high),
        quoted(f"[{low!r}, {high!r}]"),
        f"words_{index}" if has_words else "0",
        str(int(slave._over_step.get(variable.name) == HELD)),
        str(int(index in slave._set)),
    ]  # fmt: skip
    return f"    {{{', '.join(fields)}}},"


def _words(slave: ComponentSlave, index: int) -> str:
    """Return the words that a String chooses from, as C has them; "" where it is any text."""
    return ", ".join(quoted(word) for word in slave._words.get(index, ()))


def _signal(one: Played, names: dict[str, int]) -> str:
    """Return from what the samples of a signal are read."""
    choices = f"{_choice(one.file, names)}, {_choice(one.pairs, names)}"
    return f"    {{{choices}, {quoted(one.header)}}},\n"


def _choice(reading: SampleFile | None, names: dict[str, int]) -> str:
    """Return from which String a signal is read, and where another one has which word."""
    if reading is None:
        return '{-1, -1, ""}'
    chooser = names[reading.chooser] if reading.chooser else -1
    return f"{{{names[reading.parameter]}, {chooser}, {quoted(reading.word)}}}"


def _pieces(text: str, names: dict[str, int]) -> str:
    """Return a text with values in braces as pieces of words, each with the value behind it."""
    lines = []
    for before, name, form, conversion in Formatter().parse(text):
        place, letter = "NO_VALUE", "r"
        if name is not None:
            if name != STEP_LENGTH and name not in names:
                raise BuildError(f"the text {text!r} names {name!r}, which is no variable.")
            if (form, conversion) not in _FORMATS:
                raise BuildError(f"the text {text!r} shows {name!r} in a way that C cannot.")
            place = "STEP_LENGTH" if name == STEP_LENGTH else str(names[name])
            letter = _FORMATS[form or "", conversion]
        lines.append(f"    {{{quoted(before)}, {place}, '{letter}'}},")
    return "\n".join([*lines, "    {0, NO_VALUE, 0},"])


def _span(slave: ComponentSlave, indices: list[int]) -> tuple[int, int]:
    """Return begin and number of variables, which must be neighbours."""
    if indices and indices != list(range(indices[0], indices[0] + len(indices))):
        raise BuildError(f"{slave.modelName}: inputs, and Real outputs, must follow each other.")
    return (indices[0] if indices else 0), len(indices)


def number(value: float) -> str:
    """Return a number as C reads it, to the last bit."""
    if not isfinite(value):
        return "-__builtin_inf()" if value < 0 else "__builtin_inf()"
    return float(value).hex()


def quoted(text: str) -> str:
    """Return a text as C reads it, in UTF-8."""
    return f'"{"".join(map(_byte, text.encode("utf-8")))}"'


def _byte(byte: int) -> str:
    plain = 32 <= byte < 127 and chr(byte) not in '"\\?'
    return chr(byte) if plain else f"\\{byte:03o}"
