"""Draw the figures of Shirazi et al. (2012) from stock scenarios, with their numbers as CSV."""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "draw the paper's figures, each with its numbers as CSV"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle figures`."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="a figure, or all; else a list")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("results", "figures"),
        metavar="FOLDER",
        help="folder of NAME.png and NAME.csv; older ones are replaced; else results/figures/",
    )
    parser.add_argument(
        "--engine",
        choices=("compiled", "fmu"),
        default="compiled",
        help="solve built-in components together (compiled), or step FMUs (fmu)",
    )
    parser.add_argument(
        "--format", choices=("png", "svg", "pdf"), default="png", help="of the images"
    )
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """List the figures, or draw one of them or all."""
    from ..paper.figures import find_figure, make, paper_figures

    if arguments.name is None:
        _list(arguments.json)
        return 0
    names = list(paper_figures()) if arguments.name == "all" else [arguments.name]
    written = {}
    for name in names:
        find_figure(name)
        files = make(
            name,
            arguments.out,
            engine=arguments.engine,
            format=arguments.format,
            progress=True,
        )
        written[name] = [str(file.absolute()) for file in files]
        if not arguments.json:
            print(f"{name}: {paper_figures()[name].about}")
            for file in files:
                print(f"  {file}")
    if arguments.json:
        import json

        print(json.dumps({"engine": arguments.engine, "written": written}, indent=2))
    return 0


def _list(as_json: bool) -> None:
    from ..paper.figures import paper_figures

    figures = paper_figures().values()
    if as_json:
        import json

        rows = [{"name": f.name, "paper": f.number, "about": f.about} for f in figures]
        print(json.dumps(rows, indent=2))
        return
    for figure in figures:
        print(f"{figure.name:16}  {figure.number:9}  {figure.about}")
    print("Draw one with  bristle figures NAME , all of them with  bristle figures all .")
