"""Open a local page on a study, or on a folder of studies: look, fit, diagnose, simulate.

The page listens on 127.0.0.1 alone and needs the address that is printed here. What it does it does
by the commands that it shows; what they did is in the study's folder. Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "a local page: look at data, watch the error fall, move a slider and see the building answer"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle page`."""
    parser.add_argument(
        "folder", nargs="?", type=Path, default=Path(), metavar="FOLDER",
        help="a study, or a folder for studies; else the present one",
    )  # fmt: skip
    parser.add_argument("--port", type=int, default=0, metavar="N", help="else a free one")
    parser.add_argument("--no-browser", action="store_true", help="print the address; open nothing")


def main(arguments: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    from ..page.app import App
    from ..page.run import open_browser, serve
    from ..progress import tell

    def ready(address: str) -> None:
        tell("")
        print(f"{address}\nCtrl-C ends the page.", flush=True)
        if not arguments.no_browser:
            open_browser(address)

    serve(App(arguments.folder), arguments.port, ready)
    return 0
