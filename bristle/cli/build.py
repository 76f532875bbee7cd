"""Build an FMU of a component, with another building, a record or a controller inside."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.text import command
from ._options import Parser, builder, print_json

if TYPE_CHECKING:
    from ..fmu.build import BuildPlan
    from ..fmu.description import Description

HELP = "build a component into an FMU"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle build`."""
    text = (
        "a name of `bristle list components`, or the Python file of your own component (this runs "
        "it)"
    )
    parser.add_argument("component", metavar="COMPONENT", help=text)
    parser.option("--building", "FILE", "building file, for a Structure", type=Path)
    text = "ground motion (PEER AT2, CSV or a name), for a GroundMotion"
    parser.option("--record", "FILE", text, type=Path)
    text = "controller file of `bristle design`, for a controller of its kind"
    parser.option("--controller", "FILE", text, type=Path)
    text = "file with your own effect, for a damper or a Structure; may be repeated"
    parser.several("--effect", "FILE", text, dest="effects", type=Path)
    text = "effects that are in the FMU and on: gas_spring,coil_lag; all: every one, off; else none"
    parser.option("--effects", "NAMES", text, dest="offers", default="")
    parser.add_argument("--name", help="name of the model and its file; else the component's")
    text = "folder of NAME.fmu; an older one is replaced; else the current folder"
    parser.add_out(text)
    parser.add_native()
    parser.add_trust()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Build one FMU, unless the same stands there already; say where it is and what it offers."""
    from ..errors import BuildError
    from ..fmu.build import built_guid, plan
    from ..fmu.component import SWITCH
    from ..fmu.description import read_description

    names = [name.strip() for name in arguments.offers.split(",") if name.strip()]
    every = names == ["all"]
    what = plan(
        arguments.component,
        name=arguments.name,
        building=arguments.building,
        record=arguments.record,
        controller=arguments.controller,
        effects=arguments.effects,
        offers=None if every else names,
        starts={} if every else {name + SWITCH: True for name in names},
    )
    target = (arguments.out or Path()) / f"{what.name}.fmu"
    if target.parent.suffix.lower() == ".fmu":
        raise BuildError(f"--out {arguments.out}: a folder is right; --name names the FMU in it.")
    fresh = not arguments.native and built_guid(target) == what.guid()
    make = builder(arguments)
    if not fresh:
        _build(make, what, target)
    description = read_description(target, any_platform=True)
    if arguments.json:
        answer = {"file": str(target.absolute()), "built": not fresh, **_port_counts(description)}
        print_json(answer)
    else:
        _print(target, description, fresh)
    return 0


def _build(make: Callable[[BuildPlan, Path], Path], what: BuildPlan, target: Path) -> None:
    """Build beside the target and rename into place, so that nothing else is left there."""
    from ..errors import BuildError

    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise BuildError(f"{target}: is a folder; --name or --out elsewhere is right.")
        with tempfile.TemporaryDirectory(prefix=".bristle_", dir=target.parent) as folder:
            make(what, Path(folder)).replace(target)
    except (FileExistsError, NotADirectoryError):
        raise BuildError(f"{target.parent}: is a file; an FMU goes into a folder.") from None
    except OSError as error:
        raise BuildError(f"{target}: cannot be written: {error.strerror or error}.") from error


def _port_counts(description: Description) -> dict[str, Any]:
    ports = {
        kind: [{"name": v.name, "unit": v.unit} for v in description.of(causality)]
        for kind, causality in (("inputs", "input"), ("outputs", "output"))
    }
    about = {"name": description.name, "guid": description.guid}
    return {**about, **ports, "parameters": len(description.of("parameter"))}


def _print(target: Path, description: Description, fresh: bool) -> None:
    print(f"{target}: {'up to date' if fresh else 'built'}, guid {description.guid}")
    for causality in ("input", "output"):
        ports = [f"{v.name} [{v.unit}]" if v.unit else v.name for v in description.of(causality)]
        if ports:
            print(f"  {causality}s: {', '.join(ports)}")
    print(f"  {len(description.of('parameter'))} parameters:  {command('list', 'ports', target)}")
    print(f'In a scenario: fmu = "{target.name}", a path relative to the scenario\'s file.')
