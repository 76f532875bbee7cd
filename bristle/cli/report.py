"""Write a study's report: one HTML file that a colleague can open offline."""

from __future__ import annotations

import argparse

from ._options import Parser, print_json

HELP = "write a study's report as one HTML file: verdict, history, loops, parameters, data"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle report`."""
    parser.add_study()
    text = "file of the report; else FOLDER/reports/report.html"
    parser.add_out(text, "FILE")
    parser.flag("--keep-test-closed", "leave the study's test runs closed")
    text = (
        "add sliders for the model's parameters; the page computes the run (needs bristle[native])"
    )
    parser.flag("--what-if", text)
    parser.add_trust()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Write the report; print where it is."""
    from ..core.files import write_whole
    from ..core.progress import tell
    from ..report.study_page import gather, render
    from ..study.study import Study
    from ..study.view import steps_table
    from ..view import terminal

    study = Study(arguments.folder)
    content = gather(study, open_test=not arguments.keep_test_closed, what_if=arguments.what_if)
    tell("drawing")
    page = render(content)
    if arguments.out is None:
        file = study.write_report("report.html", page)
    else:
        file = arguments.out
        write_whole(file, page)
    if arguments.json:
        answer = {
            "report": str(file.absolute()),
            "z_holdout": content.now.z if content.now else None,
            "z_test": content.test.z if content.test else None,
            "verdict": (content.verdict or {}).get("kind"),
            "trouble": content.trouble or None,
        }
        print_json(answer)
        return 0
    print("\n".join(terminal.lines(steps_table(content.history_steps))))
    if content.trouble:
        print(f"The model could not be compared: {content.trouble}")
    print(f"\nReport: {file}")
    return 0
