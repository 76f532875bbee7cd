"""The verdict's parts of a study's report: what is missing, on what evidence, what was not told."""

from __future__ import annotations

from collections.abc import Collection

from ..data.channels import channel_unit, is_channel
from ..diagnose.law_text import HEADER, TABLE_NOTE, law_table
from ..diagnose.picture import draw_evidence
from ..diagnose.verdict_text import (
    HEADINGS,
    LIMITS,
    LIMITS_NOTES,
    Verdict,
    about,
    drive_of,
    limit_rows,
    sentences,
    separating,
    untestable,
)
from ..draw import html
from ..draw.style import png
from ..findings import command
from ..physics.drive import text_for
from ..physics.effect import EFFECTS
from ..quantity import quantity
from .study_tables import ranking_table

_TONES = {"none": "green", "effect": "blue", "ambiguous": "purple", "unknown": "red"}
"""Colours of the kinds of a verdict."""


def verdict_section(verdict: Verdict | None, name: str, told: Collection[str] = ()) -> str:
    """Return the verdict on a study of this name as HTML, with its evidence.

    `told` are notes that stand elsewhere on the page.
    """
    if verdict is None:
        kind, heading, texts = "", "Not diagnosed", _undiagnosed(name)
    else:
        kind, texts = str(verdict["kind"]), sentences(verdict)
        heading = HEADINGS[kind]
        if kind in ("effect", "ambiguous"):
            texts[1:1] = [about(str(one), drive_of(verdict)) for one in verdict["effects"]]
    inner = [
        f'<div class="verdict" style="--tone: var(--{_TONES.get(kind, "soft")})">',
        f'<div class="kind">{html.escape(heading)}</div>',
        html.paragraphs(texts[0], kind="say"),
        html.paragraphs(*texts[1:]),
        "</div>" + html.items(_notes(verdict, told)),
    ]
    if verdict and verdict.get("laws"):
        inner.append("<h3>The laws</h3>")
        inner.append(html.paragraphs(TABLE_NOTE, kind="soft"))
        inner.append(html.table(list(HEADER), law_table(verdict["laws"]), numbers=range(2, 8)))
    rows = ranking_table(verdict)
    if rows:
        header, cells, strong = rows
        inner.append("<h3>The evidence</h3>")
        inner.append(
            html.paragraphs(
                "Each effect was added to the model, all parameters were fitted again, and runs "
                "that no fit has seen decide.", kind="soft",
            )
        )  # fmt: skip
        bars = draw_evidence(verdict or {})
        if bars is not None:
            told = ", ".join(f"{effect} {z}" for effect, z, _ in cells)
            caption = (
                "What each effect leaves of error / noise (z) on held-out runs. Blue: what the "
                "verdict names. Green: the noise floor."
            )
            inner.append(html.figure(png(bars), f"z with each effect: {told}", caption))
        inner.append(html.table(header, cells, numbers=(1, 2), strong=strong))
    inner.append(html.paragraphs(noise_floor(verdict), kind="soft"))
    return "\n".join(part for part in inner if part)


def _notes(verdict: Verdict | None, told: Collection[str]) -> list[str]:
    """Return the notes of a verdict that are not told elsewhere."""
    return [note for note in (verdict or {}).get("notes") or [] if note not in told]


def _undiagnosed(name: str) -> list[str]:
    return [
        "No diagnosis has been made of the present model.",
        f"{command('diagnose', name)} finds what it misses, and how certain that is.",
    ]


def noise_floor(verdict: Verdict | None) -> str:
    """Return the noise floor of a verdict as a sentence; "" where it is not told."""
    floor = (verdict or {}).get("noise_floor") or {}
    parts = [
        f"{name} {quantity(value, channel_unit(name) if is_channel(name) else '1', fine=True)}"
        for name, value in floor.items()
        if isinstance(value, int | float)
    ]
    return f"Noise floor of the verdict: {', '.join(parts)}." if parts else ""


def untestable_rows(verdict: Verdict | None) -> list[list[str]]:
    """Return rows of the effects that could not be tested: name, what it does and would show."""
    rows, drive = [], drive_of(verdict or {})
    for told in untestable(verdict or {}):
        name = told.partition(" ")[0]
        effect = EFFECTS.get(name)
        expect = text_for(effect.expect, drive) if effect else "-"
        rows.append([told, about(name, drive), expect])
    return rows


def untold_section(verdict: Verdict | None) -> str:
    """Return what could not be tested as HTML, and the experiment that would tell."""
    hidden = untestable_rows(verdict)
    parts = [
        html.paragraphs(
            "These effects may still be present: the data do not excite them, or the fit of the "
            "model absorbs them.", kind="soft",
        ),
        html.table(["effect", "what it does", "what it would look like"], hidden),
    ] if hidden else []  # fmt: skip
    limits = limit_rows(verdict or {})
    if limits:
        parts.append("<h3>How large each effect may still be</h3>")
        parts.append(html.table(list(LIMITS), limits))
        parts.append(html.paragraphs(" ".join(LIMITS_NOTES), kind="soft"))
    experiment = separating(verdict or {})
    if experiment:
        parts.append("<h3>The experiment that would distinguish them</h3>")
        parts.append(html.paragraphs(experiment))
    if not parts:
        none = "No diagnosis has been made of this model, so its missing effects are unknown."
        parts = [html.paragraphs(none if verdict is None else "The diagnosis names nothing.")]
    return html.section("What these runs exclude, and what they cannot show", *parts)
