"""Design a controller from a design file, verify it, and write a controller file and a figure.

NAME_answer.json contains the results with the curves of the figure.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.text import command
from ..view.blocks import Next
from ._options import Parser, print_answer

if TYPE_CHECKING:
    from ..synthesis import DesignResult

HELP = "design a controller and verify it"

_COMPONENTS = {"hinf": "HinfInverse or ClippedOptimal", "lpv": "Lpv", "lqg": "LqgClipped"}


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle design`."""
    parser.add_argument("kind", choices=tuple(_COMPONENTS), help="kind of controller")
    parser.add_argument("file", type=Path, metavar="FILE", help="design file, TOML")
    text = "controller file, with figure and answer beside it; else named after the design file"
    parser.add_out(text, "FILE.json")
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Design, verify, write controller file and picture; print what was found."""
    from ..errors import DesignError
    from ..synthesis import design, implausible, read_task

    out: Path = arguments.out or Path(arguments.file.stem + ".json")
    if out.suffix != ".json":
        raise DesignError(f"{out}: a controller file is named FILE.json.")
    task = read_task(arguments.file)
    if task.kind != arguments.kind:
        raise DesignError(
            f"{arguments.file}: kind = {task.kind!r}; `bristle design {task.kind}` is right for it."
        )
    warnings = implausible(task)
    for text in warnings:
        print(f"warning: {arguments.file}: {text}", file=sys.stderr, flush=True)
    result = design(task)
    answer = {**_answer(result), "warnings": warnings}
    written = _write(result, answer, out)
    answer["files"] = [str(path.absolute()) for path in written]
    component = _COMPONENTS[result.controller.kind].split()[0]
    bake = Next(command("build", component, "--controller", out), "bakes it in")
    print_answer(arguments, answer, result.view().then(bake), written)
    return 0


def _answer(result: DesignResult) -> dict[str, Any]:
    from ..synthesis.analysis import facts_of

    c = result.controller
    size = {"kind": c.kind, "title": c.title, "states": c.n, "rows": c.rows}
    answer = {**size, "sample_period": c.sample_period, "facts": result.facts}
    if result.plants:
        answer["margins"] = facts_of(result)
    return answer


def _write(result: DesignResult, answer: dict[str, Any], out: Path) -> list[Path]:
    """Write controller file, answer and picture beside the target, and rename them into place."""
    import json

    from ..core.files import writing
    from ..errors import DesignError
    from ..synthesis.analysis import curves

    with (
        writing(out, DesignError),
        tempfile.TemporaryDirectory(prefix=".bristle_", dir=out.absolute().parent) as folder,
    ):
        made = [Path(folder) / out.name]
        result.controller.save(made[0])
        made.append(made[0].with_name(f"{out.stem}_answer.json"))
        whole = {**answer, "curves": curves(result)}
        made[-1].write_text(json.dumps(whole, allow_nan=False), encoding="utf-8")
        if result.plants:
            from ..synthesis.view import draw_design

            made.append(made[0].with_suffix(".png"))
            draw_design(result, made[-1])
        return [path.replace(out.parent / path.name) for path in made]
