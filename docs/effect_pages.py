"""Pages of the effects and of the laws of a damper, made from their classes."""

from __future__ import annotations

import textwrap
from functools import cache
from typing import Any

from pictures import picture
from tables import formula, span, table, unit

from bristle.cli.list_ import effect_as_dict
from bristle.physics import effects as _registered  # noqa: F401  (importing registers them)
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import DEFAULT, LAWS, Law, law_names, laws_of


@cache
def picture_of(name: str) -> tuple[bytes, str, float] | None:
    """Return an effect's picture, its caption and width [in], drawn once."""
    return picture(name)


def effect_page(name: str) -> str:
    """Return the page of an effect: formula, parameters, what its absence looks like, source."""
    effect = EFFECTS[name]
    told = effect_as_dict(effect)
    site = {"damper": "a damper", "sensor": "a sensor"}.get(effect.site, f"the {effect.site}")
    laws = f" Joins the laws {' and '.join(told['laws'])}." if told["laws"] else ""
    title = told["about"].partition(":")[0]
    parts = [f"# {title} (`{name}`)", told["about"], formula(told["text"])]
    if shown := picture_of(name):
        wide = round(95 * shown[2])
        image = f'![Force with and without {name}]({name}.png){{ width="{wide}" }}'
        parts.append(f"{image}\n\n*{shown[1]}*")
    parts.append(f"An effect of {site}.{laws} {_properties(told)}")
    parts += ["## Parameters", table(["name", "value", "unit", "bounds", "meaning"], [
        [f"`{name}.{key}`", f"{p['value']:g}", unit(p["unit"]), span(*p["bounds"]), p["text"]]
        for key, p in told["parameters"].items()
    ])]  # fmt: skip
    if len(told["states"]) > 8:
        parts.append(f"State: {len(told['states'])} values, a ring among them.")
    elif told["states"]:
        states = ", ".join(f"`{name}.{key}` [{unit}]" for key, unit in told["states"].items())
        parts.append(f"State: {states}.")
    parts += ["## When it is missing", f"{told['expect'][0].upper()}{told['expect'][1:]}."]
    parts += ["## Source", f"{told['source']}."]
    parts += _use_of(name, effect.site, told)
    return "\n\n".join(part for part in parts if part) + "\n"


def law_page(law: type[Law]) -> str:
    """Return the page of a damper's law: formula, parameters, the effects that join it, source."""
    title = (law.__doc__ or "").strip().partition(":")[0]
    parts = [f"# {title} (`{law.name}`)", formula(law.__doc__ or "")]
    rows = [
        [f"`{key}`", f"{p.value:g}", unit(p.unit), span(*p.bounds), p.text]
        for key, p in law.parameters.items()
    ]
    parts += ["## Parameters", table(["name", "value", "unit", "bounds", "meaning"], rows)]
    if law.states:
        states = ", ".join(f"`{key}` [{unit}]" for key, unit in law.states.items())
        parts.append(f"State: {states}.")
    if law.variants:
        names = ", ".join(f"`{law.name}_{suffix}`" for suffix in law.variants)
        parts.append(f"Variants: {names}.")
    joining = [
        name for name in sorted(EFFECTS) if law.name in effect_as_dict(EFFECTS[name])["laws"]
    ]
    links = ", ".join(f"[{name}](../effects/{name}.md)" for name in joining)
    parts += ["## Effects that join it", f"{links}."]
    parts += ["## Source", f"{law.source}."]
    parts += ["## Use it", f"In a study: `bristle identify STUDY --law {law.name}`."]
    return "\n\n".join(parts) + "\n"


def effect_index() -> str:
    """Return the page that lists the effects."""
    rows = [
        [f"[{name}]({name}.md)", effect.site, effect.first_line(), effect.expect]
        for name, effect in sorted(EFFECTS.items())
    ]
    return (
        "# Effects\n\nPhysics beyond the base laws, each in one file and switched on by a "
        "parameter; `bristle list effects` prints the same. "
        "[Write your own](../own_physics.md).\n\n"
        + table(["effect", "site", "what it does", "when it is missing"], rows)
    )


def law_index() -> str:
    """Return the page that lists the laws of dampers."""
    rows = [
        [
            f"[{law.name}]({law.name}.md)",
            (law.__doc__ or "").strip().splitlines()[0].split(": f")[0],
        ]
        for law in laws_of("damper")
    ]
    variants = ", ".join(f"`{name}`" for name in law_names() if name not in LAWS)
    return (
        "# Laws\n\nThe base models of a damper, each in one file. Effects join them. "
        f"A study begins with `{DEFAULT}` unless you name another one.\n\n"
        + table(["law", "what it is"], rows)
        + f"\n\nVariants: {variants}.\n"
    )


def _use_of(name: str, site: str, told: dict[str, Any]) -> list[str]:
    """Return how an effect is switched on; a sensor's is part of a study's model alone."""
    first = next(iter(told["parameters"]))
    value = told["parameters"][first]["value"]
    if site == "sensor":
        return [
            "## Use it",
            "In a study, beside the damper's own effects: `bristle add STUDY "
            f"{name}`. It acts on the {EFFECTS[name].shows} channel of the measurement; no "
            "exported damper contains it.",
        ]
    text = f'[components.{site}]\nparameters = {{ "{name}.on" = true, "{name}.{first}" = {value} }}'
    return [
        "## Switch it on",
        "In a scenario:",
        textwrap.indent(text, "    "),
        "or on the command line: "
        f"`bristle run el_centro_lugre_passive --set {site}.{name}.on=true`.",
    ]


def _properties(told: dict[str, Any]) -> str:
    words = [
        "It never gives energy to the motion."
        if told["passive"]
        else "It can give energy to the motion."
        if told["site"] != "sensor"
        else "It changes the reading, not the motion.",
        "It exerts a force at rest too."
        if not told["zero_at_rest"]
        else "At rest and without history it exerts no force."
        if told["site"] != "sensor"
        else "",
    ]
    if told["excludes"]:
        words.append(f"Not together with {', '.join(told['excludes'])}.")
    return " ".join(word for word in words if word)
