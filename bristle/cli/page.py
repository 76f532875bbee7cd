"""Open a local page for a study, or for a folder of studies: data, fit, diagnosis, simulation.

The page listens only on 127.0.0.1 and needs the printed address. It runs the commands that it
shows; their results are in the study's folder. Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ._options import Parser

HELP = "open a local page in the browser: data, fit, diagnosis, and simulation with sliders"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle page`."""
    text = "a study, or a folder of studies; else the current folder"
    parser.add_argument("folder", nargs="?", type=Path, default=Path(), metavar="FOLDER", help=text)
    parser.option("--port", "N", "port of the server; else a free one", type=int, default=0)
    parser.flag("--no-browser", "print the address; open nothing")


def main(arguments: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    from ..core.progress import tell
    from ..page.app import App, open_browser, serve

    def ready(address: str) -> None:
        tell("")
        print(f"{address}\nCtrl-C ends the page.", flush=True)
        if not arguments.no_browser:
            open_browser(address)

    serve(App(arguments.folder), arguments.port, ready)
    return 0
