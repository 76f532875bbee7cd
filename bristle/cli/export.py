"""Write a study's present model as an FMU, with a scenario; a scenario as one FMU or a web page.

The FMU contains the study's values. `--native --as-one` writes a scenario of built-in components as
one FMU, which solves its parts together like the engine `compiled`. `--web` writes a scenario, or
that of a study, as a WebAssembly module, a loader and a page with sliders that needs no server.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.text import command, joined
from ..errors import ScenarioError, StudyError
from ._options import Parser, builder, print_answer, print_json

HELP = "write a study's model as an FMU; or a scenario as one FMU, or as a web page"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle export`."""
    text = (
        "the study; with --as-one a scenario file, or the name of a scenario; with --web a study, "
        "a scenario, or the name of a component"
    )
    parser.add_argument("what", metavar="FOLDER", help=text)
    text = "output folder; else export/ in the study, with --as-one the current folder"
    parser.add_out(text)
    parser.flag("--as-one", "write the whole scenario as one FMU, with --native")
    text = (
        "a port, or a parameter of a source, that becomes an input, with --as-one: --input "
        "structure.ground_acceleration"
    )
    parser.several("--input", "PART.PORT", text, dest="inputs")
    text = "write the scenario as a WebAssembly module with a page that computes it"
    parser.option("--web", "DIR", text, type=Path)
    text = "a parameter with a slider, with --web: --slider voltage.level=0..8"
    parser.several("--slider", "NAME[=A..B]", text)
    parser.add_overrides()
    parser.add_native()
    parser.add_trust()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Export; say what was written, and what was left out."""
    if arguments.web is not None:
        _refuse_for_fmus(arguments)
        return _web(arguments)
    if arguments.slider:
        raise StudyError("--slider belongs to --web, which writes a page with sliders.")
    if arguments.as_one:
        return _as_one(arguments)
    if arguments.overrides or arguments.inputs:
        raise StudyError(
            "--set and --input are for a scenario: with --native --as-one it becomes one FMU. A "
            "study has its values in its model."
        )
    from ..prediction.export import export_study
    from ..study.study import Study

    found = export_study(Study(Path(arguments.what)), arguments.out, builder(arguments))
    answer = {
        "fmu": str(found.fmu.absolute()),
        "scenario": str(found.scenario.absolute()),
        "files": [str(file.absolute()) for file in found.files],
        "run": found.run,
        "notes": list(found.notes),
        "proof": found.proof and found.proof.as_dict(),
    }
    print_answer(arguments, answer, found.view())
    return 0


def _refuse_for_fmus(arguments: argparse.Namespace) -> None:
    """Refuse options of FMUs beside --web, which would do nothing."""
    given = {
        "--as-one": arguments.as_one, "--input": arguments.inputs, "--native": arguments.native,
        "--platform": arguments.platforms, "--sources": arguments.sources,
        "--fmi": arguments.fmi != 2,
    }  # fmt: skip
    named = [option for option, is_given in given.items() if is_given]
    if named:
        verb = "is" if len(named) == 1 else "are"
        raise ScenarioError(f"{joined(named)} {verb} for an FMU, --web is for a page.")


def _as_one(arguments: argparse.Namespace) -> int:
    """Write a scenario as one FMU; say what it has."""
    from ..export.composite import export_composite
    from ..fmu.description import read_description
    from ..system.overrides import parse_overrides

    if not arguments.native:
        raise ScenarioError("--as-one goes with --native: the parts are solved by compiled code.")
    path = export_composite(
        arguments.what, arguments.out or Path(), builder(arguments),
        parse_overrides(arguments.overrides), arguments.inputs,
    )  # fmt: skip
    about = read_description(path, any_platform=True)
    inputs = [f"{v.name} [{v.unit}]" if v.unit else v.name for v in about.of("input")]
    counts = {one: len(about.of(one)) for one in ("output", "parameter")}
    if arguments.json:
        answer = {"file": str(path.absolute()), "guid": about.guid}
        named = {"inputs": [v.name for v in about.of("input")], **counts}
        print_json({**answer, **named})
        return 0
    print(f"{path}: built, guid {about.guid}")
    print(f"  inputs: {', '.join(inputs) or 'none'}")
    print(f"  {counts['output']} outputs, {counts['parameter']} parameters:  ", end="")
    print(command("list", "ports", path))
    return 0


def _web(arguments: argparse.Namespace) -> int:
    """Write a scenario or study as a web page, or a component as a module; print the files."""
    from ..export.web import export_component, export_web
    from ..fmu.catalogue import component_names
    from ..report.study_page import movable
    from ..study.study import Study
    from ..system.overrides import parse_overrides

    if arguments.out is not None:
        raise ScenarioError("--out is for a study; --web DIR says where the page goes.")
    sliders = _sliders(arguments.slider)
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
        print_json({"files": [str(file.absolute()) for file in files]})
        return 0
    for file in files:
        print(f"{file}  {file.stat().st_size / 1e3:.0f} kB")
    if files[0].suffix == ".html":
        print(f"Open {files[0]} in a browser.")
    return 0


def _sliders(texts: list[str]) -> dict[str, tuple[float | None, float | None]]:
    """Return sliders by name; ScenarioError where one is given twice."""
    found: dict[str, tuple[float | None, float | None]] = {}
    for text in texts:
        name, ends = _slider(text)
        if name in found:
            raise ScenarioError(f"--slider {name} is given twice; once is right.")
        found[name] = ends
    return found


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
