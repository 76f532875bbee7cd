"""Fills fmus/ with the built-in components as FMUs."""

import os
import sys
from pathlib import Path

from bristle.cli._options import Parser, builder
from bristle.errors import BristleError
from bristle.fmu.build import plan
from bristle.fmu.catalogue import component_names

if __name__ == "__main__":
    parser = Parser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="components; else all of them")
    parser.add_native()
    parser.add_argument("--list", action="store_true", help="list the components, build nothing")
    given = parser.parse_args()
    try:
        if given.list:
            print("\n".join(component_names()))
        else:
            folder = Path(__file__).resolve().parent / "fmus"
            build, folder = builder(given), folder / "native" if given.native else folder
            folder = folder / "fmi3" if given.fmi == 3 else folder
            for name in given.names or component_names():
                print(os.path.relpath(build(plan(name), folder)), flush=True)
    except BristleError as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
