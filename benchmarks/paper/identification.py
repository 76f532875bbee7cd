"""The paper's comparison of damper laws: loops, forces and errors after identification."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from bristle.core.arrays import Array
from bristle.identification.low_passed import CUTOFF, low_pass
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model
from bristle.view.style import BLUE, GREY, INK, RECONSTRUCTED, VERMILION, Page, label, zero_lines

from .law_errors import LawError, law_errors
from .runs import Drawing, Runs

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.gridspec import GridSpec


SCENARIO = "identification_chirp"

BRISTLES: dict[str, dict[str, object]] = {
    "a_0 = 500 1/m": {},
    "a_0 = 2000 1/m": {"damper.a_0": 2000.0, "damper.sigma_a": 2600.0, "damper.sigma_0": 1660.0},
}
"""Overrides: the reconstructed bristle, and one four times as stiff of the same yield force."""

RUNS = len(BRISTLES)

PUBLISHED = {"bingham": 0.05, "lugre": 0.15}
"""How much lower than that of the standard law the paper's text puts the error (section III-C)."""

NOISE = 0.01
"""Of the measured force, as a share of its RMS; motion and voltage carry none."""

_LAWS = {"bingham": "Bingham", "lugre": "LuGre"}
TABLED = ("bingham", "lugre", "bingham_standard", "lugre_standard")
_SHOWN = ("bingham_standard", "bingham", "lugre_standard", "lugre")
_WINDOW = (11.0, 12.5)  # s, around the first resonance, where the base moves most


@dataclass(frozen=True)
class _Case:
    """One damper's experiment, and the laws fitted to it by name."""

    name: str
    problem: Problem
    errors: dict[str, LawError]


def draw(runs: Runs) -> Drawing:
    """Draw a loop as in Fig. 6, forces as in Fig. 7 and errors as in Fig. 8, for both bristles."""
    import pandas as pd

    cases = [_case(runs, name) for name in BRISTLES]
    table = pd.concat([_errors(case) for case in cases], ignore_index=True)
    page = Page(11.4, 8.6, _title(cases), _subtitle(cases), RECONSTRUCTED)
    grid = page.grid(3, 2, row_gap=0.85, column_gap=1.5, left=1.4, height_ratios=(1.2, 1.0, 0.8))
    loops = []
    for column, case in enumerate(cases):
        loops.append(_loop(page, grid, column, case))
        _forces(page.figure.add_subplot(grid[1, column]), case)
        _bars(page.figure.add_subplot(grid[2, column]), case)
    return Drawing(page, {"": table, "_loops": pd.concat(loops, ignore_index=True)})


def _title(cases: list[_Case]) -> str:
    gains = [f"{_gain(case, 'bingham'):.0%} and {_gain(case, 'lugre'):.0%}" for case in cases]
    return (
        "The exponential lowers the identification error of Bingham and LuGre by "
        f"{gains[0]} ({cases[0].name}), by {gains[1]} ({cases[1].name}); the paper says 5 and 15 %"
    )


def _subtitle(cases: list[_Case]) -> str:
    better = all(case.errors["lugre"].train < case.errors["bingham"].train for case in cases)
    order = (
        "LuGre is better than Bingham with both bristles, as the text says"
        if better
        else "LuGre is not better than Bingham with both bristles"
    )
    return (
        "Synthetic experiment of section III-C: table chirp of 1 to 10 Hz in 70 s, voltage a sine "
        f"of 2 Hz up to 5 V, {NOISE:.0%} noise on the force; measured and predicted force below "
        f"{CUTOFF:g} Hz, least squares from several starts. Grey: the damper; blue: Bingham; red: "
        f"LuGre; dashed: standard laws. {order}; which bristle is the paper's, its lost table "
        "would tell."
    )


def _gain(case: _Case, law: str) -> float:
    return 1.0 - case.errors[law].train / case.errors[f"{law}_standard"].train


def _case(runs: Runs, name: str) -> _Case:
    frame = runs(SCENARIO, BRISTLES[name])
    problem = Problem([_run(frame, name)])
    return _Case(
        name, problem, {row.law: row for row in law_errors(problem, None, laws=TABLED, starts=3)}
    )


def _run(frame: pd.DataFrame, name: str) -> Run:
    """Return the experiment as a measured run, with noise on its force."""
    time = frame.index.to_numpy(dtype=float)
    columns = ("structure.base_displacement", "structure.base_velocity", "damper.force")
    x, v, force = (np.asarray(frame[name], dtype=np.float64) for name in columns)
    dt = float(time[1] - time[0])
    noise = NOISE * float(np.sqrt(np.mean(force**2)))
    measured = force + noise * np.random.default_rng(6).standard_normal(len(force))
    V = frame["voltage.value"].to_numpy(dtype=float)
    none = np.zeros((0, len(x), 4))
    return Run(name, dt, x, v, np.gradient(v, dt), V, measured, noise, none)


def _errors(case: _Case) -> pd.DataFrame:
    import pandas as pd

    rows = [
        (case.name, law, row.train, row.moving, row.agreed, row.starts)
        for law, row in case.errors.items()
    ]
    columns = ["bristle", "law", "error RMS [N]", "error RMS above 1 mm/s [N]"]
    return pd.DataFrame(rows, columns=[*columns, "starts that agree", "starts"])


def _sine(model: Model) -> tuple[Array, Array, Array, Array]:
    """Return time, displacement, velocity, force of the fifth cycle at 2 Hz, 0.1 m/s, 4 V."""
    dt, w = 5e-4, 4.0 * pi
    t = dt * np.arange(5001, dtype=np.float64)
    x, v, a = 0.1 / w * np.sin(w * t), 0.1 * np.cos(w * t), -0.1 * w * np.sin(w * t)
    V, none = np.full_like(t, 4.0), np.zeros((0, len(t), 4))
    run = Run("sine", dt, x, v, a, V, np.zeros_like(t), 1.0, none)
    force = Problem([run]).predict(model, run)
    last = slice(-1001, None)
    return t[last], x[last], v[last], np.asarray(force[last])


def _loop(page: Page, grid: GridSpec, column: int, case: _Case) -> pd.DataFrame:
    """Draw the loop of the damper itself and those of the laws fitted; return their numbers."""
    import pandas as pd

    axes = page.figure.add_subplot(grid[0, column])
    zero_lines(axes)
    own = {str(k).removeprefix("damper."): float(str(v)) for k, v in BRISTLES[case.name].items()}
    models = {"damper": Model("lugre", (), own)}
    models |= {law: row.model for law, row in case.errors.items()}
    frames = []
    for law, model in models.items():
        t, x, v, force = _sine(model)
        values = {"time [s]": t, "displacement [m]": x, "velocity [m/s]": v, "force [N]": force}
        frames.append(pd.DataFrame({"bristle": case.name, "law": law, **values}))
        colour, dashed, width = _line(law)
        # Bingham's way back is its way there, and would fill the gaps of a dashed line.
        part = slice(None, 501) if law.startswith("bingham") else slice(None)
        axes.plot(1e3 * v[part], force[part], color=colour, linestyle=dashed, linewidth=width)
    axes.set_xlabel("velocity [mm/s]")
    axes.set_title(f"Fig. 6, {case.name}: force [N] at 2 Hz, 0.1 m/s, 4 V")
    return pd.concat(frames, ignore_index=True)


def _line(law: str) -> tuple[str, object, float]:
    if law == "damper":
        return GREY, "-", 3.0
    colour = BLUE if law.startswith("bingham") else VERMILION
    return colour, (0, (4, 2)) if law.endswith("standard") else "-", 1.1


def _forces(axes: Axes, case: _Case) -> None:
    """Draw measured and predicted force in a window, low-passed alike."""
    run = case.problem.runs[0]
    part = slice(int(_WINDOW[0] / run.dt), int(_WINDOW[1] / run.dt))
    time = np.arange(len(run.force)) * run.dt
    axes.plot(time[part], low_pass(run.force, run.dt)[part], color=GREY, linewidth=3.0)
    for law, row in case.errors.items():
        force = low_pass(case.problem.predict(row.model, run), run.dt)
        colour, dashed, width = _line(law)
        axes.plot(time[part], force[part], color=colour, linestyle=dashed, linewidth=width)
    axes.set_xlabel("time [s]")
    axes.set_title("Fig. 7: force [N] in the experiment")


def _bars(axes: Axes, case: _Case) -> None:
    """Draw the error of each law, and of Bingham and LuGre how much the exponential gains."""
    places = np.arange(len(_SHOWN))[::-1]
    for place, law in zip(places, _SHOWN, strict=True):
        row = case.errors[law]
        colour, dashed, _ = _line(law)
        axes.barh(place, row.train, color=colour, alpha=1.0 if dashed == "-" else 0.45, height=0.7)
        base = law.removesuffix("_standard")
        text = f"{row.train:.3g} N"
        if law == base:
            text += f", {_gain(case, law):.0%} lower (text: about {PUBLISHED[law]:.0%})"
        label(axes, text, row.train, float(place), INK, xytext=(4, 0), va="center")
    names = [
        _LAWS[law.removesuffix("_standard")] + (" standard" if law.endswith("standard") else "")
        for law in _SHOWN
    ]
    axes.set_yticks(places, names)
    axes.set_xlim(0.0, 1.9 * max(row.train for row in case.errors.values()))
    axes.grid(False, axis="y")
    axes.set_xlabel("error RMS [N]")
    axes.set_title("Fig. 8: error of the force")
