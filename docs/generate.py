"""Pages of components, effects, laws, commands and the API, made from the code.

As a hook of mkdocs it hands the pages over in memory; `python docs/generate.py FOLDER` writes them
as files.
"""

from __future__ import annotations

import os
import re
import sys
import textwrap
from functools import cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from commands import command_page
from pictures import picture
from reference import api_page
from tables import table as _table

from bristle.cli.effects import tell
from bristle.data.equation import formulas
from bristle.draw.mathml import formula_html
from bristle.fmu import catalogue
from bristle.physics import effects as _registered  # noqa: F401  (importing registers them)
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import DEFAULT, LAWS, Law, law_names, laws_of

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

    from bristle.fmu.description import Description, Variable

SECTIONS = ("components", "effects", "laws")

LIVE: dict[str, tuple[str, dict[str, tuple[float, float]]]] = {
    "live": (
        "el_centro_lugre_passive",
        {
            "ground.factor": (0.0, 1.0), "voltage.level": (0.0, 8.0),
            "damper.sigma_a": (100.0, 2000.0), "damper.sigma_2": (0.0, 300.0),
            "damper.v_n": (0.005, 0.08),
        },
    ),
    "live_damper": (
        "bench_sine_lugre",
        {
            "voltage.level": (0.0, 8.0), "rod.amplitude": (0.001, 0.012),
            "rod.frequency": (0.5, 4.0), "damper.sigma_a": (100.0, 2000.0),
            "damper.sigma_2": (0.0, 300.0), "damper.v_n": (0.005, 0.08),
            "damper.a_0": (100.0, 3000.0),
        },
    ),
}  # fmt: skip
"""Scenarios that a reader moves, with their sliders, by the folder of the page that runs them."""


def pages() -> dict[str, str]:
    """Return every generated page by its path below docs/."""
    made = {"api.md": api_page()}
    made |= {"components/index.md": _component_index(), "effects/index.md": _effect_index()}
    for name in catalogue.component_names():
        made[f"components/{name}.md"] = component_page(name)
    for name in sorted(EFFECTS):
        made[f"effects/{name}.md"] = effect_page(name)
    made["laws/index.md"] = _law_index()
    for law in laws_of("damper"):
        made[f"laws/{law.name}.md"] = law_page(law)
    made["cli.md"] = command_page()
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


def law_page(law: type[Law]) -> str:
    """Return the page of a damper's law: formula, parameters, the effects that join it, source."""
    parts = [f"# {law.name}", _formula(law.__doc__ or "")]
    rows = [
        [f"`{key}`", f"{p.value:g}", _unit(p.unit), _span(*p.bounds), p.text]
        for key, p in law.parameters.items()
    ]
    parts += ["## Parameters", _table(["name", "value", "unit", "bounds", "meaning"], rows)]
    if law.states:
        states = ", ".join(f"`{key}` [{unit}]" for key, unit in law.states.items())
        parts.append(f"State: {states}.")
    if law.variants:
        names = ", ".join(f"`{law.name}_{suffix}`" for suffix in law.variants)
        parts.append(f"Variants: {names}.")
    joining = [name for name in sorted(EFFECTS) if law.name in tell(EFFECTS[name])["laws"]]
    links = ", ".join(f"[{name}](../effects/{name}.md)" for name in joining)
    parts += ["## Effects that join it", f"{links}."]
    parts += ["## Source", f"{law.source}."]
    parts += ["## Use it", f"In a study: `bristle identify STUDY --law {law.name}`."]
    return "\n\n".join(parts) + "\n"


def _law_index() -> str:
    rows = [
        [
            f"[{law.name}]({law.name}.md)",
            (law.__doc__ or "").strip().splitlines()[0].split(": f")[0],
        ]
        for law in laws_of("damper")
    ]
    variants = ", ".join(f"`{name}`" for name in law_names() if name not in LAWS)
    return (
        "# Laws\n\nThe base models of a damper, each in one file. Effects join them. "
        f"A study begins with `{DEFAULT}` unless you say another one.\n\n"
        + _table(["law", "what it is"], rows)
        + f"\n\nVariants: {variants}.\n"
    )


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
    """Return a docstring's text as Markdown, its formulas set by the browser (MathML)."""
    first, _, rest = text.strip("\n").partition("\n")
    if first.startswith(" "):  # an effect's text, which begins with its formula
        first, rest = "", text.strip("\n")
    lines = [first, *textwrap.dedent(rest).splitlines()]
    about, _, formula = first.partition(": ")
    if "=" in formula:
        set_ = [formula_html(one) for one in formulas(first)]
        lines[:1] = [f"{about}:", "", *set_, ""]
    block = [k for k, line in enumerate(lines) if line.startswith("    ")]
    if block and any("=" in lines[k] for k in block):
        told = [piece for k in block for piece in _pieces(lines[k].strip())]
        lines[block[0] : block[-1] + 1] = told
    return "\n".join(lines).strip("\n")


def _pieces(line: str) -> list[str]:
    """Return the formulas of a line of a docstring set, and the prose between them, a line each."""
    return [
        f"{formula_html(one)}\n" if "=" in one else f"{one}\n"
        for one in re.split(r"[,;]\s{2,}", line)
    ]


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
    _fill(config.nav or [], list(pages()))
    return config


def on_post_build(config: MkDocsConfig) -> None:
    """Put the pages of scenarios that a reader moves beside the others (a hook of mkdocs).

    With DOCS_WITHOUT_LIVE in the environment nothing is compiled for them.
    """
    from bristle.draw.html import page
    from bristle.errors import BuildError
    from bristle.web.export import export_web

    for name, (scenario, sliders) in LIVE.items():
        folder = Path(config.site_dir) / name
        try:
            if os.environ.get("DOCS_WITHOUT_LIVE"):
                raise BuildError("DOCS_WITHOUT_LIVE is set.")
            export_web(scenario, folder, sliders)
        except BuildError as error:
            folder.mkdir(parents=True, exist_ok=True)
            text = f"<p>Not made with this copy of the documentation: {escape(str(error))}</p>"
            (folder / "index.html").write_text(page("Not made", [text], ""), encoding="utf-8")


def _fill(entries: list[dict[str, Any]], made: list[str]) -> None:
    """Put the generated pages of a section in its place, at any depth of the navigation."""
    for entry in entries:
        for title, target in list(entry.items()):
            if isinstance(target, list):
                _fill(target, made)
            elif (section := str(target).rstrip("/")) in SECTIONS:
                entry[title] = [path for path in made if path.startswith(f"{section}/")]


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("python docs/generate.py FOLDER   writes the generated pages into FOLDER")
    for page, content in {**pages(), **images()}.items():
        file = Path(sys.argv[1], page)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        print(file)
