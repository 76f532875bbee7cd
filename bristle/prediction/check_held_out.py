"""Run the exported FMU on the held-out runs in plain FMPy: `python check.py`.

Needs fmpy and numpy, not bristle. The force of the FMU goes through the load cell and its recorder,
as far as the model has effects of them, then through the filter of a decimated record, and gets the
zero of the load cell. Those of the velocity are in the inputs.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description, simulate_fmu

FOLDER = Path(__file__).resolve().parent


def columns(path: Path) -> dict[str, Any]:
    """Return the columns (n,) of a CSV by title without unit."""
    with path.open(encoding="utf-8") as file:
        names = [title.partition(" [")[0] for title in file.readline().strip().split(",")]
        return dict(zip(names, np.loadtxt(file, delimiter=",", ndmin=2).T, strict=True))


def force_of(proof: dict[str, Any], run: str, parts: int) -> Any:
    """Return the force (n,) [N] that the FMU gives at the samples of a run."""
    given = columns(FOLDER / f"{run}_inputs.csv")
    fmu = str(FOLDER.parent / proof["fmu"])
    inputs = [v.name for v in read_model_description(fmu).modelVariables if v.causality == "input"]
    missing = [name for name in inputs if name not in given]  # FMPy would warn of them
    given |= dict.fromkeys(missing, 0.0 * given["time"])
    rows = np.array(list(zip(*given.values(), strict=True)), dtype=[(n, float) for n in given])
    step = proof["step"]
    found = simulate_fmu(
        fmu, stop_time=float(given["time"][-1]), step_size=step, output_interval=step, input=rows,
        output=["force"], start_values=proof["start_values"][run],
    )  # fmt: skip
    time = columns(FOLDER / f"{run}_force.csv")["time"]
    moments = np.linspace(time[0], time[-1], (len(time) - 1) * parts + 1)
    force = np.interp(moments, found["time"], found["force"])
    pulse = np.array(proof["pulse_response"][run])  # of the load cell; before, the force was held
    begun = np.concatenate([np.full(len(pulse) - 1, force[0]), force])
    force = np.convolve(begun, pulse, "valid")
    taps = np.array(proof["filter"][run])
    half = len(taps) // 2  # it goes on point-symmetrically
    begin, end = 2 * force[0] - force[half:0:-1], 2 * force[-1] - force[-2 : -half - 2 : -1]
    around = np.concatenate([begin, force, end]) if half else force
    return np.convolve(around, taps, "valid")[::parts] + proof["load_cell_zero"]


def main() -> None:
    """Print the error of the FMU beside that of `bristle compare`, over the samples that count."""
    proof = json.loads((FOLDER / "proof.json").read_text(encoding="utf-8"))
    errors, forces = [], []
    for run, parts in proof["moments_per_sample"].items():
        held = columns(FOLDER / f"{run}_force.csv")
        counts = held["counts"] > 0.5
        errors.append((held["force"] - force_of(proof, run, parts))[counts])
        forces.append(held["force"][counts])
    error, force = (float(np.sqrt(np.mean(np.concatenate(y) ** 2))) for y in (errors, forces))
    told = proof["error_told"]
    print(f"FMU in FMPy: {error:.5g} N, {100.0 * error / force:.3g} % of the force")
    rms, signal = told["rms_counted"], told["signal_counted"]
    print(f"bristle compare: {rms:.5g} N, {100.0 * rms / signal:.3g} %")
    if proof["not_applied"]:
        print(f"Not applied here, not linear: {', '.join(proof['not_applied'])}")


if __name__ == "__main__":
    main()
