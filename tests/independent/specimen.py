"""A rig with what is hidden in it, put through experiments."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from .electrics import felt_voltage
from .experiments import Experiment
from .kernel import OUTPUTS, PLANT, RATES, SLIPS, _fluid, march
from .rigs import V_MAX, Rig

Array = NDArray[np.float64]
FOREVER = 10.0  # s, how long the damper rested before a run


class SpecimenError(ValueError):
    """Raised where a specimen cannot be built or its equations cannot be solved."""


@dataclass
class Specimen:
    """A rig and the fields of its effects, merged into one plant."""

    rig: Rig
    fields: dict[str, Any]
    rtol: float = 1e-9
    plant: Any = field(init=False)
    states: Array = field(init=False)
    scale: Array = field(init=False)

    def __post_init__(self) -> None:
        self.plant = _plant(self.rig, self.fields)
        p = self.plant[0]
        groups = _layout(self.rig, p, self.fields)
        start, scale = [], []
        for name in [n for n in PLANT.names if n.startswith("i_")]:
            p[name] = len(start) if name in groups else -1
            if name in groups:
                start += groups[name][0]
                scale += groups[name][1]
        self.states, self.scale = np.array(start, float), np.array(scale, float)
        if p["series_kind"] in (1, 2, 3):
            p["se_c"] = max(p["se_c"], 1.3 * _steepest_fall(p, self.rig))

    def answer(self, run: Experiment) -> dict[str, Array]:
        """Noise-free signals at the samples, each (n,), SI; `voltage` is the command.

        Raises
        ------
        SpecimenError
            If the integrator does not get through, or the answer is not finite.
        """
        h = run.step
        volts = felt_voltage(run.volts, h, self.fields)
        late = float(self.fields.get("late", 0.0))
        times, where, row_of = _stops(run, late)
        out = np.zeros((int(np.sum(row_of != 0)), len(OUTPUTS)))
        filters = np.zeros((2, 6, 4))
        filters[0] = self.fields.get("force_filter", filters[0])
        filters[1] = self.fields.get("velocity_filter", filters[1])
        lengths = slip_lengths(float(self.plant[0]["pre_len"]))
        steps, _, _ = march(
            self.plant, self.states.copy(), self.scale, self.rtol, h, times, where,
            (row_of != 0).astype(np.int64), lengths, filters, run.motion, volts, run.ground, out,
        )  # fmt: skip
        if steps < 0 or not np.all(np.isfinite(out)):
            raise SpecimenError(f"{self.rig.name}: the equations of {self.fields} were not solved")
        kind = row_of[row_of != 0]
        rows = dict(zip(OUTPUTS, out[(kind == 1) | (kind == 3)].T.copy(), strict=True))
        if late > 0.0:
            then = out[kind >= 2][:, OUTPUTS.index("force_shown")]
            early = run.time.size - then.size
            rows["force_shown"] = np.concatenate([np.full(early, out[0, 4]), then])
        rows["time"] = run.time
        rows["voltage"] = run.command()
        return rows


def slip_lengths(mean: float) -> Array:
    """Elastic travel of each slider of a Maxwell-slip chain (SLIPS,) m."""
    lengths = np.geomspace(0.15, 2.0, SLIPS)
    return lengths * max(mean, 1e-30) / lengths.mean()


def _plant(rig: Rig, fields: dict[str, Any]) -> Any:
    plant = np.zeros(1, PLANT)
    p = plant[0]
    y0, y1, c0, c1 = rig.lines
    p["law"] = int(rig.law == "lugre")
    p["y0"], p["y1"], p["c0"], p["c1"] = y0, y1, c0, c1
    p["wn"] = rig.values["v_n"]
    p["kap"], p["sg1"] = rig.values.get("a_0", 0.0), rig.values.get("sigma_1", 0.0)
    p["ff_d"] = p["vf_d"] = 1.0
    if rig.building is not None:
        b = rig.building
        p["building"] = 1
        p["mb"], p["m1"], p["m2"] = b["masses"]
        p["kb"], p["k1"], p["k2"] = b["stiffnesses"]
        p["alpha"], p["beta"] = b["alpha"], b["beta"]
    for name, value in fields.items():
        if name in PLANT.names:
            p[name] = value
    return plant


def _layout(rig: Rig, p: Any, fields: dict[str, Any]) -> dict[str, tuple[list, list]]:
    """Initial states and their scales by group, in the order of the plant's indices."""
    x, v, f = rig.stroke, rig.speed, rig.force
    groups: dict[str, tuple[list, list]] = {}
    if p["law"] == 1:
        groups["i_z"] = ([0.0], [1.0 / p["kap"]])
    elif p["pre_kind"] in (1, 2):
        groups["i_z"] = ([0.0], [1.0])
    if p["series_kind"] > 0:
        # the force follows from the stretch, far smaller than the position that is integrated
        stretch = f / p["se_k"] if p["series_kind"] < 4 else 0.1 * p["se_gap"]
        if p["series_kind"] == 5:
            stretch = min(stretch, (f / p["se_k"]) ** (1.0 / p["se_n"]))
        groups["i_y"] = ([0.0], [-0.1 * stretch])
    if p["series_kind"] >= 4 and p["law"] == 1:
        groups["i_w"] = ([0.0], [v])
    if p["series_kind"] == 3:
        groups["i_r"] = ([0.0], [-0.1 * f / p["se_k"]])
    if p["hot_kind"] > 0:
        count = 2 if p["hot_kind"] == 3 else 1
        groups["i_hot"] = ([0.0] * count, [1.0] * count)
    if p["age_kind"] > 0:
        groups["i_age"] = ([1.0], [1.0]) if p["age_kind"] == 1 else ([FOREVER], [1.0])
    if p["basset"] != 0.0:
        groups["i_bas"] = ([0.0] * RATES.size, [v] * RATES.size)
    if "force_filter" in fields:
        groups["i_ff"] = ([0.0] * 4, [f] * 4)
    if "velocity_filter" in fields:
        groups["i_vf"] = ([0.0] * 4, [v] * 4)
    if p["building"] == 1:
        groups["i_q"] = ([0.0] * 6, [0.1 * x] * 3 + [0.1 * v] * 3)
        if p["ss_kind"] == 3:
            groups["i_bw"] = ([0.0] * 2, [1.0] * 2)
        if p["bf_kind"] == 3:
            groups["i_bf"] = ([0.0], [1.0])
    if p["heat_kind"] > 0:
        groups["i_heat"] = ([0.0], [0.1 * x if p["heat_kind"] == 1 else 0.1])
    if p["cav_kind"] == 2:
        groups["i_void"] = ([0.0], [0.1 * p["cav_len"]])
    return groups


def _steepest_fall(p: Any, rig: Rig) -> float:
    """Steepest fall of the fluid's force over speed, N s/m: a series damping must exceed it."""
    w = np.geomspace(1e-3, 3.0, 400) * rig.speed
    z = 1.0 if p["law"] == 0 else 1.0 / p["kap"]
    worst = 0.0
    for e in (0.0, V_MAX):
        f = np.array([_fluid(p, 0.0, u, 1.0, e, z, 0.0, 1.0, 1.0)[0] for u in w])
        worst = max(worst, float(-np.min(np.diff(f) / np.diff(w))))
    return worst


def _stops(run: Experiment, late: float) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Stops of the integrator; code 0 nothing, 1 a sample, 2 a late output, 3 both."""
    t, h = run.time, run.step
    n = t.size
    times, where = [t], [np.minimum(np.arange(n), n - 2)]
    codes = [np.ones(n, np.int64)]
    if run.motion.shape[1] == n - 1:
        turns, intervals = _reversals(run)
        times.append(turns)
        where.append(intervals)
        codes.append(np.zeros(turns.size, np.int64))
    if late > 0.0:
        then = t[t >= late] - late
        k = np.minimum((then / h + 1e-9).astype(int), n - 2)
        on = np.abs(then - t[k]) < 1e-9
        codes[0][k[on]] = 3
        times.append(then[~on])
        where.append(k[~on])
        codes.append(np.full(int(np.sum(~on)), 2, np.int64))
    all_times = np.concatenate(times)
    order = np.argsort(all_times, kind="stable")
    return (
        all_times[order],
        np.concatenate(where)[order].astype(np.int64),
        np.concatenate(codes)[order],
    )


def _reversals(run: Experiment) -> tuple[Array, NDArray[np.int64]]:
    """Instants at which a prescribed velocity changes its sign inside a sample interval."""
    h, c = run.step, run.motion
    v0 = c[1]
    v1 = sum(m * c[m] * h ** (m - 1) for m in range(1, 6))
    turns, intervals = [], []
    for k in np.flatnonzero(v0 * v1 < 0.0):
        slope = [m * c[m, k] for m in range(5, 0, -1)]
        turns.append(run.time[k] + brentq(lambda q, s=slope: np.polyval(s, q), 0.0, h, xtol=1e-14))
        intervals.append(k)
    return np.array(turns), np.array(intervals, np.int64)
