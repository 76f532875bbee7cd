"""Write a study's present model as an FMU and a scenario that uses it; a scenario as a web page.

A study's values are baked into the FMU. `--web` writes a scenario of built-in components, or that
of a study, as a WebAssembly module, a loader and a page with sliders, which needs no server.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import ScenarioError, StudyError
from ..findings import command
from ._common import add_overrides
from ._consent import add_trust
from ._native import add_native, builder

HELP = "write a study's model as an FMU; or a scenario, or a study, as a web page"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle export`."""
    text = "the study; with --web also a scenario file, or the name of a scenario or component"
    parser.add_argument("what", metavar="FOLDER", help=text)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where to write; else export/ in the study"
    )
    text = "write the scenario as a WebAssembly module with a page that computes it"
    parser.add_argument("--web", type=Path, metavar="DIR", help=text)
    text = "a number that the page moves, with --web: --slider voltage.level=0..8"
    parser.add_argument("--slider", action="append", default=[], metavar="NAME[=A..B]", help=text)
    add_overrides(parser)
    add_native(parser)
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Export; say what was written, and what was left out."""
    if arguments.web is not None:
        return _web(arguments)
    if arguments.slider or arguments.overrides:
        raise StudyError("--slider and --set belong to --web, which writes a page with sliders.")
    from ..bridge.export import export_study
    from ..study.study import Study

    found = export_study(Study(Path(arguments.what)), arguments.out, builder(arguments))
    if arguments.json:
        import json

        answer = {
            "fmu": str(found.fmu.absolute()),
            "scenario": str(found.scenario.absolute()),
            "files": [str(file.absolute()) for file in found.files],
            "run": found.run,
            "notes": list(found.notes),
        }
        print(json.dumps(answer, indent=2))
        return 0
    print(f"{found.fmu}: the damper with the model's values.")
    print(f"{found.scenario}: applies the motion of {found.run} to it.")
    print(f"Run it:  {command('run', found.scenario)}")
    for note in found.notes:
        print(f"{note[:1].upper()}{note[1:]}")
    return 0


def _web(arguments: argparse.Namespace) -> int:
    """Write a scenario or study as a web page, or a component as a module; print the files."""
    from ..fmu.catalogue import component_names
    from ..report.what_if import movable
    from ..scenario.scenario import parse_overrides
    from ..study.study import Study
    from ..web.component import export_component
    from ..web.export import export_web

    if arguments.out is not None:
        raise ScenarioError("--out is for a study; --web DIR says where the page goes.")
    sliders = dict(_slider(text) for text in arguments.slider)
    if arguments.what in component_names():
        if sliders or arguments.overrides:
            raise ScenarioError("--slider and --set are for a scenario; a component has no page.")
        files = export_component(arguments.what, arguments.web)
    elif (Path(arguments.what) / "study.toml").is_file():
        with movable(Study(Path(arguments.what))) as found:
            overrides = parse_overrides(arguments.overrides)
            files = export_web(found.scenario, arguments.web, sliders, overrides, found.shown)
    else:
        files = export_web(
            arguments.what, arguments.web, sliders, parse_overrides(arguments.overrides)
        )
    if arguments.json:
        import json

        print(json.dumps({"files": [str(file.absolute()) for file in files]}, indent=2))
        return 0
    for file in files:
        print(f"{file}  {file.stat().st_size / 1e3:.0f} kB")
    if files[0].suffix == ".html":
        print(f"Open {files[0]} in a browser.")
    return 0


def _slider(text: str) -> tuple[str, tuple[float | None, float | None]]:
    """Return name and ends of a slider as it is written."""
    name, _, ends = text.partition("=")
    if not ends:
        return name, (None, None)
    try:
        low, high = (float(end) for end in ends.split(".."))
    except ValueError:
        raise ScenarioError(
            f"--slider {text}: NAME=LOW..HIGH is right, as voltage.level=0..8."
        ) from None
    return name, (low, high)
