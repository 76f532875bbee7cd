"""Compare a study's model with held-out runs, or any FMU with a measurement."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..findings import command
from ..view.blocks import Block, Next, Text
from ._closed_loop import (
    add_closed_loop,
    closed_loop_of,
    print_closed_loop,
    refuse_alone,
)
from ._common import add_details
from ._consent import add_trust
from ._files import channels_of

if TYPE_CHECKING:
    from ..bridge.fmu import FmuComparison
    from ..compare.comparison import Comparison
    from ..study.study import Study

HELP = "show where a model, or any FMU, deviates from measurements: text and figures"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle compare`."""
    parser.epilog = (
        "z is the error divided by the noise floor, the error of a true model: 1 is the best that "
        "the data can confirm. With --fmu the FMU's code runs on this machine, with your rights."
    )
    parser.add_argument("folder", nargs="?", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument(
        "--role",
        choices=("holdout", "train", "test"),
        default="holdout",
        help="runs of the study: held-out runs, training runs, or the test runs (the study counts "
        "each use)",
    )
    # The name until 0.1; here for one release.
    parser.add_argument(
        "--runs", dest="role", choices=("holdout", "train"), default=argparse.SUPPRESS,
        help=argparse.SUPPRESS,
    )  # fmt: skip
    _add_fmu(parser)
    add_closed_loop(parser)
    parser.add_argument("--out", type=Path, metavar="FILE", help="file of the picture")
    add_trust(parser)
    add_details(parser)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def _add_fmu(parser: argparse.ArgumentParser) -> None:
    """Add what goes with an FMU."""
    parser.add_argument("--fmu", type=Path, metavar="FILE.fmu", help="an FMU of any tool")
    parser.add_argument(
        "--data", type=Path, metavar="FILE", help="with --fmu or --in: the measurement"
    )
    parser.add_argument(
        "--set",
        dest="values",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="with --fmu: a parameter's or input's value, in the FMU's unit",
    )
    parser.add_argument(
        "--map",
        dest="maps",
        action="append",
        default=[],
        metavar="PORT=CHANNEL@UNIT",
        help="with --fmu: the channel that feeds an input, or that an output is compared with",
    )
    parser.add_argument(
        "--channel",
        action="append",
        default=[],
        metavar="CHANNEL=COLUMN@UNIT",
        help="with --fmu: the column of a channel in the file, instead of the guess",
    )
    parser.add_argument(
        "--timeout",
        type=float,
        default=300.0,
        metavar="S",
        help="with --fmu: time limit of the run in s",
    )


def main(arguments: argparse.Namespace) -> int:
    """Compare, print the sentences and tables, draw the picture."""
    from ..errors import StudyError

    refuse_alone(arguments)
    if arguments.fmu is not None:
        if arguments.folder is not None or arguments.data is None:
            raise StudyError(
                "--fmu goes with --data and without a study: bristle compare --fmu FILE.fmu "
                "--data run.csv"
            )
        return _of_fmu(arguments)
    options = ("values", "maps", "channel") if arguments.house else (
        "data", "values", "maps", "channel"
    )  # fmt: skip
    fmu_only = [f"--{n}" for n in options if getattr(arguments, n)]
    if arguments.folder is None or fmu_only:
        wrong = "a study's folder, or --fmu and --data, are needed"
        if fmu_only:
            wrong = f"{fmu_only[0].replace('values', 'set').replace('maps', 'map')} needs --fmu"
        raise StudyError(
            f"{wrong}: bristle compare FOLDER, or bristle compare --fmu FILE.fmu --data run.csv"
        )
    return _in_closed_loop(arguments) if arguments.closed_loop else _of_study(arguments)


def _in_closed_loop(arguments: argparse.Namespace) -> int:
    found = closed_loop_of(arguments)
    if arguments.json:
        _print_json(found.as_dict())
    else:
        print_closed_loop(found)
    return 0


def _of_study(arguments: argparse.Namespace) -> int:
    from ..compare.view import draw_comparison
    from ..draw.style import png
    from ..progress import tell
    from ..study.comparison import compare_study
    from ..study.study import Study

    study = Study(arguments.folder)
    comparison = compare_study(study, role=arguments.role)
    tell("drawing")
    page = draw_comparison(comparison)
    if arguments.out is None:
        picture = study.write_report("compare.png", png(page))
    else:
        picture = arguments.out
        page.save(picture, dpi=160)
    notes = study.runs().notes
    if arguments.json:
        _print_json(
            {
                **comparison.as_dict(), "role": arguments.role, **_opened(study),
                "notes": list(notes), "picture": str(picture.absolute()),
            }
        )  # fmt: skip
        return 0
    then = Next(command("diagnose", study.folder), "finds what is missing")
    blocks: tuple[Block, ...] = (*(Text(note, "note") for note in notes), then)
    elsewhere = command("report", study.folder)
    print(_text(comparison, arguments.details, blocks, elsewhere))
    print(f"Picture: {picture}")
    return 0


def _opened(study: Study) -> dict[str, Any]:
    """Return when the test runs were opened, nothing where the study has none."""
    from dataclasses import asdict

    from ..study.openings import openings
    from ..study.run_file import TEST

    opened = [asdict(one) for one in openings(study)]
    return {"test_openings": opened} if study.files(TEST) else {}


def _of_fmu(arguments: argparse.Namespace) -> int:
    from ..bridge.fmu import compare_fmu
    from ..compare.view import draw_comparison

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
        _print_json({**found.as_dict(), "picture": str(picture.absolute())})
        return 0
    print("\n".join(found.mapping_lines()))
    for one in found.outputs:
        print(f"\n{one.quantity} [{one.unit}]")
        print(_text(one, arguments.details))
    print(f"\nPicture: {picture}")
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


def _print_json(answer: dict[str, Any]) -> None:
    import json

    print(json.dumps(_finite(answer), indent=2, ensure_ascii=False))


def _finite(value: Any) -> Any:
    """Return a value as JSON has it: what is not finite is null."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return value


def _text(
    comparison: Comparison, details: bool, more: tuple[Block, ...] = (), elsewhere: str = ""
) -> str:
    """Return a comparison as text, with more blocks below its answer."""
    from ..view import terminal

    view = comparison.view()
    view = view._replace(blocks=(*view.blocks, *more))
    return terminal.text(view, details=details, elsewhere=elsewhere)
