"""Pages of components, effects, laws, commands, the API and the rule, made from the code.

As a hook of mkdocs it hands the pages over in memory; `python docs/generate.py FOLDER` writes them
as files.
"""

from __future__ import annotations

import os
import sys
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from commands import command_page
from component_pages import component_index, component_page
from effect_pages import effect_index, effect_page, law_index, law_page, picture_of
from reference import api_page

from benchmarks._calibrate.page import every_field
from bristle.fmu import catalogue
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import laws_of

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

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
    made |= {"components/index.md": component_index(), "effects/index.md": effect_index()}
    for name in catalogue.component_names():
        made[f"components/{name}.md"] = component_page(name)
    for name in sorted(EFFECTS):
        made[f"effects/{name}.md"] = effect_page(name)
    made["laws/index.md"] = law_index()
    for law in laws_of("damper"):
        made[f"laws/{law.name}.md"] = law_page(law)
    made["cli.md"] = command_page()
    made["rule_fields.md"] = rule_page()
    return made


def rule_page() -> str:
    """Return the page of every number that decides a verdict, from the rule's own text."""
    return (
        "# All fields of the decision rule\n\nWhat each number of "
        "`bristle.diagnosis.rule.DecisionRule` decides, what it trades, and how its value was "
        "found ([how to measure that](decision_rule.md)). Values after a name are those of that "
        f"instance.\n\n{every_field()}\n"
    )


def images() -> dict[str, bytes]:
    """Return the pictures of the effects' pages by their path below docs/."""
    made = {name: picture_of(name) for name in sorted(EFFECTS)}
    return {f"effects/{name}.png": found[0] for name, found in made.items() if found}


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
    from bristle.errors import BuildError
    from bristle.export.web import export_web
    from bristle.view.html import page

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
