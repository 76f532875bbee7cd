"""Draws the picture of the first page from a study in which `bristle study auto` found something.

    bristle example bench my_rig && bristle study auto my_rig
    python docs/first_picture.py my_rig hidden_effect.png

Everything in it is read from the study: the runs, the models before and after the last step that
added an effect, the verdict that led to it, and the errors of all steps.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bristle.comparison.predictions import RunPrediction
from bristle.core.text import plain, short_z
from bristle.physics import effects as _registered  # noqa: F401  (importing registers them)
from bristle.physics.effect import EFFECTS
from bristle.study.history import Step
from bristle.study.steps import comparer
from bristle.study.study import Study
from bristle.view.style import BLUE, FLOOR, GREEN, GREY, INK, VERMILION, Page, look

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COMMANDS = ("example bench my_rig", "study auto my_rig")
RUN = "holdout_2"
SECONDS = (0.9, 5.0)
"""The part of the run that is drawn: one swell of the sine."""


def draw(folder: Path, target: Path) -> Path:
    """Draw the picture of a study; return the file."""
    study = Study(folder)
    steps = study.steps()
    added = max(step.number for step in steps if step.what.startswith("add "))
    verdict = json.loads((study.history.path(added - 1) / "verdict.json").read_text())
    about = EFFECTS[verdict["effects"][0]].first_line()
    missing = f"{about[:1].lower()}{about[1:].partition(':')[0]}"
    against = comparer(study)
    shown = [_prediction(study, against, number) for number in (added - 1, added)]
    with look():
        page = Page(
            11.0,
            4.15,
            f"Missing from the model: {missing}.",
            f"{about} The force error on held-out runs falls from {_error(steps[added - 1])} to "
            f"{_error(steps[added])}.",
            "$ bristle " + " && bristle ".join(COMMANDS),
        )
        grid = page.grid(1, 3, bottom=0.55, right=0.6, column_gap=0.7, width_ratios=(1, 1, 0.8))
        axes = [page.figure.add_subplot(grid[0, column]) for column in range(3)]
        axes[1].sharey(axes[0])
        law = study.model().law
        titles = (f"before: {law}, fitted", f"after: {law} + {missing}")
        for one, panel, title in zip(shown, axes, titles, strict=False):
            _loop(panel, one, title)
        _errors(axes[2], steps)
        page.save(target, dpi=160)
    return target


def _prediction(study: Study, against: Any, number: int) -> RunPrediction:
    """Return the drawn run with what the model of a step predicts."""
    model = study.model_of(number)
    return next(one for one in against.predictions(model) if one.name == RUN)


def _error(step: Step) -> str:
    """Return the error of a step's model in the unit of the force and in per cent of it."""
    share = 100.0 * step.after["error_share_holdout"]
    return f"{plain(step.after['error_holdout'], 3)} N ({share:.1f} %)"


def _loop(axes: Axes, run: RunPrediction, title: str) -> None:
    """Draw measured and predicted force over velocity."""
    part = (run.time >= SECONDS[0]) & (run.time <= SECONDS[1])
    v = 1e3 * run.coordinates["velocity"][part]
    axes.plot(v, run.measured[part], color=VERMILION, lw=2.4, alpha=0.6, label="measured")
    axes.plot(v, run.predicted[part], color=INK, lw=1.0, label="model")
    axes.set_title(title)
    axes.set_xlabel("velocity [mm/s]")
    axes.set_ylabel("force [N]")
    axes.legend(loc="upper left", fontsize=8.5, handlelength=1.2, labelcolor="linecolor")


def _errors(axes: Axes, steps: list[Step]) -> None:
    """Draw the error of each step's model on held-out runs, over the noise; the first has none."""
    steps = [one for one in steps if "z_holdout" in one.after]
    heights = [one.after["z_holdout"] for one in steps]
    axes.set_yscale("log")
    axes.axhspan(0.9, 1.1, color=FLOOR, lw=0.0)
    for i, (z, step) in enumerate(zip(heights, steps, strict=True)):
        done = z < 1.1
        axes.bar(i, z - 0.7, bottom=0.7, width=0.62, color=GREEN if done else BLUE)
        axes.annotate(
            short_z(z), (i, z), (0, 4), textcoords="offset points", ha="center",
            fontsize=10.5, fontweight="bold", color=GREEN if done else INK,
        )  # fmt: skip
        name = textwrap.fill(step.what, 11, break_long_words=False)
        axes.text(i, 0.63, name, ha="center", va="top", fontsize=8.5, color=INK)
    axes.text(len(steps) - 0.42, 1.0, "noise", color=GREY, fontsize=8.5, va="center")
    axes.set_ylim(0.7, 1.8 * max(heights))
    axes.set_xticks([])
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(lambda _value, _place: "")
    axes.grid(visible=False, axis="x")
    axes.set_title("error / noise (z) on held-out runs")


def main(target: Path) -> Path:
    """Run the commands of the first page in a folder of their own; draw what they found."""
    with tempfile.TemporaryDirectory() as name:
        for command in COMMANDS:
            subprocess.run(
                [sys.executable, "-m", "bristle.cli", *command.split()], cwd=name, check=True,
                stdout=subprocess.DEVNULL,
            )  # fmt: skip
        return draw(Path(name, "my_rig"), target)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    print(draw(Path(sys.argv[1]), Path(sys.argv[2])))
