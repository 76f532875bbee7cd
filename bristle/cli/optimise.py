"""Find the best constant voltage of a scenario for a set of ground motions."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._options import Parser, print_answer

if TYPE_CHECKING:
    from ..campaign.best_constant import Passive

HELP = "find the best constant voltage for a set of ground motions"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle optimise`."""
    parser.add_argument("what", choices=("passive",), help="quantity to optimise")
    _add_problem(parser)
    text = "folder of passive.csv, .json and .png; else results/optimise/"
    parser.option("--out", "FOLDER", text, type=Path, default=Path("results", "optimise"))
    parser.add_no_figure()
    parser.add_trust()
    parser.add_json()


def _add_problem(parser: Parser) -> None:
    """Add what is optimised: scenario, ground motions, the output and its statistic."""
    text = "scenario with a GroundMotion and a ConstantVoltage; else El Centro with a LuGre damper"
    parser.option("--scenario", "FILE", text, default="el_centro_0p6g_constant_voltage")
    text = "names of ground motions, or files; see `bristle list records`"
    parser.option("--motions", "RECORD", text, nargs="+", default=["el_centro_1940_ns"])
    text = "peaks [g] to which each motion is scaled, 0: as recorded; else 0.2 0.4 0.6 0.8"
    parser.option("--intensities", "G", text, nargs="+", type=float)
    parser.add_judged()
    parser.option("--grid", "N", "number of voltages in the grid; else 17", type=int, default=17)
    parser.add_overrides("scenario", "damper.sigma_a=600")


def main(arguments: argparse.Namespace) -> int:
    """Optimise, write table and figure, print what was found."""
    from ..campaign.best_constant import INTENSITIES, ScaledMotion, optimise_passive
    from ..errors import ScenarioError
    from ..system.overrides import parse_overrides

    intensities = arguments.intensities or INTENSITIES
    for intensity in intensities:
        if not 0.0 <= intensity < 1e3:
            raise ScenarioError(f"--intensities {intensity:g}: a peak in g, 0 or more, is right.")
    found = optimise_passive(
        [ScaledMotion(record, i) for record in arguments.motions for i in intensities],
        scenario=arguments.scenario,
        overrides=parse_overrides(arguments.overrides),
        output=arguments.output,
        statistic=arguments.statistic,
        grid=arguments.grid,
        progress=True,
    )
    files = _write(found, arguments.out, not arguments.no_figure)
    named = {name: str(path.absolute()) for name, path in files.items()}
    print_answer(arguments, {**_answer(found), **named}, found.view(), files.values())
    return 0


def _write(found: Passive, folder: Path, figure: bool) -> dict[str, Path]:
    import pandas as pd

    from ..core.files import write_json, writing
    from ..errors import not_usable

    table = pd.DataFrame(found.values.T, columns=[motion.name for motion in found.motions])
    table.insert(0, "voltage [V]", found.grid)
    files = {"table": folder / "passive.csv", "answer": folder / "passive.json"}
    with writing(folder, not_usable):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "passive.png").unlink(missing_ok=True)  # that of an older optimum
        table.to_csv(files["table"], index=False, float_format="%.9g")
        write_json(files["answer"], {"schema": 1, **_answer(found)})
    if figure:
        from ..campaign.view import draw_passive

        files["figure"] = folder / "passive.png"
        draw_passive(found).save(files["figure"], dpi=160)
    return files


def _answer(found: Passive) -> dict[str, Any]:
    motions = [
        {"record": m.record, "intensity": m.intensity, "voltage": b.voltage, "value": b.value}
        for m, b in zip(found.motions, found.best, strict=True)
    ]
    return {
        "output": found.output,
        "statistic": found.statistic,
        "unit": found.unit,
        "motions": motions,
        "set": {goal: vars(optimum) for goal, optimum in found.goals.items()},
        "runs": found.runs,
        "notes": list(found.notes),
    }
