"""Fills fmus/ with the built-in components as FMUs: python build_fmus.py [NAME ...]"""

import sys
from pathlib import Path

from bristle.errors import BristleError
from bristle.fmu.build import build_all

if __name__ == "__main__":
    try:
        for path in build_all(Path(__file__).resolve().parent / "fmus", only=sys.argv[1:]):
            print(path)
    except BristleError as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
