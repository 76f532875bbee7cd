"""Draws the icons of the FMUs into bristle/fmu/icons: `python docs/icons.py`."""

from __future__ import annotations

import io
from math import pi, sin
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from PIL import Image

FOLDER = Path(__file__).resolve().parent.parent / "bristle" / "fmu" / "icons"
INK, ACCENT, WIDTH = "#1f3a5f", "#d1622b", 5.0
Line = tuple[list[float], list[float], str]


def line(*points: tuple[float, float], color: str = INK) -> Line:
    """Return a line through points; the icon spans -1 to 1."""
    return [x for x, _ in points], [y for _, y in points], color


def wave(left: float, right: float, height: float, turns: float, fall: float = 0.0) -> Line:
    """Return a sine about zero, its size falling to the right."""
    shares = [k / 80 for k in range(81)]
    return line(*[
        (left + (right - left) * s, height * (1 - fall * s) * sin(2 * pi * turns * s))
        for s in shares
    ], color=ACCENT)  # fmt: skip


FRAME = [line((-0.9, -0.6), (-0.9, 0.6), (0.9, 0.6), (0.9, -0.6), (-0.9, -0.6))]
ICONS: dict[str, list[Line]] = {
    "component": FRAME,
    "damper": [
        line((-0.95, 0.0), (-0.45, 0.0)),
        line((0.4, 0.4), (-0.45, 0.4), (-0.45, -0.4), (0.4, -0.4)),
        line((0.05, 0.3), (0.05, -0.3)),
        line((0.05, 0.0), (0.95, 0.0)),
        line((-0.7, -0.75), (0.55, 0.75), color=ACCENT),
        line((0.3, 0.7), (0.55, 0.75), (0.57, 0.5), color=ACCENT),
    ],
    "structure": [
        line((-0.6, -0.5), (-0.6, 0.8), (0.6, 0.8), (0.6, -0.5)),
        line((-0.6, 0.37), (0.6, 0.37)),
        line((-0.6, -0.06), (0.6, -0.06)),
        line((-0.75, -0.5), (0.75, -0.5)),
        line((-0.5, -0.6), (-0.35, -0.75), (-0.5, -0.85), color=ACCENT),
        line((0.5, -0.6), (0.35, -0.75), (0.5, -0.85), color=ACCENT),
        line((-0.95, -0.95), (0.95, -0.95)),
    ],
    "ground": [wave(-0.9, 0.9, 0.8, 4.5, 0.9), line((-0.95, 0.0), (0.95, 0.0))],
    "source": [
        line((-0.8, 0.9), (-0.8, -0.8), (0.9, -0.8)),
        line((-0.8, -0.3), (-0.3, -0.3), (-0.3, 0.5), (0.85, 0.5), color=ACCENT),
    ],
    "sensors": [
        *FRAME,
        line(*[(-0.7 + 0.35 * (k // 2), -0.4 + 0.2 * ((k + 1) // 2)) for k in range(8)],
             color=ACCENT),
    ],
    "controller": [
        *FRAME,
        line((-0.6, -0.3), (-0.1, -0.3), (0.1, 0.3), (0.6, 0.3), color=ACCENT),
    ],
    "scenario": [
        line((-0.9, 0.9), (-0.3, 0.9), (-0.3, 0.3), (-0.9, 0.3), (-0.9, 0.9)),
        line((0.9, -0.9), (0.3, -0.9), (0.3, -0.3), (0.9, -0.3), (0.9, -0.9)),
        line((-0.3, 0.6), (0.6, 0.6), (0.6, -0.3), color=ACCENT),
        line((0.3, -0.6), (-0.6, -0.6), (-0.6, 0.3), color=ACCENT),
    ],
}  # fmt: skip


def draw(lines: list[Line]) -> bytes:
    """Return an icon of 128 by 128 pixels as a PNG of 16 colours."""
    figure, axes = plt.subplots(figsize=(1.28, 1.28), dpi=100)
    figure.subplots_adjust(0, 0, 1, 1)
    for x, y, color in lines:
        axes.plot(x, y, color=color, linewidth=WIDTH, solid_capstyle="round")
    axes.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1))
    axes.set_axis_off()
    drawn, small = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn)
    plt.close(figure)
    Image.open(drawn).convert("RGB").quantize(16).save(small, "PNG", optimize=True)
    return small.getvalue()


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, lines in ICONS.items():
        (FOLDER / f"{name}.png").write_bytes(draw(lines))
