"""Design a controller from a design file, verify it, and write a controller file and a figure.

NAME_answer.json contains the results with the curves of the figure.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..findings import command

if TYPE_CHECKING:
    from ..design import DesignResult

HELP = "design a controller and verify it"

_COMPONENTS = {"hinf": "HinfInverse or ClippedOptimal", "lpv": "Lpv", "lqg": "LqgClipped"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle design`."""
    parser.add_argument("kind", choices=tuple(_COMPONENTS), help="kind of controller")
    parser.add_argument("file", type=Path, metavar="FILE", help="design file, TOML")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE.json",
        help="controller file, with figure and answer beside it; else named after the design file",
    )
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Design, verify, write controller file and picture; print what was found."""
    from ..design import design, implausible, read_task
    from ..errors import DesignError

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
    answer["files"] = [str(path.absolute()) for path in _write(result, answer, out)]
    if arguments.json:
        import json

        print(json.dumps(answer, indent=2, allow_nan=False))
    else:
        _print(answer, out)
    return 0


def _answer(result: DesignResult) -> dict[str, Any]:
    from ..design.margins import facts_of

    c = result.controller
    size = {"kind": c.kind, "title": c.title, "states": c.n, "rows": c.rows}
    answer = {**size, "sample_period": c.sample_period, "facts": result.facts}
    if result.plants:
        answer["margins"] = facts_of(result)
    return answer


def _write(result: DesignResult, answer: dict[str, Any], out: Path) -> list[Path]:
    """Write controller file, answer and picture beside the target, and rename them into place."""
    import json

    from ..design.responses import curves
    from ..errors import DesignError

    try:
        with tempfile.TemporaryDirectory(prefix=".bristle_", dir=out.absolute().parent) as folder:
            made = [Path(folder) / out.name]
            result.controller.save(made[0])
            made.append(made[0].with_name(f"{out.stem}_answer.json"))
            whole = {**answer, "curves": curves(result)}
            made[-1].write_text(json.dumps(whole, allow_nan=False), encoding="utf-8")
            if result.plants:
                from ..design.picture import draw_design

                made.append(made[0].with_suffix(".png"))
                draw_design(result, made[-1])
            return [path.replace(out.parent / path.name) for path in made]
    except OSError as error:
        raise DesignError(f"{out}: cannot be written ({error.strerror or error}).") from error


def _print(answer: dict[str, Any], out: Path) -> None:
    facts = answer["facts"]
    rows = f", a table of {answer['rows']} speeds" if answer["rows"] > 1 else ""
    print(f"{answer['kind']}: {answer['states']} states{rows}, sampled at "
          f"{answer['sample_period']:g} s")  # fmt: skip
    if "norm" in facts:
        print(f"  gamma {facts['gamma']:.5g} (no controller below {facts['least_gamma']:.5g}), "
              f"solver: {facts['solver']}")  # fmt: skip
        print(f"  closed-loop norm, recomputed: {facts['norm']:.5g} "
              f"(without control {facts['open_loop_norm']:.5g})")  # fmt: skip
    elif "gamma" in facts:
        _print_table(facts)
    _print_poles(facts)
    if "margins" in answer:
        print("  margins at the measurement: " + _margins(answer["margins"]))
    for path in answer["files"]:
        print(f"  {path}")
    component = _COMPONENTS[answer["kind"]].split()[0]
    print(f"Bake it in:  {command('build', component, '--controller', out)}")


def _print_table(facts: dict[str, Any]) -> None:
    print(f"  gamma {facts['gamma']:.5g}, proved at the grid points; solver: {facts['solver']}")
    print("  closed-loop norm, recomputed at constant speed:")
    for speed, norm, open_loop in zip(
        facts["grid"], facts["norms"], facts["open_loop_norms"], strict=True
    ):
        print(f"    {speed:6g} m/s  {norm:8.5g}  (without control {open_loop:.5g})")
    print(f"    largest between them: {facts['largest_row_norm']:.5g} at "
          f"{facts['largest_row_norm_at']:g} m/s")  # fmt: skip
    print(f"  LMI between grid points: holds at {100 * facts['share_proved']:.0f} % of the rows; "
          f"largest eigenvalue {facts['largest_eigenvalue']:.3g} at "
          f"{facts['largest_eigenvalue_at']:g} m/s (below 0: proved)")  # fmt: skip


def _print_poles(facts: dict[str, Any]) -> None:
    poles = facts["poles"]
    if poles and isinstance(poles[0][0], list):  # one list per grid speed
        print(f"  poles: real parts up to {facts['largest_real_part']:.4g} 1/s, sizes up to "
              f"{facts['fastest_pole']:.4g} rad/s, over all rows")  # fmt: skip
    else:
        listed = [f"{a:.4g}" + (f" ± {b:.4g}j" if b else "") for a, b in poles if b >= 0.0]
        print(f"  poles [rad/s]: {', '.join(listed)}")
    print(f"  sampled closed loop: largest pole of modulus {facts['sampled_loop_modulus']:.6f}")


def _margins(found: dict[str, Any]) -> str:
    up, down, phase = (found[key] for key in ("gain_up", "gain_down", "phase"))
    texts = [f"distance from -1 {found['modulus']:.3g}"]
    texts.append(f"gain times {up:.3g}" if up is not None else "any larger gain")
    texts.append(f"gain times {down:.3g}" if down is not None else "any smaller gain")
    texts.append(f"phase {phase:.3g} deg" if phase is not None else "any phase")
    return ", ".join(texts)
