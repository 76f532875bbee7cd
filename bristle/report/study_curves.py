"""The curves that a study learned, in its report: picture, formula, and what each leaves."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from ..findings import command
from ..view import html

if TYPE_CHECKING:
    from collections.abc import Collection

    from ..study.study import Study


def curves_section(study: Study, present: Collection[str]) -> str:
    """Return the section of the curves that were learned here and whose effects there still are.

    "" where there is none.

    Parameters
    ----------
    study : the folder, opened
    present : names of the effects of its present model
    """
    parts = []
    for file in sorted(study.reports_folder.glob("*.json")):
        name = file.stem
        if not (study.effects_folder / f"{name}.py").is_file():
            continue
        parts.append(f"<h3>{html.escape(name)}</h3>")
        try:
            told = json.loads(file.read_text(encoding="utf-8"))
            texts, rows = [str(one) for one in told["sentences"]], _rows(told)
        except (OSError, ValueError, KeyError, TypeError) as error:
            parts.append(html.paragraphs(f"reports/{file.name} cannot be read: {error!r}."))
            continue
        parts.append(html.paragraphs(*texts, kind="lead"))
        picture = file.with_suffix(".png")
        if picture.is_file():
            caption = _caption(told)
            parts.append(html.figure(picture.read_bytes(), texts[0], caption))
        if rows:  # a resonance, elastic-slip elements and a surface have none
            heads = ["form", "formula", "remains of the curve"]
            parts.append(html.table(heads, rows, numbers=(2,)))
        if name not in present:
            add = command("add", study.name, name)
            parts.append(html.paragraphs(f"The present model is without it:  {add}", kind="soft"))
    return html.section("What was learned from these runs", *parts) if parts else ""


def _caption(told: dict[str, Any]) -> str:
    """Return what the picture of a curve shows."""
    if told.get("levels"):
        return (
            "The surface, a curve for each level of its second signal, with the 95 % interval of "
            "each of its values. A hollow point continues those beside it."
        )
    if told["forms"]:
        return (
            "The curve with the 95 % interval of each of its values, and the closed form that "
            "follows it best."
        )
    return "What was learned is no curve with a closed form."


def _rows(told: dict[str, Any]) -> list[list[str]]:
    """Return name, formula and remaining share of the closed forms nearest to a curve."""
    return [
        [str(one["name"]), f"g = {one['formula']}", f"{100.0 * float(one['left']):.0f} %"]
        for one in told["forms"]
    ]
