"""The child process that steps an FMU along measured inputs: a crash there is only an answer.

Inputs of t_k+1 are set before the step from t_k to t_k+1, as a source that stands before the FMU in
a scenario does it; outputs are read after the step. Files in the work folder: job.json and
inputs.npz come in; outputs.npz or trouble.json go out.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..errors import BristleError, FmuError, RunError

Value = float | int | bool | str

_PACKAGES = str(Path(__file__).resolve().parents[2])
_BOOT = (
    "import sys; sys.path.insert(0, sys.argv[1]); "
    "from bristle.prediction.stepping import main; main(sys.argv[2])"
)


@dataclass(frozen=True)
class SteppingJob:
    """What to step: the FMU, values to set before, Real inputs and outputs by name.

    `steps` are those [s] of the passes, each a run of a new instance from t = 0.
    """

    fmu: str
    values: Mapping[str, Value]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    steps: tuple[float, ...]


def step_through(
    job: SteppingJob, passes: Sequence[Mapping[str, Array]], timeout: float
) -> list[dict[str, Array]]:
    """Return the outputs (n,) of each pass, from inputs (n,) in the FMU's units.

    Raises
    ------
    FmuError
        If the FMU cannot be opened, loaded or instantiated.
    RunError
        If it fails on its way, ends its process, or takes longer than `timeout` s.
    """
    with tempfile.TemporaryDirectory(prefix="bristle-", ignore_cleanup_errors=True) as folder:
        work = Path(folder)
        (work / "job.json").write_text(json.dumps(asdict(job)))
        arrays = {f"{k}:{name}": one[name] for k, one in enumerate(passes) for name in job.inputs}
        arrays |= {f"{k}:": np.array([_length(one)]) for k, one in enumerate(passes)}
        np.savez(work / "inputs.npz", **arrays)  # type: ignore[arg-type]
        code = _run(work, timeout)
        trouble = work / "trouble.json"
        if trouble.is_file():
            failure = json.loads(trouble.read_text())
            raise (FmuError if failure["kind"] == "FmuError" else RunError)(failure["text"])
        if code is None:
            raise RunError(
                f"{job.fmu}: the run took longer than {timeout:g} s and was ended. --timeout gives "
                "it more."
            )
        found = work / "outputs.npz"
        if not found.is_file():
            how = f"signal {-code}" if code < 0 else f"exit code {code}"
            raise RunError(f"{job.fmu}: the FMU ended its process ({how}) on its way.")
        with np.load(found) as kept:
            return [{n: kept[f"{k}:{n}"] for n in job.outputs} for k in range(len(passes))]


def _length(inputs: Mapping[str, Array]) -> int:
    return len(next(iter(inputs.values())))


def _run(work: Path, timeout: float) -> int | None:
    """Return the child's exit code, None if it had to be ended."""
    child = subprocess.Popen(
        [sys.executable, "-P", "-c", _BOOT, _PACKAGES, str(work)],
        cwd=work,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        return child.wait(timeout)
    except subprocess.TimeoutExpired:
        return None
    finally:
        if child.poll() is None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(child.pid, signal.SIGKILL) if sys.platform != "win32" else child.kill()
            child.wait()


def main(folder: str) -> None:
    """Do the job in a work folder; the process then ends without calling the FMU again."""
    work = Path(folder)
    try:
        found = _all_passes(work)
        np.savez(work / "part.npz", **found)  # type: ignore[arg-type]
        (work / "part.npz").replace(work / "outputs.npz")
    except BristleError as error:
        part = work / "trouble.part"
        part.write_text(json.dumps({"kind": type(error).__name__, "text": str(error)}))
        part.replace(work / "trouble.json")
    finally:
        os._exit(0)  # whatever an FMU of others would do as its library is unloaded


def _all_passes(work: Path) -> dict[str, Array]:
    from ..engine.instance import Unpacked
    from ..fmu.description import read_description

    data = json.loads((work / "job.json").read_text())
    job = SteppingJob(
        data["fmu"], data["values"], tuple(data["inputs"]), tuple(data["outputs"]),
        tuple(data["steps"]),
    )  # fmt: skip
    description = read_description(job.fmu)
    found: dict[str, Array] = {}
    with np.load(work / "inputs.npz") as kept, Unpacked() as unpacked:
        for k, step in enumerate(job.steps):
            count = int(kept[f"{k}:"][0])
            inputs = np.array([kept[f"{k}:{name}"] for name in job.inputs]).reshape(-1, count)
            rows = _one_pass(job, description, unpacked.folder(Path(job.fmu)), step, inputs)
            found |= {f"{k}:{name}": rows[:, i].copy() for i, name in enumerate(job.outputs)}
    return found


def _one_pass(
    job: SteppingJob, description: Any, folder: Path, step: float, inputs: Array
) -> Array:
    from ..engine.instance import Instance

    rows = np.empty((inputs.shape[1], len(job.outputs)))
    now, shown = np.empty(len(job.inputs)), np.empty(len(job.outputs))
    begin = dict(zip(job.inputs, inputs[:, 0].tolist(), strict=True))
    instance = Instance(Path(job.fmu).stem, description, folder, lambda message: None)
    try:
        instance.initialise({**job.values, **begin}, (len(rows) - 1) * step)
        instance.finish_initialisation()
        give, show = (
            instance.passing("Set", job.inputs, now),
            instance.passing("Get", job.outputs, shown),
        )
        for k in range(len(rows)):
            try:
                now[:] = inputs[:, k]
                give()
                if k:
                    instance.step((k - 1) * step, step)
                show()
                rows[k] = shown
            except RunError as error:
                raise RunError(f"at t = {k * step:g} s: {error}") from None
    finally:
        instance.close()
    return rows
