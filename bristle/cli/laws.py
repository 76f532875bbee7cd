"""List the laws that a damper can have, or describe one.

bristle laws new NAME starts your own law; bristle laws check FILE tests it.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from . import _own

if TYPE_CHECKING:
    from ..physics.law import Law

HELP = "list the laws of a damper, describe one, start or check your own"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle laws`."""
    _own.add_arguments(parser, "law")


def main(arguments: argparse.Namespace) -> int:
    """Print a table of the laws, everything about one, or start or check a user's own."""
    from ..physics import effects as _registered  # noqa: F401  (importing registers them)
    from ..physics.effect import EFFECTS
    from ..physics.laws import law_names, laws_of
    from ._law_template import template

    taken = (*law_names(), *law_names("structure"), *EFFECTS)
    own = _own.Own("law", lambda: {law.name: law for law in laws_of("damper")}, taken, template)
    return _own.main(arguments, own, tell, _print_one, _print_table)


def tell(law: type[Law]) -> dict[str, Any]:
    """Return what users are told of a law: class data, first line and formula of its text."""
    from ..physics.effect import effects_of
    from ..physics.forms import FORMS, LINEAR_FORM, choosable

    about, text = _own.text_of(law)
    free = list(choosable(law))  # quantities that may have another form
    return {
        "name": law.name,
        "about": about,
        "text": text,
        "parts": list(law.parts),
        "contains": list(law.contains),
        "command": {
            quantity: [type(form).__name__.lower(), *form.names()]
            for quantity, form in law.command.items()
        },
        "forms": {form: free for form in FORMS if form != LINEAR_FORM and free},
        "source": law.source,
        "states": dict(law.states),
        "variants": [f"{law.name}_{suffix}" for suffix in law.variants],
        "inverse": law.affine() and law.exact() and not law.felt,
        "effects": [effect.name for effect in effects_of("damper", law.name)],
        "parameters": _own.parameters_of(law),
    }


def _print_one(found: dict[str, Any]) -> None:
    print(f"{found['about']}\n")
    print(found["text"])
    print(f"\nParts: {', '.join(found['parts'])}.")
    if found["contains"]:
        print(f"Contains: {', '.join(found['contains'])}; no effect of that kind is offered.")
    for quantity, (form, *names) in found["command"].items():
        print(f"Over the voltage: {quantity} is {form}, by {', '.join(names)}.")
    if found["forms"]:
        forms = ", or ".join(f"--command {form}" for form in found["forms"])
        print(f"To be identified in another form too:  {forms}")
    print(f"Inverse for controllers: {'yes' if found['inverse'] else 'no'}.")
    print(f"Effects that join it: {', '.join(found['effects'])}.")
    print(f"Source: {found['source']}.\n")
    print("\n".join(_own.parameter_lines(found, "")))
    print(f"\nIn a study:  bristle identify STUDY --law {found['name']}")


def _print_table(rows: list[dict[str, Any]]) -> None:
    """Print the laws, each in a block of lines."""
    for row in rows:
        print(f"{row['name']}: {row['about']}")
        print(f"  parts: {', '.join(row['parts'])}")
        if row["contains"]:
            print(f"  contains: {', '.join(row['contains'])}")
        print(f"  parameters: {', '.join(_own.shortly(row))}")
        print(f"  source: {row['source']}")
    print("All of one:  bristle laws NAME")
