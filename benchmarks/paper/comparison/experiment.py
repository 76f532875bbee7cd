"""The runs of the comparison: motions, intensities and laws, and what each run comes to."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bristle.physics.building import frequencies, paper_building
from bristle.physics.laws import law_code
from bristle.physics.laws.lugre import LuGre

from ..runs import Runs

if TYPE_CHECKING:
    import pandas as pd

    from bristle.synthesis import Controller

G = 9.81  # m/s2, as in the paper
KAPPA = 0.45
"""Share of the nominal peak that the ground motion is run with: a reconstruction."""
STEP = 0.002
"""Rows of a run [s]: 500 Hz, as the paper samples."""

NONE, ZERO, FOUR = "no damper", "0 V", "4 V"
CLIPPED, HINF, LPV = "clipped-optimal", "H-infinity + inverse", "LPV"
BINGHAM = "H-infinity + Bingham inverse"
LPV_0, LPV_400 = "LPV, λ = 0", "LPV, λ = 400"
LAWS = (NONE, ZERO, FOUR, CLIPPED, HINF, LPV)
"""The columns of the comparison; LPV has the anti-windup rate λ = 200 1/s."""
CONTROLLERS = (CLIPPED, HINF, LPV)
OTHERS = (BINGHAM, LPV_0)
"""Further laws, which single statements are about."""

EL_CENTRO, SYLMAR, NEWHALL = "El Centro", "Northridge (Sylmar)", "Northridge (Newhall)"

QUANTITIES = {
    "base drift": ("structure.base_displacement", "mm", 1e3),
    "base acceleration": ("structure.base_acceleration_absolute", "m/s2", 1.0),
    "floor 1 acceleration": ("structure.floor1_acceleration_absolute", "m/s2", 1.0),
    "floor 2 acceleration": ("structure.floor2_acceleration_absolute", "m/s2", 1.0),
    "damper force": ("damper.force", "N", 1.0),
    "voltage": ("", "V", 1.0),
}
"""What is tabled: the column of a run, the unit it is shown in, the factor to that unit."""
BEYOND = "drift beyond stroke [mm]"
"""Column of the table: how far the base drifts beyond the damper's stroke; 0 without a damper."""

_PLANTS: dict[str, tuple[str, dict[str, object]]] = {
    NONE: ("no_damper", {}),
    ZERO: ("el_centro_0p6g_constant_voltage", {"voltage.level": 0.0}),
    FOUR: ("el_centro_0p6g_constant_voltage", {"voltage.level": 4.0}),
    CLIPPED: ("el_centro_0p6g_clipped", {}),
    HINF: ("el_centro_0p6g_hinf", {}),
    BINGHAM: ("el_centro_0p6g_hinf", {"controller.inverse": "bingham"}),
    LPV: ("el_centro_0p6g_lpv", {"controller.anti_windup": 200.0}),
    LPV_0: ("el_centro_0p6g_lpv", {"controller.anti_windup": 0.0}),
    LPV_400: ("el_centro_0p6g_lpv", {"controller.anti_windup": 400.0}),
}
_DESIGNS = {CLIPPED: "hinf", HINF: "hinf", BINGHAM: "hinf", LPV: "lpv", LPV_0: "lpv",
            LPV_400: "lpv"}  # fmt: skip


@dataclass(frozen=True)
class Motion:
    """A ground motion: its record, the nominal intensities [g], the weak one first, and windows.

    RMS values are over `window` [s], the record as published; the paper's own is `paper_window`.
    """

    name: str
    record: str
    intensities: tuple[float, ...]
    window: float
    paper_window: float


def motions(newhall: Path | None = None) -> tuple[list[Motion], str]:
    """Return the ground motions at hand, and in words what is left out for want of a record.

    Raises
    ------
    RecordError
        If the Newhall file cannot be read.
    """
    from bristle.data import read_ground_motion
    from bristle.errors import RecordError

    found = [Motion(EL_CENTRO, "el_centro_1940_ns", (0.2, 0.4, 0.6, 0.8), 31.18, 35.0)]
    left_out = []
    try:
        read_ground_motion("northridge_1994_sylmar_360", Path())
        found.append(Motion(SYLMAR, "northridge_1994_sylmar_360", (0.3, 0.7), 59.98, 20.0))
    except RecordError as error:
        left_out.append(f"{SYLMAR}: {error}")
    if newhall is None:
        left_out.append(f"{NEWHALL}: its file was not given (--newhall FILE.AT2).")
    else:
        read_ground_motion(str(newhall.absolute()), Path())
        found.append(Motion(NEWHALL, str(newhall.absolute()), (0.3, 0.7), 39.98, 20.0))
    return found, " ".join(left_out)


@dataclass
class Comparison:
    """What the runs came to.

    `table` has a row per motion, intensity and law (see `measured`); `frames` the runs that are
    drawn, by (motion, intensity, law); `left_out` says which motions were not at hand.
    """

    motions: list[Motion]
    left_out: str
    table: pd.DataFrame
    frames: dict[tuple[str, float, str], pd.DataFrame] = field(default_factory=dict)

    @property
    def strong(self) -> tuple[str, float]:
        """Motion and intensity [g] that stand for the paper's strong Northridge case."""
        names = [motion.name for motion in self.motions]
        chosen = next((name for name in (NEWHALL, SYLMAR) if name in names), EL_CENTRO)
        return chosen, max(next(m for m in self.motions if m.name == chosen).intensities)


def cases(found: Iterable[Motion]) -> list[tuple[Motion, float, str]]:
    """Return every run: motion, intensity [g], law."""
    listed = []
    for motion in found:
        for intensity in motion.intensities:
            laws = [*LAWS, *OTHERS]
            if intensity == max(motion.intensities):
                laws.append(LPV_400)
            listed += [(motion, intensity, law) for law in laws]
    # Runs of one kind together: compiled code is loaded once for each.
    return sorted(listed, key=lambda case: case[2] in _DESIGNS)


def compare(
    found: list[Motion], left_out: str, controllers: Callable[[], dict[str, Path]], runs: Runs
) -> Comparison:
    """Run every case and measure it.

    Parameters
    ----------
    found, left_out
        As `motions` gives them.
    controllers : callable
        () -> controller files of "hinf" and "lpv"; asked when the first is needed, after all runs
        without one.
    runs : Runs
    """
    import pandas as pd

    rows, frames = [], {}
    for motion, intensity, law in cases(found):
        files = controllers() if law in _DESIGNS else {}
        frame = runs(*scenario(motion, intensity, law, files))
        rows.append(measured(frame, motion, intensity, law))
        frames[motion.name, intensity, law] = frame
    return Comparison(found, left_out, pd.DataFrame(rows), frames)


def scenario(
    motion: Motion, intensity: float, law: str, controllers: dict[str, Path]
) -> tuple[str, dict[str, object]]:
    """Return the stock scenario and the overrides of a case.

    Parameters
    ----------
    motion : the ground motion
    intensity : nominal peak [g]
    law : one of `LAWS`, `OTHERS` or `LPV_400`
    controllers : files of the controllers "hinf" and "lpv", of those that the law needs
    """
    name, settings = _PLANTS[law]
    overrides: dict[str, object] = {
        "run.stop": max(motion.window, motion.paper_window),
        "run.step": STEP,
        "ground.record": motion.record,
        "ground.peak": intensity * G,
        "ground.factor": KAPPA,
        **settings,
    }
    if law in _DESIGNS:
        overrides["controller.controller"] = str(controllers[_DESIGNS[law]])
    return name, overrides


def measured(frame: pd.DataFrame, motion: Motion, intensity: float, law: str) -> dict[str, Any]:
    """Return the row of a run.

    Parameters
    ----------
    frame : the run's results, indexed by time [s], in SI
    motion, intensity, law : the case; intensity in g

    Returns
    -------
    dict
        Keys are "motion", "intensity [g]", "law"; of each quantity "peak ...", "rms ..." over the
        record and "paper window rms ..." over the paper's window; `BEYOND`; "peak command" before
        limits, in the command's unit; "between", the share of samples at which the voltage lies
        between 0 and 8 V.
    """
    row: dict[str, Any] = {"motion": motion.name, "intensity [g]": intensity, "law": law}
    time = frame.index.to_numpy()
    record, paper = (time <= end + 1e-9 for end in (motion.window, motion.paper_window))
    for quantity, (column, unit, factor) in QUANTITIES.items():
        values = _values(frame, column, quantity) * factor
        row[f"peak {quantity} [{unit}]"] = float(np.abs(values).max())
        row[f"rms {quantity} [{unit}]"] = _rms(values[record])
        row[f"paper window rms {quantity} [{unit}]"] = _rms(values[paper])
    row[BEYOND] = _beyond_stroke(frame, row["peak base drift [mm]"])
    voltage = _values(frame, "", "voltage")
    row["between"] = float(np.mean((voltage > 1e-9) & (voltage < 8.0 - 1e-9)))
    command = frame.get("controller.command_raw")
    row["peak command"] = 0.0 if command is None else float(command.abs().max())
    return row


def _values(frame: pd.DataFrame, column: str, quantity: str) -> np.ndarray[Any, Any]:
    if quantity == "voltage":
        column = next((str(name) for name in frame if str(name).endswith(".voltage")), "")
    if column not in frame:  # no damper: no force, no voltage
        return np.zeros(len(frame))
    values: np.ndarray[Any, Any] = frame[column].to_numpy()
    return values


def _beyond_stroke(frame: pd.DataFrame, drift: float) -> float:
    """Return by how much a drift exceeds the stroke of the run's damper, in the drift's unit."""
    if "damper.stroke_ratio" not in frame:
        return 0.0
    ratio = float(frame["damper.stroke_ratio"].max())
    return drift * (1.0 - 1.0 / ratio) if ratio > 1.0 else 0.0


def _rms(values: np.ndarray[Any, Any]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


# Numbers of the model and of the designs, for the ledger and the report's text.

SPEEDS = tuple(float(v) for v in np.linspace(0.0025, 0.2, 80))
"""m/s, at which the steady force is taken."""
VOLTAGES = (0.0, 4.0, 8.0)


def facts(designs: dict[str, Controller], motions: list[Motion]) -> dict[str, Any]:
    """Return what the ledger asks of the model and of the designs "hinf" and "lpv".

    Keys: "sample_period" [s], "stroke" [m], "k_b" [N/m], "frequencies" [Hz], "first_mode" [rad/s],
    "damping_ratio" of the first mode [1], "speeds" [m/s], "steady" {voltage [V]: forces [N]},
    "force_at_8V" [N], "weight_corner" [rad/s], "paper_windows" {motion: s}, "designs" (facts of
    each).
    """
    from bristle.fmu import catalogue

    building = paper_building()
    own = frequencies(building)
    steady = {V: [steady_force(v, V) for v in SPEEDS] for V in VOLTAGES}
    K = np.array(building.K)
    weight = designs["hinf"].design["weights"]["acceleration"]
    return {
        "sample_period": designs["lpv"].sample_period,
        "stroke": catalogue.instantiate("LuGreDamper")["stroke"],
        "k_b": float(K[0].sum()),
        "frequencies": [float(value) for value in own],
        "first_mode": 2.0 * np.pi * float(own[0]),
        "damping_ratio": first_damping_ratio(building),
        "speeds": list(SPEEDS),
        "steady": steady,
        "force_at_8V": max(steady[8.0]),
        "weight_corner": corner(weight),
        "paper_windows": {motion.name: motion.paper_window for motion in motions},
        "designs": {kind: dict(design.facts) for kind, design in designs.items()},
    }


def steady_force(v: float, V: float) -> float:
    """Return the LuGre force [N] in steady sliding at v [m/s] and V [V]."""
    from bristle.component.control_laws import force_of_law

    p = [parameter.value for parameter in LuGre.parameters.values()]
    bent = 1.0 / LuGre.parameters["a_0"].value
    return force_of_law(law_code(LuGre.name), p, v, V, [bent])


def first_damping_ratio(building: Any) -> float:
    """Return the damping ratio of the first mode [1], from the poles."""
    M, C, K = (np.array(matrix) for matrix in (building.M, building.C, building.K))
    n = len(M)
    lower = -np.linalg.solve(M, np.hstack([K, C]))
    poles = np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]))
    slowest = poles[np.argmin(np.abs(poles))]
    return float(-slowest.real / abs(slowest))


def corner(weight: dict[str, Any]) -> float:
    """Return the corner of a low-pass weight [rad/s]: the size of its slowest pole."""
    return float(np.abs(np.roots(weight["denominator"])).min())
