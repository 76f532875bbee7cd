"""Figures and tables of a design: loops, weights and the bound that gamma sets."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.text import tick
from ..view.blocks import Figure, Table, Text, View, view_of
from ..view.style import BLUE, GREY, INK, Page, look, ramp, zero_lines
from .analysis import DesignResult, facts_of, grid_rows, omega_of, responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHOWN = {
    "gamma": "gamma",
    "least_gamma": "least gamma of any controller",
    "norm": "closed-loop norm, recomputed",
    "largest_norm": "largest closed-loop norm, recomputed",
    "open_loop_norm": "norm without control",
    "largest_real_part": "largest real part of a pole [1/s]",
    "fastest_pole": "fastest pole [rad/s]",
    "sampled_loop_modulus": "largest modulus of a sampled pole",
}
_PANELS = (
    ("Weighted loop: largest singular value [1]", "open_loop", "closed_loop", ""),
    ("Floor per ground acceleration [1]", "acceleration_open", "acceleration_closed",
     "acceleration_bound"),
    ("Command per ground [{}.s²/m]", "", "command", "command_bound"),
)  # fmt: skip


@view_of(DesignResult)
def design_view(result: DesignResult) -> View:
    """Return the view of a design."""
    facts, made = result.facts, result.controller
    size = f"{made.n} states, sampled at {1e3 * made.sample_period:g} ms"
    speeds = f", a table of {made.rows} speeds" if made.rows > 1 else ""
    solver = f"; solver: {facts['solver']}" if "solver" in facts else ""
    rows = [[name, f"{facts[key]:.4g}"] for key, name in _SHOWN.items() if key in facts]
    poles, said = facts["poles"], list[Text]()
    if poles and not isinstance(poles[0][0], list):  # else one list per grid speed
        listed = [f"{a:.4g}" + (f" ± {b:.4g}j" if b else "") for a, b in poles if b >= 0.0]
        said.append(Text(f"Poles [rad/s]: {', '.join(listed)}."))
    if result.plants:
        said.append(Text(f"Margins at the measurement: {_margins(facts_of(result))}."))
    table = Table(("what", "value"), rows)
    title = headline(result)
    figure = Figure(lambda: draw_result(result), title)
    blocks = (Text(f"{made.kind}: {size}{speeds}{solver}."), table)
    return View(title, (*blocks, *_by_speed(facts), *said), (figure,))


def _by_speed(facts: dict[str, Any]) -> list[Table]:
    """Return the norms of a table at its speeds, and what is proved between them."""
    if "norms" not in facts:
        return []
    norms = zip(facts["grid"], facts["norms"], facts["open_loop_norms"], strict=True)
    rows = [[f"{speed:g}", f"{norm:.4g}", f"{free:.4g}"] for speed, norm, free in norms]
    note = (
        f"gamma is proved at these speeds. The largest norm between them: "
        f"{facts['largest_row_norm']:.4g} at {facts['largest_row_norm_at']:g} m/s. LMI between "
        f"them: holds at {100 * facts['share_proved']:.0f} % of the rows; largest eigenvalue "
        f"{facts['largest_eigenvalue']:.3g} at {facts['largest_eigenvalue_at']:g} m/s (below 0: "
        "proved)."
    )
    header = ("speed [m/s]", "closed-loop norm, recomputed", "without control")
    return [Table(header, rows, (0, 1, 2), note=note)]


def _margins(found: dict[str, Any]) -> str:
    up, down, phase = (found[key] for key in ("gain_up", "gain_down", "phase"))
    texts = [f"{found['modulus']:.3g} from -1"]
    texts.append(f"gain up to {up:.3g} times" if up is not None else "any larger gain")
    texts.append(f"gain down to {down:.3g} times" if down is not None else "any smaller gain")
    texts.append(f"phase {phase:.3g} deg" if phase is not None else "any phase")
    return ", ".join(texts)


def draw_design(result: DesignResult, path: Path) -> None:
    """Draw a design's singular values with its weights into a file.

    Parameters
    ----------
    result : DesignResult
        Of kind "hinf" or "lpv"; of a table, the rows at the grid's speeds are drawn.
    path : Path
        Its suffix is the format: png, svg, pdf.

    Raises
    ------
    DesignError
        For an LQG design, which has no weights of this kind.
    RunError
        If the file cannot be written.
    """
    _loops(result).save(path, dpi=150)


def draw_result(result: DesignResult) -> Page:
    """Return the figure of a design: its loops and weights, or the poles of one without."""
    return _loops(result) if result.plants else _poles(result)


def headline(result: DesignResult) -> str:
    """Return a design in one line."""
    title = result.task.title or f"A design ({result.task.kind})"
    if not result.plants:
        return title
    norm = result.facts.get("norm", result.facts.get("largest_norm"))
    return f"{title}: closed-loop norm {norm:.4g}, gamma {result.facts['gamma']:.4g}"


def _loops(result: DesignResult) -> Page:
    rows = grid_rows(result)
    shown = [responses(result, omega_of(result.task.building), k) for k in rows]
    colours = ramp(len(rows)) if len(rows) > 1 else [BLUE]
    subtitle = (
        "Solid: closed loop. Dashed: without control. Dotted: gamma over the weight, which the "
        "closed loop stays below."
    )
    if len(rows) > 1:
        subtitle += " One curve per speed of the grid, which is held; dark: slow."
    page = Page(10.5, 3.6, headline(result), subtitle)
    with look():
        grid = page.grid(1, 3, left=0.5)
        for i, (heading, without, closed, bound) in enumerate(_PANELS):
            axes = page.figure.add_subplot(grid[0, i])
            axes.set_title(heading.format(result.controller.command_unit))
            _panel(axes, omega_of(result.task.building), shown, colours, (without, closed, bound))
            if not bound:
                axes.axhline(result.facts["gamma"], color=INK, linestyle=":", linewidth=1.0)
    return page


def _poles(result: DesignResult) -> Page:
    """Return the poles of an LQG design, without a weighted loop."""
    subtitle = "Rings: the building with the regulator. Crosses: the controller."
    page = Page(6.4, 3.8, headline(result), subtitle)
    with look():
        axes = page.figure.add_subplot(page.grid(1, 1, left=0.75, top=0.15)[0, 0])
        zero_lines(axes)
        for key, mark, colour in (("regulator_poles", "o", GREY), ("poles", "x", BLUE)):
            if key not in result.facts:
                continue
            real, imaginary = np.array(result.facts[key]).T
            axes.plot(real, imaginary, mark, color=colour, mfc="none", ms=6.0, mew=1.4)
        axes.set_xlabel("real part [1/s]")
        axes.set_ylabel("imaginary part [rad/s]")
    return page


def _panel(
    axes: Axes, omega: Any, shown: list[Any], colours: list[Any], names: tuple[str, str, str]
) -> None:
    from matplotlib.ticker import FuncFormatter

    without, closed, bound = names
    hertz = omega / (2.0 * np.pi)
    for response, colour in zip(shown, colours, strict=True):
        if without:
            plain = GREY if len(shown) == 1 else colour
            axes.loglog(hertz, response[without], color=plain, linestyle=(0, (3, 2)), linewidth=0.8)
        axes.loglog(hertz, response[closed], color=colour)
    if bound:
        axes.loglog(hertz, shown[0][bound], color=INK, linestyle=":", linewidth=1.0)
    axes.set_xlabel("frequency [Hz]")
    top = max(float(response[name].max()) for response in shown for name in names if name)
    low = min(float(np.min(response[closed])) for response in shown)
    axes.set_ylim(max(low * 0.5, top * 1e-4), top * 2.0)
    for axis in (axes.xaxis, axes.yaxis):  # powers of ten would need mathtext, which is off
        axis.set_major_formatter(FuncFormatter(lambda value, _: tick(value)))
