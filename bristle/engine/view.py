"""A run as blocks: peaks and RMS, what its coupling errs by, and the figure."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.text import listed, percent, plain
from ..data.cycles import largest
from ..view.blocks import Block, Figure, Table, Text, View, view_of
from ..view.style import BLUE, COLOURS, GREY, PALE, VERMILION, Page, label, look, zero_lines
from .results import (
    NOTHING,
    Feed,
    Results,
    by_component,
    feeds_of,
    foreign,
    judged_by,
    reals,
    summarise,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawn
    from matplotlib.gridspec import GridSpec

_TOP = re.compile(r"(?P<component>.*)\.floor(?P<floor>\d+)_acceleration_absolute")
SHOWN = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "m/s2": (1.0, "m/s²"), "1": (1.0, "")}
"""Units in SI, with the factor to those that are shown."""
MEASURED = Feed("measured.value")
"""The force as it was measured: a signal of this name that is played beside the model's."""
_MOTIONS = {"displacement": "m", "velocity": "m/s"}
"""What a damper feels, and its unit."""
_MOST_HISTORIES = 5
_MOST_OTHERS = 12
_HISTORY, _LOOP = 1.75, 3.55
"""Heights of the panels with their titles [in]."""
_DPI = 160

Array = np.ndarray[Any, Any]
Draw = Callable[["Axes"], None]


@view_of(Results)
def run_view(frame: pd.DataFrame) -> View:
    """Return the view of a run's results; of a part of them what is told of that part."""
    made = frame.attrs.get("made", {})
    title = str(made.get("title") or made.get("file") or "results")
    state = "" if frame.attrs.get("complete", True) else "; INCOMPLETE"
    took = f" in {made['wall_time']:.2f} s," if "wall_time" in made else ""
    found = summarise(frame)
    rows = [
        [
            one.name, plain(one.peak, 5), plain(one.time_of_peak, 4), plain(one.rms, 5),
            "" if one.unit in (None, "1") else str(one.unit),
        ]
        for one in found
    ]  # fmt: skip
    first, last = float(frame.index[0]), float(frame.index[-1])
    more = len(frame.columns) - len(rows)
    said = f"{len(frame)} rows{took} from {first:g} to {last:g} s{state}."
    if more > 0:
        said += f" {more} more columns."
    known = {n: np.isfinite(frame[n].to_numpy(dtype=float)) for n in frame.columns}
    if broken := [n for n, there in known.items() if not there.all()]:
        since = float(frame.index[min(int(np.argmin(known[n])) for n in broken)])
        said += f" Not finite from {since:g} s on: {listed(broken)}."
    return View(
        title,
        (
            Table(("output", "peak", "at [s]", "RMS", "unit"), rows, (1, 2, 3)),
            *_coupling_error(frame), Text(said),
        ),
        (Figure(lambda: draw_run(frame), title),),
    )  # fmt: skip


def _coupling_error(frame: pd.DataFrame) -> list[Block]:
    """Return the coupling error, where it was estimated."""
    found = frame.attrs.get("coupling_error")
    if found is None:
        return []
    step, by = 1e3 * frame.attrs["made"]["step"], frame.attrs["coupling_error_by"]
    heading = f"Coupling error at {step:g} ms, by {by}, in %"
    shown = [n for n in judged_by(frame) if found[n]["along"] > 0.0 or not found[n]["worth"]]
    if not shown:
        return [Text(f"{heading}: none, for nothing here depends on the step.")]
    rows = []
    for name in shown:
        error = found[name]
        keys = ("along", "peak", "rms")
        # Runs that agree on the wrong side of a switch show no error, and have one.
        shares = [plain(100.0 * error[key], 2) if error["along"] > 0.0 else "?" for key in keys]
        rows.append([name, *shares, f"{error['order']:.1f}" + ", no use" * (not error["worth"])])
    note = "The other outputs do not depend on the step."
    header = ("output", "along run", "of peak", "of RMS", "order")
    return [Table(header, rows, range(1, 5), heading, note=note)]


def run_figure(frame: pd.DataFrame, path: str | Path, *, title: str = "") -> None:
    """Draw a run into an image file.

    Panels: absolute acceleration of the top floor, base drift, voltages that vary, force over
    displacement and over velocity of the dampers. Outputs of components that none of these shows
    follow over time, foreign FMUs with all of them; what the scenario does not have is left out.

    Parameters
    ----------
    frame : DataFrame
        Results as `bristle.run` returns them.
    path : path
        The image; its ending decides the format, png, svg or pdf.
    title : str
        Above the panels; by default the scenario's title.

    Raises
    ------
    RunError
        If the file cannot be written or its ending is no format.
    """
    draw_run(frame, title).save(Path(path), dpi=_DPI)


def draw_run(frame: pd.DataFrame, title: str = "") -> Page:
    """Return the figure of a run, drawn and not yet written; see `run_figure`."""
    run = _DrawnRun(frame)
    histories, loops = run.histories(), run.loops()
    others = run.others()
    histories += others[:_MOST_OTHERS]
    if not histories and not loops:
        histories = [run.history(name, name) for name in run.reals()[:4]]
    room = _HISTORY * len(histories) + 0.3 * bool(histories) + _LOOP * bool(loops)
    with look():
        subtitle = run.subtitle()
        if len(others) > _MOST_OTHERS:
            subtitle += f"; {len(others) - _MOST_OTHERS} further panels left out, see the results"
        page = Page(9.6, room + 0.1, title or run.title(), subtitle)
        if histories:
            below = _LOOP * bool(loops)
            grid = page.grid(len(histories), 1, top=0.35, bottom=below + 0.45, row_gap=0.45)
            _draw_histories(page.figure, grid, histories)
        if loops:
            grid = page.grid(1, len(loops), top=room - _LOOP + 0.35, bottom=0.5)
            for column, draw in enumerate(loops):
                draw(page.figure.add_subplot(grid[0, column]))
    return page


def _draw_histories(figure: Drawn, grid: GridSpec, histories: list[Draw]) -> None:
    shared: Axes | None = None
    for row, draw in enumerate(histories):
        shared = figure.add_subplot(grid[row, 0], sharex=shared)
        draw(shared)
        last = row == len(histories) - 1
        shared.tick_params(labelbottom=last)
        if last:
            shared.set_xlabel("time [s]", loc="right", labelpad=0)


@dataclass(frozen=True)
class _DrawnRun:
    """What can be drawn of a frame of results; `shown` are the outputs that panels have so far."""

    frame: pd.DataFrame
    shown: set[str] = field(default_factory=set)

    @property
    def made(self) -> dict[str, Any]:
        made: dict[str, Any] = self.frame.attrs.get("made", {})
        return made

    def title(self) -> str:
        return str(self.made.get("title") or Path(str(self.made.get("file", "run"))).stem)

    def subtitle(self) -> str:
        made, parts = self.made, []
        if not self.frame.attrs.get("complete", True):
            parts.append(f"INCOMPLETE, stopped at t = {self.frame.index[-1]:.6g} s")
        if made.get("step"):
            parts.append(f"step {1e3 * made['step']:g} ms")
        parts += [str(made[key]) for key in ("algorithm",) if made.get(key)]
        overrides = made.get("overrides") or {}
        parts += [f"{name} = {value}" for name, value in list(overrides.items())[:6]]
        return "; ".join(parts)

    def reals(self) -> list[str]:
        return reals(self.frame)

    def histories(self) -> list[Draw]:
        """Return accelerations and drifts of every structure, and voltages that vary."""
        tops: dict[str, int] = {}
        for name in self.reals():
            if match := _TOP.fullmatch(name):
                tops[match["component"]] = max(int(match["floor"]), tops.get(match["component"], 0))
        many, made = len(tops) > 1, []
        for component, floor in tops.items():
            of = f", {component}" if many else ""
            name = f"{component}.floor{floor}_acceleration_absolute"
            ground = self.feeds.get(f"{component}.ground_acceleration", NOTHING)
            what = f"Absolute acceleration of floor {floor}{of}"
            made.append(partial(self.history, name, what, behind=ground))
            base = f"{component}.base_displacement"
            drift = base if base in self.frame else f"{component}.drift1"
            what = "Base drift" if drift == base else "Drift of the first storey"
            if drift in self.frame:
                stroke = drift == base and not many
                made.append(partial(self.history, drift, what + of, stroke=stroke))
        if not tops:
            moved = [name for name in self.reals() if name.endswith(".displacement")]
            made += [partial(self.history, name, f"Displacement, {name[:-13]}") for name in moved]
        forces = [name for name in self.reals() if name.endswith(".force")]
        if MEASURED.output in self.frame and len(forces) == 1:
            made.append(partial(self.history, forces[0], "Force", behind=MEASURED))
        driven = (n for n in self.reals() if n.endswith(".voltage") and self._moves(n))
        made += [partial(self.history, name, f"Voltage, {name[:-8]}") for name in driven]
        return [make() for make in made[:_MOST_HISTORIES]]

    @cached_property
    def feeds(self) -> dict[str, Feed]:
        """What feeds each input."""
        return feeds_of(self.made.get("scenario", ""))

    def history(
        self, name: str, title: str, *, stroke: bool = False, behind: Feed = NOTHING
    ) -> Draw:
        """Return what draws one output over time, its peak marked, over another one."""
        self.shown.update((name, behind.output))

        def draw(axes: Axes) -> None:
            time = self.frame.index.to_numpy()
            values, unit = self._shown(name)
            axes.axhline(0.0, color=PALE, linewidth=0.8, zorder=1)
            if behind.output in self.frame:
                axes.plot(time, self._given(behind), color="#9a9a9a", linewidth=0.8)
                what = "measured" if behind == MEASURED else "ground"
                axes.set_title(f"grey: {what}", loc="right", fontsize=8.5, color=GREY)
            axes.plot(time, values, color=BLUE, linewidth=0.9)
            axes.set_title(title + _bracketed(unit))
            axes.margins(x=0.0, y=0.2)
            if len(time) > 1:
                axes.set_xlim(time[0], time[-1])
            words = f"{' ' if unit else ''}{unit} at {{time:.4g}} s"
            _mark_peak(axes, time, values, words + (self._of_stroke() if stroke else ""))

        return draw

    def _of_stroke(self) -> str:
        ratios = [name for name in self.reals() if name.endswith(".stroke_ratio")]
        if len(ratios) != 1:
            return ""
        return f", {percent(np.nanmax(self.frame[ratios[0]].to_numpy()), 0)} of the damper's stroke"

    def others(self) -> list[Draw]:
        """Return what is drawn of the components that no other panel shows, by their units."""
        strange, draws, judged = foreign(self.frame), [], set(judged_by(self.frame))
        for component, names in by_component(self.reals()).items():
            if component in strange:
                names = [name for name in names if name not in self.shown]
            elif self.shown & set(names):
                continue
            else:  # what never changes says nothing, but of a run that has nothing else
                names = [name for name in names if name in judged and self._moves(name)]
            units: dict[str, list[str]] = {}
            for name in names:
                units.setdefault(self._shown(name)[1], []).append(name)
            for unit, alike in units.items():
                groups = [alike[i : i + len(COLOURS)] for i in range(0, len(alike), len(COLOURS))]
                draws += [self._together(component, group, unit) for group in groups]
        return draws

    def _moves(self, name: str) -> bool:
        return bool(np.ptp(self.frame[name].to_numpy()) > 0.0)

    def _together(self, component: str, names: list[str], unit: str) -> Draw:
        """Return what draws outputs of one unit over time; a single one with its peak."""
        if len(names) == 1:
            return self.history(names[0], names[0])

        def draw(axes: Axes) -> None:
            axes.axhline(0.0, color=PALE, linewidth=0.8, zorder=1)
            for name, colour in zip(names, COLOURS, strict=False):
                values, _ = self._shown(name)
                short = name.partition(".")[2]
                axes.plot(self.frame.index, values, color=colour, linewidth=0.9, label=short)
            axes.set_title(component + _bracketed(unit))
            axes.margins(x=0.0, y=0.12)
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(names),
                        labelcolor="linecolor", fontsize=8, borderaxespad=0.2)  # fmt: skip

        return draw

    def loops(self) -> list[Draw]:
        """Return force over displacement and force over velocity of all dampers."""
        dampers = [name[:-6] for name in self.reals() if name.endswith(".force")]
        draws = []
        for motion in _MOTIONS:
            pairs = [
                (damper, feed)
                for damper in dampers
                if (feed := self.feeds.get(f"{damper}.{motion}", NOTHING)).output in self.frame
            ]
            if pairs:
                self.shown.update(f"{damper}.force" for damper, _ in pairs)
                self.shown.update(feed.output for _, feed in pairs)
                draws.append(self._loop(motion, pairs))
        return draws

    def _loop(self, motion: str, pairs: list[tuple[str, Feed]]) -> Draw:
        def draw(axes: Axes) -> None:
            zero_lines(axes)
            for number, (damper, feed) in enumerate(pairs):
                across, unit = self._felt(feed, damper, motion)
                force, force_unit = self._shown(f"{damper}.force")
                colour, cycle = COLOURS[number % len(COLOURS)], self._largest_cycle(damper)
                thin = PALE if cycle else colour
                name = None if cycle else damper
                axes.plot(across, force, color=thin, linewidth=0.6, label=name)
                if cycle:
                    axes.plot(across[cycle], force[cycle], color=colour, lw=1.5, label=damper)
                    told = "thick: the largest cycle"
                    if MEASURED.output in self.frame and len(pairs) == 1:
                        measured = self._given(MEASURED)[cycle]
                        axes.plot(across[cycle], measured, color=VERMILION, lw=0.9)
                        told = "one cycle; red: measured"
                    axes.set_title(told, loc="right", fontsize=8, color=GREY)
                axes.set_xlabel(motion + _bracketed(unit))
                axes.set_title(f"Damper force{_bracketed(force_unit)} over {motion}")
                if len(pairs) == 1:
                    _mark_peak(axes, across, force, f" {force_unit}")
            axes.margins(y=0.12)
            if len(pairs) > 1:
                axes.legend(labelcolor="linecolor")

        return draw

    def _largest_cycle(self, damper: str) -> slice | None:
        """Return the samples of a damper's largest cycle: all of an earthquake are a tangle."""
        motion = [self.feeds.get(f"{damper}.{name}", NOTHING) for name in _MOTIONS]
        known = all(feed.output in self.frame for feed in motion)
        return largest(*(self._given(feed) for feed in motion)) if known else None

    def _given(self, feed: Feed) -> Array:
        """Return the values that an input gets, in its own unit."""
        return feed.given(self.frame[feed.output].to_numpy())

    def _felt(self, feed: Feed, damper: str, motion: str) -> tuple[Array, str]:
        """Return what a damper feels as it is shown, and its unit ("" where that is not known)."""
        if feed.is_plain:
            return self._shown(feed.output)
        unit = "" if damper in foreign(self.frame) else _MOTIONS[motion]
        factor, shown = SHOWN.get(unit, (1.0, unit))
        return self._given(feed) * factor, shown

    def _shown(self, name: str) -> tuple[Array, str]:
        """Return an output as it is shown, and its unit ("" without one)."""
        unit = self.frame.attrs.get("units", {}).get(name) or ""
        factor, shown = SHOWN.get(unit, (1.0, unit))
        return self.frame[name].to_numpy() * factor, shown


def _mark_peak(axes: Axes, across: Array, values: Array, label_text: str) -> None:
    """Mark the largest absolute value and write it beside, on the side where there is room."""
    size = np.abs(values)
    if not np.isfinite(size).any() or not np.nanmax(size) > 0.0:
        return
    at = int(np.nanargmax(size))
    low, high = axes.get_xlim()
    on_the_left = across[at] > low + 0.55 * (high - low)
    axes.plot(across[at], values[at], "o", color=VERMILION, markersize=4.5, zorder=4)
    text = f"{size[at]:.4g}{label_text.format(time=across[at])}"
    # Above a maximum and below a minimum there is no line.
    aside, side = (-5, "right") if on_the_left else (5, "left")
    away, edge = (3, "bottom") if values[at] > 0.0 else (-3, "top")
    label(axes, text, across[at], values[at], VERMILION, xytext=(aside, away), ha=side, va=edge)


def _bracketed(unit: str) -> str:
    return f" [{unit}]" if unit else ""
