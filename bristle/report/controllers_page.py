"""The report of a comparison of controllers: one HTML file that needs nothing else."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from ..controller_comparison.setting import BEST, ENSEMBLES, LIMIT, SCENARIOS, plain_name
from ..controller_comparison.view import draw_motion, motion_table
from ..core.text import command, plain, quantity
from ..version import __version__
from ..view import html
from ..view.blocks import Figure, Text
from ..view.style import png

if TYPE_CHECKING:
    from ..controller_comparison.result import ControllerComparison


def controllers_report(found: ControllerComparison) -> str:
    """Return a comparison of controllers as one HTML document."""
    setting = found.setting
    title = f"Controllers for {setting.site.building.name}"
    view = found.view()
    words = (one for one in view.blocks if isinstance(one, Text) and one.kind != "note")
    summary = tuple(view.every(Figure))
    body = [
        f"<h1>{escape(title)}</h1>",
        html.paragraphs(
            f"{len(found.controllers)} controllers of one damper, {setting.damper.name}, under "
            f"{len(found.motions)} ground motions, beside constant voltages.", kind="soft",
        ),
        html.answer(view._replace(blocks=(*words, *summary))),
        _notes(found),
        _setting(found),
        *(_motion(found, name) for name in found.motions),
        _limits(found),
        _again(found),
    ]  # fmt: skip
    foot = (
        f"bristle {escape(__version__)}. {len(found.table)} cases"
        + (f", {setting.spread.members} members of each" if setting.spread else "")
        + f", {len(found.motions) * len(next(iter(found.levels.values())))} runs at constant "
        f"voltages in {found.seconds:.0f} s. RMS values are over the whole run."
    )
    return html.page(title, [part for part in body if part], foot)


def _notes(found: ControllerComparison) -> str:
    if not found.notes:
        return ""
    return html.section("What to know of it", html.items(found.notes))


def _setting(found: ControllerComparison) -> str:
    """Return what was compared: building, damper, motions, controllers."""
    setting = found.setting
    building, damper = setting.site.building, setting.damper
    frequencies = ", ".join(f"{plain(f, 3)}" for f in setting.site.frequencies[:4])
    more = " ..." if len(setting.site.frequencies) > 4 else ""
    base = "an isolated base" if building.isolated else "a fixed base"
    floors = building.size - building.isolated
    place = setting.site.device.place(building.levels())
    mass = quantity(sum(building.M[i][i] for i in range(building.size)), "kg")
    law = f", law {damper.law}" if damper.law else ""
    texts = [
        f"{building.name}: {floors} floors on {base}, {mass}, natural frequencies {frequencies}"
        f"{more} Hz. The damper acts {place}: {damper.name}{law}, up to {damper.most:g} "
        f"{damper.drive.unit}."
    ]
    motions = [
        [m.name, f"{plain(m.peak, 3)} m/s²", f"{m.stop:g} s", m.source] for m in setting.motions
    ]
    candidates = [
        [one.name, one.about, ", ".join(f"{n} = {v}" for n, v in one.part.parameters.items())]
        for one in setting.candidates
    ]
    return html.section(
        "What was compared",
        html.paragraphs(*texts),
        html.table(["Ground motion", "peak as run", "run to", "source"], motions, [1, 2]),
        html.table(["Controller", "what it is", "values"], candidates),
    )


def _motion(found: ControllerComparison, motion: str) -> str:
    return html.section(
        motion,
        html.blocks([motion_table(found, motion)._replace(title="")]),
        html.figure(png(draw_motion(found, motion)), f"responses under {motion}"),
    )  # fmt: skip


def _limits(found: ControllerComparison) -> str:
    if not found.limits:
        return ""
    unit = found.setting.judged.unit
    texts = []
    for motion, one in found.limits.items():
        bound = "none known" if one.bound is None else quantity(one.bound, unit)
        below = 100.0 * (1.0 - found.value(motion, LIMIT) / found.value(motion, BEST))
        texts.append([
            motion, quantity(found.value(motion, LIMIT), unit), f"{below:.0f} %",
            f"{one.agreeing} of {one.starts}", bound, "yes" if one.sure else "no",
        ])  # fmt: skip
    titles = ["Ground motion", "limit", "below the best constant", "starts that agree",
              "lower bound", "sure"]  # fmt: skip
    return html.section(
        "How far any control could go",
        html.paragraphs(
            "The least that any voltage of this damper reaches, the ground motion known in "
            "advance. What lies between a controller and the limit is what there is to gain; most "
            "of it is the price of not knowing the future."
        ),
        html.table(titles, texts, [1, 2, 3, 4]),
    )


def _again(found: ControllerComparison) -> str:
    """Return how each case is run again."""
    if found.setting.folder is None:
        return ""
    motion, candidate = found.setting.motions[0], found.setting.candidates[0]
    own = f"{SCENARIOS}/{plain_name(motion.name)}/{plain_name(candidate.name)}.toml"
    engine = found.table[found.table["controller"] == candidate.name]["engine"].iloc[0]
    lines = [command("run", own, *(["--engine", "compiled"] if engine == "compiled" else []))]
    if found.setting.spread is not None:
        ensemble = f"{ENSEMBLES}/{plain_name(motion.name)}/{plain_name(candidate.name)}.toml"
        lines.append(command("ensemble", ensemble))
    return html.section(
        "Run it again",
        html.paragraphs(
            "Every case is a scenario in this folder, every worst case an ensemble; the files that "
            "they read lie beside them. From the folder of this report:"
        ),
        f"<pre>{escape(chr(10).join(lines))}</pre>",
    )
