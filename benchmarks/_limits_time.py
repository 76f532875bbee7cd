"""Diagnoses a study, and prints the seconds [s] that its limits took and those of all the rest."""

from __future__ import annotations

import sys
import time
from typing import Any

from bristle import cli
from bristle.diagnosis import diagnosis


def main(study: str) -> int:
    """Diagnose; return the exit code of the command."""
    limits, spent = diagnosis.effect_limits, 0.0

    def timed(*given: Any) -> Any:
        nonlocal spent
        begin = time.perf_counter()
        found = limits(*given)
        spent += time.perf_counter() - begin
        return found

    diagnosis.effect_limits = timed
    begin = time.perf_counter()
    code = cli.main(["diagnose", study, "--quiet"])
    whole = time.perf_counter() - begin
    print(f"{spent:.3f} {whole - spent:.3f}")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
