"""Compare any FMU with a measurement: how wrong its outputs are, and where.

The FMU's code runs on this machine, with your rights. z is the error divided by the noise floor.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ._options import Parser, channels_of, print_json

if TYPE_CHECKING:
    from ..prediction.compare_fmu import FmuComparison

HELP = "show where an FMU of any tool deviates from a measurement: text and figure"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle compare-fmu`."""
    parser.add_argument("fmu", type=Path, metavar="FILE.fmu", help="an FMU of any tool")
    parser.option("--data", "FILE", "the measurement", type=Path, required=True)
    text = "a parameter's or input's value, in the FMU's unit"
    parser.several("--set", "NAME=VALUE", text, dest="values")
    text = "the channel that feeds an input, or that an output is compared with"
    parser.several("--map", "PORT=CHANNEL@UNIT", text, dest="maps")
    parser.add_channel()
    parser.option("--timeout", "S", "time limit of the run in s", type=float, default=300.0)
    parser.add_out("file of the picture", "FILE")
    parser.add_details()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Run the FMU under the measured inputs; print what it errs by, draw the picture."""
    from ..comparison.view import draw_comparison
    from ..prediction.compare_fmu import compare_fmu
    from ..view import terminal

    found: FmuComparison = compare_fmu(
        arguments.fmu,
        arguments.data,
        values=_pairs(arguments.values, "--set"),
        maps=_pairs(arguments.maps, "--map"),
        channels=channels_of(arguments.channel),
        timeout=arguments.timeout,
    )
    picture = arguments.out or Path(f"{arguments.fmu.stem}_{arguments.data.stem}.png")
    worst = max(found.outputs, key=lambda one: one.z)
    draw_comparison(worst).save(picture, dpi=160)
    if arguments.json:
        print_json({**found.as_dict(), "picture": str(picture.absolute())})
        return 0
    for one in found.outputs:
        print(f"{one.quantity} [{one.unit}]")
        print(terminal.text(one.view(), details=arguments.details), end="\n\n")
    print("\n".join(found.mapping_lines()))
    print(f"Picture: {picture}")
    return 0


def _pairs(texts: list[str], option: str) -> dict[str, str]:
    from ..errors import StudyError

    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise StudyError(f'{option} "{text}": NAME=VALUE is right.')
        if name.strip() in found:
            raise StudyError(f"{option} {name.strip()} is given twice; once is right.")
        found[name.strip()] = value.strip()
    return found
