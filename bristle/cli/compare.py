"""Compare a study's model with runs that it was not fitted to: how wrong it is, and where."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ..core.text import command
from ..view.blocks import Next, Text
from ._options import Parser, print_study_answer

if TYPE_CHECKING:
    from ..study.study import Study

HELP = "show where a study's model deviates from measurements: text and figure"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle compare`."""
    parser.epilog = (
        "z is the error divided by the noise floor, the error of a true model: 1 is the best that "
        "the data can confirm."
    )
    parser.add_study()
    add_role(parser)
    parser.add_out("file of the picture", "FILE")
    parser.add_trust()
    parser.add_details()
    parser.add_json()


def add_role(parser: Parser) -> None:
    """Add --role, the runs of a study that a model is held against."""
    text = (
        "runs of the study: held-out runs, training runs, or the test runs (the study counts "
        "each use)"
    )
    parser.add_argument(
        "--role", choices=("holdout", "train", "test"), default="holdout", help=text
    )


def main(arguments: argparse.Namespace) -> int:
    """Compare, print the sentences and tables, draw the picture."""
    from ..comparison.view import draw_comparison
    from ..core.progress import tell
    from ..study.steps import compare_study
    from ..study.study import Study
    from ..view.style import png

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
    answer = {
        **comparison.as_dict(), "role": arguments.role, **_opened(study), "notes": list(notes),
        "picture": str(picture.absolute()),
    }  # fmt: skip
    then = Next(command("diagnose", study.folder), "finds what is missing")
    view = comparison.view().then(*(Text(note, "note") for note in notes), then)
    print_study_answer(arguments, answer, view, picture)
    return 0


def _opened(study: Study) -> dict[str, Any]:
    """Return when the test runs were opened, nothing where the study has none."""

    from ..study.steps import uses_of_test_set
    from ..study.study_file import TEST

    opened = [{"date": one.date, "step": one.step} for one in uses_of_test_set(study)]
    return {"test_openings": opened} if study.files(TEST) else {}
