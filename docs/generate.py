"""Pages of components, effects and the API, made from the code.

As a hook of mkdocs it hands the pages over in memory; `python docs/generate.py FOLDER` writes them
as files.
"""

from __future__ import annotations

import sys
import textwrap
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from pictures import picture
from reference import api_page

from bristle.cli.effects import tell
from bristle.fmu import catalogue
from bristle.physics import effects as _registered  # noqa: F401  (importing registers them)
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

    from bristle.fmu.description import Description, Variable

SECTIONS = ("components", "effects")


def pages() -> dict[str, str]:
    """Return every generated page by its path below docs/."""
    made = {"api.md": api_page()}
    made |= {"components/index.md": _component_index(), "effects/index.md": _effect_index()}
    for name in catalogue.component_names():
        made[f"components/{name}.md"] = component_page(name)
    for name in sorted(EFFECTS):
        made[f"effects/{name}.md"] = effect_page(name)
    return made


@cache
def picture_of(name: str) -> tuple[bytes, str, float] | None:
    """Return an effect's picture, its caption and width [in], drawn once."""
    return picture(name)


def images() -> dict[str, bytes]:
    """Return the pictures of the effects' pages by their path below docs/."""
    made = {name: picture_of(name) for name in sorted(EFFECTS)}
    return {f"effects/{name}.png": found[0] for name, found in made.items() if found}


def component_page(name: str) -> str:
    """Return the page of a component: its ports and parameters with units."""
    described = catalogue.describe(name)
    law = getattr(catalogue.component_class(catalogue.source(name)), "law", "")
    parts = [f"# {name}", described.description]
    if law:
        parts.append(_formula(LAWS[law].__doc__ or ""))
        parts.append("Equations, sources and what is reconstructed: [Physics](../physics.md).")
    if name == "Structure":
        parts.append(
            "These are the ports of the default building. Another one has a level per mass: `base` "
            "where it is isolated, then `floor1`, `floor2` ... ([Buildings](../buildings.md))."
        )
    parts += ["## Inputs", _inputs(described), "## Outputs", _outputs(described)]
    parts += ["## Parameters", _parameters(described), *_of_effects(described)]
    return "\n\n".join(parts) + "\n"


def effect_page(name: str) -> str:
    """Return the page of an effect: formula, parameters, what its absence looks like, source."""
    effect = EFFECTS[name]
    told = tell(effect)
    site = {"damper": "a damper", "sensor": "a sensor"}.get(effect.site, f"the {effect.site}")
    laws = f" Joins the laws {' and '.join(told['laws'])}." if told["laws"] else ""
    parts = [f"# {name}", told["about"], _formula(told["text"])]
    if shown := picture_of(name):
        wide = round(95 * shown[2])
        image = f'![Force with and without {name}]({name}.png){{ width="{wide}" }}'
        parts.append(f"{image}\n\n*{shown[1]}*")
    parts.append(f"An effect of {site}.{laws} {_properties(told)}")
    parts += ["## Parameters", _table(["name", "value", "unit", "bounds", "meaning"], [
        [f"`{name}.{key}`", f"{p['value']:g}", _unit(p["unit"]), _span(*p["bounds"]), p["text"]]
        for key, p in told["parameters"].items()
    ])]  # fmt: skip
    if len(told["states"]) > 8:
        parts.append(f"State: {len(told['states'])} values, a ring among them.")
    elif told["states"]:
        states = ", ".join(f"`{name}.{key}` [{unit}]" for key, unit in told["states"].items())
        parts.append(f"State: {states}.")
    parts += ["## When it is missing", f"{told['expect'][0].upper()}{told['expect'][1:]}."]
    parts += ["## Source", f"{told['source']}."]
    parts += _use_of(name, effect.site, told)
    return "\n\n".join(part for part in parts if part) + "\n"


def _use_of(name: str, site: str, told: dict[str, Any]) -> list[str]:
    """Return how an effect is switched on; a sensor's is part of a study's model alone."""
    first = next(iter(told["parameters"]))
    value = told["parameters"][first]["value"]
    if site == "sensor":
        return [
            "## Use it",
            "In a study, beside the damper's own effects: `bristle add STUDY "
            f"{name}`. It acts on the {EFFECTS[name].shows} channel of the measurement; no "
            "exported damper carries it.",
        ]
    text = f'[components.{site}]\nparameters = {{ "{name}.on" = true, "{name}.{first}" = {value} }}'
    return [
        "## Switch it on",
        "In a scenario:",
        textwrap.indent(text, "    "),
        "or on the command line: "
        f"`bristle run el_centro_lugre_passive --set {site}.{name}.on=true`.",
    ]


def _properties(told: dict[str, Any]) -> str:
    words = [
        "It never gives energy to the motion."
        if told["passive"]
        else "It can give energy to the motion."
        if told["site"] != "sensor"
        else "It changes what is shown, not the motion.",
        "It exerts a force at rest too."
        if not told["zero_at_rest"]
        else "At rest and without history it exerts no force."
        if told["site"] != "sensor"
        else "",
    ]
    if told["excludes"]:
        words.append(f"Not together with {', '.join(told['excludes'])}.")
    return " ".join(word for word in words if word)


def _component_index() -> str:
    rows = [
        [f"[{name}]({name}.md)", catalogue.describe(name).description]
        for name in catalogue.component_names()
    ]
    return (
        "# Components\n\nThe FMUs that come with bristle; `bristle list components` prints the "
        "same. Each is built on first use, stands alone, and has an Integer output `fault` "
        "([its codes](../elsewhere.md#faults)).\n\n" + _table(["component", "what it is"], rows)
    )


def _effect_index() -> str:
    rows = [
        [f"[{name}]({name}.md)", effect.site, effect.first_line(), effect.expect]
        for name, effect in sorted(EFFECTS.items())
    ]
    return (
        "# Effects\n\nPhysics beyond the base laws, each in one file and switched on by a "
        "parameter; `bristle effects` prints the same. [Write your own](../own_effect.md).\n\n"
        + _table(["effect", "site", "what it does", "when it is missing"], rows)
    )


def _inputs(described: Description) -> str:
    rows = [
        [f"`{v.name}`", _unit(v.unit), v.description + (" (optional)" if v.optional else "")]
        for v in described.of("input")
    ]
    return _table(["name", "unit", "meaning"], rows) if rows else "None."


def _outputs(described: Description) -> str:
    rows = [
        [f"`{v.name}`", _unit(v.unit), v.description, _named(v.dependencies or ())]
        for v in described.of("output")
    ]
    return _table(["name", "unit", "meaning", "follows at once"], rows)


def _parameters(described: Description) -> str:
    own = [v for v in described.of("parameter") if "." not in v.name]
    rows = [
        [f"`{v.name}`", _value(v), _unit(v.unit), _span(v.minimum, v.maximum), v.description]
        for v in own
    ]
    return _table(["name", "value", "unit", "bounds", "meaning"], rows) if rows else "None."


def _of_effects(described: Description) -> list[str]:
    """Return the section on the effects of a component, nothing where it has none."""
    switches = [v.name[:-3] for v in described.of("parameter") if v.name.endswith(".on")]
    if not switches:
        return []
    links = ", ".join(f"[{name}](../effects/{name}.md)" for name in switches)
    text = "Each has a switch `EFFECT.on` and parameters `EFFECT.PARAMETER`, off by default:"
    return ["## Effects", f"{text} {links}."]


def _formula(text: str) -> str:
    """Return a docstring's text as Markdown, its formula an indented block."""
    first, _, rest = text.strip("\n").partition("\n")
    if first.startswith(" "):  # an effect's text, which begins with its formula
        return text.strip("\n")
    return f"{first}\n{textwrap.dedent(rest)}".strip("\n")


def _named(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _value(variable: Variable) -> str:
    start = variable.start
    if isinstance(start, bool) or not isinstance(start, float):
        return f"`{start}`" if start not in ("", None) else ""
    return f"{start:g}"


def _unit(unit: str | None) -> str:
    return f"`{unit}`" if unit else ""


def _span(low: float | None, high: float | None) -> str:
    return "" if low is None or high is None else f"{low:g} to {high:g}"


def _table(titles: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table."""
    lines = [titles, ["---"] * len(titles), *rows]
    cells = [[cell.replace("|", "\\|") for cell in row] for row in lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in cells)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages (a hook of mkdocs)."""
    from mkdocs.structure.files import File

    for path, content in {**pages(), **images()}.items():
        known = files.get_file_from_path(path)
        if known is not None:  # written earlier by the command
            files.remove(known)
        files.append(File.generated(config, path, content=content))
    return files


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Fill the sections of the generated pages in the navigation (a hook of mkdocs)."""
    made = pages()
    for entry in config.nav or []:
        for title, target in list(entry.items()):
            section = str(target).rstrip("/")
            if section in SECTIONS:
                entry[title] = [path for path in made if path.startswith(f"{section}/")]
    return config


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("python docs/generate.py FOLDER   writes the generated pages into FOLDER")
    for page, content in {**pages(), **images()}.items():
        file = Path(sys.argv[1], page)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        print(file)
