"""Pages of the components, made from their descriptions: ports and parameters with units."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tables import formula, span, table, unit

from bristle.fmu import catalogue
from bristle.physics.laws import LAWS

if TYPE_CHECKING:
    from bristle.fmu.description import Description, Variable


def component_page(name: str) -> str:
    """Return the page of a component: its ports and parameters with units."""
    described = catalogue.describe(name)
    law = getattr(catalogue.component_class(catalogue.source(name)), "law", "")
    parts = [f"# {name}", described.description]
    if law:
        parts.append(formula(LAWS[law].__doc__ or ""))
        parts.append("Equations, sources and what is reconstructed: [Physics](../physics.md).")
    if name == "Structure":
        parts.append(
            "These are the ports of the default building. Another one has a level per mass: `base` "
            "where it is isolated, then `floor1`, `floor2` ... "
            "([another building](../simulate.md#another-building))."
        )
    parts += ["## Inputs", _inputs(described), "## Outputs", _outputs(described)]
    parts += ["## Parameters", _parameters(described), *_of_effects(described)]
    return "\n\n".join(parts) + "\n"


def component_index() -> str:
    """Return the page that lists the components."""
    rows = [
        [f"[{name}]({name}.md)", catalogue.describe(name).description]
        for name in catalogue.component_names()
    ]
    return (
        "# Components\n\nThe FMUs that come with bristle; `bristle list components` prints the "
        "same. Each is built on first use, is self-contained, and has an Integer output `fault` "
        "([its codes](../elsewhere.md#faults)).\n\n" + table(["component", "what it is"], rows)
    )


def _inputs(described: Description) -> str:
    rows = [
        [f"`{v.name}`", unit(v.unit), v.description + (" (optional)" if v.optional else "")]
        for v in described.of("input")
    ]
    return table(["name", "unit", "meaning"], rows) if rows else "None."


def _outputs(described: Description) -> str:
    rows = [
        [f"`{v.name}`", unit(v.unit), v.description, _named(v.dependencies or ())]
        for v in described.of("output")
    ]
    return table(["name", "unit", "meaning", "follows at once"], rows)


def _parameters(described: Description) -> str:
    own = [v for v in described.of("parameter") if "." not in v.name]
    rows = [
        [f"`{v.name}`", _value(v), unit(v.unit), span(v.minimum, v.maximum), v.description]
        for v in own
    ]
    return table(["name", "value", "unit", "bounds", "meaning"], rows) if rows else "None."


def _of_effects(described: Description) -> list[str]:
    """Return the section on the effects of a component, nothing where it has none."""
    switches = [v.name[:-3] for v in described.of("parameter") if v.name.endswith(".on")]
    if not switches:
        return []
    links = ", ".join(f"[{name}](../effects/{name}.md)" for name in switches)
    text = "Each has a switch `EFFECT.on` and parameters `EFFECT.PARAMETER`, off by default:"
    return ["## Effects", f"{text} {links}."]


def _named(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _value(variable: Variable) -> str:
    start = variable.start
    if isinstance(start, bool) or not isinstance(start, float):
        return f"`{start}`" if start not in ("", None) else ""
    return f"{start:g}"
