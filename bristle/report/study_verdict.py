"""A verdict in words, for the report: what verdict.json says, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..compare.names import name_of
from ..data.channels import PLAIN
from ..findings import command
from ..physics.effect import EFFECTS
from .study_tables import in_lab_unit, number, share

Verdict = Mapping[str, Any]

_BADGES = {
    "none": ("Nothing found missing", "green"),
    "effect": ("Missing physics found", "blue"),
    "class": ("One of a few is missing", "purple"),
    "unknown": ("Something unknown is missing", "red"),
    "insufficient": ("The data carry no verdict", "soft"),
}
_NO_BADGE = ("Not diagnosed", "soft")


def badge(verdict: Verdict | None) -> tuple[str, str]:
    """Return the heading of a verdict and the name of its colour."""
    return _BADGES.get(str(verdict.get("kind")), _NO_BADGE) if verdict else _NO_BADGE


def words(verdict: Verdict | None, name: str) -> list[str]:
    """Return what a verdict says: one sentence first, then what goes with it."""
    if not verdict:
        return [
            "No diagnosis has been made of the present model.",
            f"{command('diagnose', name)} tells what it misses, and how sure that is.",
        ]
    out = [_first(verdict)]
    if verdict.get("kind") in ("effect", "class"):
        out += [f"{_about(str(one))}." for one in verdict.get("effects") or []]
    own = str(verdict.get("words") or "").strip()
    if own:
        out.append(own)
    detectable = verdict.get("detectable")
    if verdict.get("kind") == "none" and isinstance(detectable, int | float) and not own:
        out.append(f"An effect of {share(detectable)} of the force would have been seen.")
    for fault in verdict.get("sensors") or []:
        if fault.get("words") and fault["words"] in own:
            continue
        out.append(
            str(fault.get("words") or "")
            or "Sensor: {fault} of {channel}, {value}.".format(
                fault=fault.get("fault"),
                channel=fault.get("channel"),
                value=number(fault.get("value")),
            )
        )
    return list(dict.fromkeys(out))


def _first(verdict: Verdict) -> str:
    kind, effects = verdict.get("kind"), [str(one) for one in verdict.get("effects") or []]
    if kind == "effect":
        return f"The model misses {_joined(effects, 'and')}."
    if kind == "class":
        which = (
            f"either {effects[0]} or {effects[1]}"
            if len(effects) == 2
            else (f"one of {_joined(effects, 'and')}")
        )
        return f"The model misses {which}; these data cannot say which."
    if kind == "unknown":
        along = str(verdict.get("coordinate") or "")
        tail = f"; it is organised by {name_of(along)}" if along else ""
        return f"The model misses something that no known effect explains{tail}."
    if kind == "none":
        return "These data show nothing that the model misses."
    return "These data cannot carry a verdict."


def _about(effect: str) -> str:
    """Return the first line of an effect's text, without its stop."""
    if effect not in EFFECTS:
        return f"{effect} is an effect of the user's own"
    return EFFECTS[effect].first_line().rstrip(".")


def _joined(names: list[str], word: str) -> str:
    if len(names) < 2:
        return names[0] if names else "an effect"
    return f"{', '.join(names[:-1])} {word} {names[-1]}"


def noise_floor(verdict: Verdict | None) -> str:
    """Return the noise that the verdict rests on, in words; "" where it is not told."""
    floor = (verdict or {}).get("noise_floor")
    if not isinstance(floor, Mapping) or not floor:
        return ""
    parts = [
        f"{name} {in_lab_unit(value, PLAIN.get(name, ''))}".strip()
        for name, value in floor.items()
        if isinstance(value, int | float)
    ]
    return f"Noise that the verdict rests on: {', '.join(parts)}." if parts else ""


def untestable(verdict: Verdict | None) -> list[list[str]]:
    """Return rows of the effects that could not be tested: name, what it does and would show."""
    rows = []
    for name in (verdict or {}).get("untestable") or []:
        effect = EFFECTS.get(str(name))
        rows.append([str(name), _about(str(name)), effect.expect if effect else "-"])
    return rows


def rivals(verdict: Verdict | None) -> list[str]:
    """Return a sentence on what these data cannot tell apart."""
    effects = [str(one) for one in (verdict or {}).get("effects") or []]
    if (verdict or {}).get("kind") != "class" or len(effects) < 2:
        return []
    return [f"{_joined(effects, 'and')} fit these data alike."]


def separating(verdict: Verdict | None) -> str:
    """Return the experiment that would separate rivals, "" where none is named."""
    found = (verdict or {}).get("separate_by")
    if isinstance(found, Mapping):
        return str(
            found.get("words")
            or found.get("text")
            or ", ".join(f"{k}: {v}" for k, v in found.items())
        )
    return str(found or "")
