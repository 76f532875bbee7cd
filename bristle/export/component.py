"""FMU: a whole scenario, its parts solved together by the coupled engine's step."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from string import Formatter
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from pythonfmu import DefaultExperiment

from bristle.export import composite_functions as whole
from bristle.export.composite import Assembly
from bristle.fmu.component import STEP_LENGTH, ComponentSlave, Played


class Composite(ComponentSlave):
    """A whole scenario as one component."""

    icon: ClassVar[str] = "scenario"
    functions: ClassVar[Any] = whole
    in_place: ClassVar[bool] = True

    def declare(self) -> None:
        """Declare inputs, then the outputs of all parts, then their parameters."""
        given = self.baked
        self.assembly = Assembly(Path(given["scenario"]), given["overrides"], given["inputs"])
        scenario = self.assembly.scenario
        self.description = scenario.title
        self.default_experiment = DefaultExperiment(
            start_time=0.0, stop_time=scenario.stop, step_size=scenario.step
        )
        for one in self.assembly.inputs:
            self._declare_input(one)
        for part, slave in self.assembly.parts.items():
            for index in slave._outputs:
                self._declare_output(part, slave, slave.vars[index])
        for part in self.assembly.parts:
            text = f"0, or the fault at which {part} stopped"
            self.add_output(f"{part}.fault", None, text)
        for part, slave in self.assembly.parts.items():
            for index in sorted(slave._parameters):
                self._declare_parameter(part, slave, index)
        self.texts = self._texts()  # type: ignore[misc]

    def _declare_input(self, one: Any) -> None:
        slave = self.assembly.parts[one.part]
        text = slave.vars[slave._index[one.port]].description
        self.add_input(
            one.name, slave._units.get(one.port, ""), text, start=slave[one.port],
            over_step=self.assembly.over_step(one), optional=one.optional,
        )  # fmt: skip

    def _declare_output(self, part: str, slave: Any, variable: Any) -> None:
        name = variable.name
        low, high, nominal = slave._bounds.get(name, (None, None, None))
        self.changes = slave.changes  # type: ignore[misc]
        self.add_output(
            f"{part}.{name}", slave._units.get(name, ""), variable.description,
            depends=self.assembly.followed(part, name), bounds=(low, high), nominal=nominal,
        )  # fmt: skip

    def _declare_parameter(self, part: str, slave: Any, index: int) -> None:
        name = slave.vars[index].name
        if f"{part}.{name}" in self._index:
            return  # an input stands for it
        low, high, _ = slave._bounds.get(name, (None, None, None))
        self.add_parameter(
            f"{part}.{name}", self.assembly.start_value(part, name), slave._units.get(name),
            slave.vars[index].description, (low, high), slave._words.get(index, ()),
        )  # fmt: skip

    def _texts(self) -> dict[int, str]:
        """Return what the codes of all parts mean, each beginning with the part."""
        found = {whole.TOO_LONG: "a step of {step_length:g} s holds too many substeps."}
        for k, (part, slave) in enumerate(self.assembly.parts.items()):
            for code, text in slave.texts.items():
                found[whole.coded(code, k)] = f"{part}: {_named_for(part, text)}"
            if self.assembly.kind(part) == whole.DAMPER:
                found[whole.coded(whole.UNSETTLED, k)] = (
                    f"{part}: force and motion do not agree. A shorter step or parameters within "
                    "their bounds would be right."
                )
        return found

    def part_of(self, code: int) -> str:
        """Return the output with the fault of the part that a code is about."""
        k = -code // whole.PER_PART - 1
        parts = list(self.assembly.parts)
        return f"{parts[k]}.fault" if code < 0 <= k < len(parts) else ""

    def bake(self) -> list[float]:
        """Return what the build fixes."""
        return self.assembly.bake()

    def flat_functions(self) -> Any:
        """Return the functions, fitted to the laws and effects of the parts."""
        return whole.fitted(self.assembly.system).all_of(whole)

    def played(self) -> list[Played]:
        """Return from what the signals of all sources are read."""
        return self.assembly.played()

    def bundled(self) -> list[str]:
        """Return the names of the files that sources play."""
        return list(self.assembly.files)

    def configure(self) -> None:
        """Check nothing: the parts have done so when they were put together."""

    def refresh(self) -> None:
        """Compute nothing: it runs compiled."""

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Return the description; names with a hyphen are none of the structured kind."""
        root: Element = super().to_xml(model_options)  # type: ignore[arg-type]
        if not all(part.isidentifier() for part in self.assembly.parts):
            root.set("variableNamingConvention", "flat")
        return root

    def _structure(self, structure: Element) -> None:
        """Say that first samples follow what is measured."""
        super()._structure(structure)
        for node in structure.iterfind("InitialUnknowns/Unknown"):
            part, _, port = self.vars[int(node.attrib["index"]) - 1].name.partition(".")
            if port and port != "fault":
                inputs = self.assembly.followed(part, port, initial=True)
                known = {self._index[name] + 1 for name in inputs}
                known |= {int(one) for one in node.attrib["dependencies"].split()}
                node.set("dependencies", " ".join(map(str, sorted(known))))


def _named_for(part: str, text: str) -> str:
    """Return a text whose values are those of a part's parameters."""
    pieces = []
    for before, name, form, conversion in Formatter().parse(text):
        pieces.append(before.replace("{", "{{").replace("}", "}}"))
        if name is not None:
            full = name if name == STEP_LENGTH else f"{part}.{name}"
            shown = (f"!{conversion}" if conversion else "") + (f":{form}" if form else "")
            pieces.append("{" + full + shown + "}")
    return "".join(pieces)
