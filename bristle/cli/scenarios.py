"""List the stock scenarios with their files, or copy one to edit.

bristle scenarios copy NAME writes NAME.toml into the current folder.
"""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "list the stock scenarios, or copy one to edit"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle scenarios`."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "action",
        nargs="?",
        choices=("copy",),
        help="copy a scenario; without it, list the scenarios",
    )
    parser.add_argument("name", nargs="?", metavar="NAME", help="with copy: a stock scenario")
    text = "with copy: the file that is written; else NAME.toml in the current folder"
    parser.add_argument("file", nargs="?", type=Path, metavar="FILE", help=text)
    parser.add_argument("--json", action="store_true", help="print as JSON")


def main(arguments: argparse.Namespace) -> int:
    """List the scenarios, or copy one."""
    from ..errors import ScenarioError

    if arguments.action is None:
        from .list_ import main as list_them

        return list_them(argparse.Namespace(
            topic="scenarios", name=None, building=None, json=arguments.json
        ))  # fmt: skip
    if arguments.name is None:
        raise ScenarioError("bristle scenarios copy NAME is right; bristle scenarios lists names.")
    from ..scenario.stock import copy_scenario

    file = copy_scenario(arguments.name, arguments.file)
    if arguments.json:
        import json

        print(json.dumps({"file": str(file.absolute())}))
    else:
        print(f"{file}: a copy to edit. Change it, then:  bristle check {file}  and  "
              f"bristle run {file}")  # fmt: skip
    return 0
