"""Fills fmus/ with the built-in components as FMUs."""

import argparse
import sys
from pathlib import Path

from bristle.errors import BristleError
from bristle.fmu.build import build_all
from bristle.fmu.catalogue import component_names

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="components; else all of them")
    parser.add_argument("--list", action="store_true", help="list the components, build nothing")
    given = parser.parse_args()
    try:
        if given.list:
            print("\n".join(component_names()))
        else:
            for path in build_all(Path(__file__).resolve().parent / "fmus", only=given.names):
                print(path)
    except BristleError as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
