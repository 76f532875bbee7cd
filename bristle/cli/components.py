"""List the built-in components, or start your own controller.

bristle components new NAME writes NAME.py; bristle build NAME.py makes an FMU of it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "list the components, or start your own controller"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle components`."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "action",
        nargs="?",
        choices=("new",),
        help="write a new controller; without it, list the components",
    )
    parser.add_argument(
        "name", nargs="?", metavar="NAME", help="with new: the name of your controller"
    )
    parser.add_argument("--json", action="store_true", help="print as JSON")


def main(arguments: argparse.Namespace) -> int:
    """List the components, or write the file of a new controller, which works as it is."""
    from ..errors import BuildError

    if arguments.action is None:
        from .list_ import main as list_them

        return list_them(argparse.Namespace(
            topic="components", name=None, building=None, json=arguments.json
        ))  # fmt: skip
    if arguments.name is None:
        raise BuildError("bristle components new NAME is right.")
    file, component = _new(arguments.name)
    if arguments.json:
        import json

        print(json.dumps({"file": str(file.absolute()), "component": component}))
    else:
        print(f"{file}: a controller that works as it is. Change it, then:  bristle build {file}")
    return 0


def _new(name: str) -> tuple[Path, str]:
    """Write the file; return it and the name of the component in it."""
    from ..errors import BuildError
    from ..fmu.catalogue import component_names
    from ._controller_template import class_name, template

    if not name.isidentifier() or not name.isascii() or name != name.lower() or name[:1] == "_":
        raise BuildError(f'"{name}": a name of small letters, digits and _ is right.')
    component = class_name(name)
    if component in component_names():
        raise BuildError(f'"{name}": {component} is a built-in component; take another name.')
    file = Path(f"{name}.py")
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(template(name))
    except FileExistsError:
        raise BuildError(f"{file} is there already; another name, or remove it.") from None
    except OSError as error:
        raise BuildError(f"{file}: cannot be written ({error.strerror or error}).") from None
    return file, component
