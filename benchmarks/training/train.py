"""Train a policy on ground motions, and write its controller file: `python -m benchmarks train`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bristle.errors import BristleError, DesignError

from .design import design_policy
from .training import read_policy_task


def main(given: Sequence[str]) -> int:
    """Train, write the controller file, and print what the training reached."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks train", description=__doc__)
    parser.add_argument("file", type=Path, metavar="FILE", help="design file, TOML, with [motions]")
    parser.add_argument(
        "--out", type=Path, metavar="FILE.json", help="controller file; else as the design file"
    )
    arguments = parser.parse_args(given)
    out: Path = arguments.out or Path(arguments.file.stem + ".json")
    try:
        if out.suffix != ".json":
            raise DesignError(f"{out}: a controller file is named FILE.json.")
        controller = design_policy(read_policy_task(arguments.file)).controller
        controller.save(out)
    except BristleError as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        return error.exit_code
    print(f"policy: {controller.n} states, sampled at {controller.sample_period:g} s")
    _show(controller.facts)
    print(f"  {out}\nBake it in:  bristle build TrainedPolicy --controller {out}")
    return 0


def _show(facts: Mapping[str, Any]) -> None:
    def below(key: str) -> str:
        return f"{100 * (1 - facts[key]):.1f} % below clipped-optimal control"

    print(f"  {facts['weights']} weights, trained on {facts['motions']} motions: peak "
          f"{below('peak_ratio_trained')} on the mean")  # fmt: skip
    print(f"  {facts['held_out']} motions held out, which chose round {facts['chosen_round']}: "
          f"{below('peak_ratio')}")  # fmt: skip
    print(f"  the same with noise, delay and wrong parameters: {below('peak_ratio_disturbed')}")
