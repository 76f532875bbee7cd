"""Planted sensor faults are found with their value; clean channels show none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.signal import cont2discrete, lfilter, lfilter_zi

from bristle.core.text import quantity
from bristle.data.channels import ChannelSpec
from bristle.data.measurement import measurements_of_frame
from bristle.diagnosis.prepared import corrected
from bristle.diagnosis.sensor_faults import as_json, clipped, sensor_faults
from bristle.diagnosis.words import fault_rows

STEP, SECONDS, NOISE = 0.002, 10.0, 0.01
T = STEP * np.arange(round(SECONDS / STEP))


def motion(seed, late=0.0):
    """Return displacement [m] and its exact rate [m/s] of a sum of sines; the rate `late` s."""
    random = np.random.default_rng(seed)
    w = 2.0 * np.pi * random.uniform(0.3, 5.0, 12)
    phase, size = random.uniform(0.0, 6.28, 12), 0.01 / w
    x = size @ np.sin(w[:, None] * T + phase[:, None])
    v = (size * w) @ np.cos(w[:, None] * (T - late) + phase[:, None])
    return x, v


def measured(seed, late=0.0, spoil=lambda channels: None, after=lambda channels: None, every=1):
    """Return a run of a yielding damper; `spoil` acts before the noise is added, `after` then.

    Of its samples one of `every` is kept.
    """
    x, v = motion(seed, late)
    _, true = motion(seed)
    V = 2.0 + 1.5 * np.sin(1.7 * T)
    F = (1.3 + 0.8 * V) * np.tanh(true / 2e-3) + 100.0 * true
    channels = {"displacement": x, "velocity": v, "voltage": V, "force": F}
    spoil(channels)
    random = np.random.default_rng([seed, 1])
    noise = {name: float(NOISE * np.std(values)) for name, values in channels.items()}
    channels = {k: y + noise[k] * random.standard_normal(len(T)) for k, y in channels.items()}
    after(channels)
    titles = {"displacement": "m", "velocity": "m/s", "voltage": "V", "force": "N"}
    columns = {f"{name} [{titles[name]}]": values for name, values in channels.items()}
    frame = pd.DataFrame({"time [s]": T, **columns}).iloc[::every]
    specs = {
        name: ChannelSpec(column=f"{name} [{unit}]", noise=noise[name])
        for name, unit in titles.items()
    }
    (run,) = measurements_of_frame(frame, f"run_{seed}", {"time": ChannelSpec("time [s]"), **specs})
    return run


def only(faults):
    """Return the one fault there is."""
    assert len(faults) == 1, [(one.channel, one.kind, one.value) for one in faults]
    return faults[0]


def runs(**choices):
    return [measured(seed, **choices) for seed in (1, 2, 3)]


@pytest.mark.parametrize("seed", range(20))
def test_clean_channels_show_no_fault(seed):
    assert sensor_faults([measured(100 + seed), measured(200 + seed)]) == []


@pytest.mark.parametrize("gain", [0.93, 1.05, 1.2])
def test_a_gain(gain):
    fault = only(sensor_faults(runs(spoil=lambda c: c.update(velocity=gain * c["velocity"]))))
    assert (fault.channel, fault.kind) == ("velocity", "gain")
    assert fault.value == pytest.approx(gain, abs=max(3.0 * fault.std, 0.003))


@pytest.mark.parametrize("late", [0.003, 0.008])
def test_a_late_velocity(late):
    fault = only(sensor_faults(runs(late=late)))
    assert (fault.channel, fault.kind) == ("velocity", "delay")
    assert fault.value == pytest.approx(late, rel=0.1)


@pytest.mark.parametrize("order", [1, -1])
def test_a_late_velocity_of_runs_with_different_rates(order):
    fast, slow = runs(late=0.0012), [measured(9, late=0.0012, every=4)]
    fault = only(sensor_faults([*fast, *slow][::order]))
    assert fault.channel == "velocity"  # less than a sample: whether it is rounded is not sure
    assert fault.value == pytest.approx(0.0012, rel=0.1)


def test_a_late_displacement():
    fault = only(sensor_faults(runs(late=-0.004)))
    assert (fault.channel, fault.kind) == ("displacement", "delay")
    assert fault.value == pytest.approx(0.004, rel=0.1)


@pytest.mark.parametrize("bias", [-0.006, 0.004])
def test_a_bias_of_the_velocity(bias):
    fault = only(sensor_faults(runs(spoil=lambda c: c.update(velocity=c["velocity"] + bias))))
    assert (fault.channel, fault.kind) == ("velocity", "bias")
    assert fault.value == pytest.approx(bias, rel=0.1)


@pytest.mark.parametrize("channel", ["displacement", "velocity"])
def test_a_turned_motion(channel):
    found = sensor_faults(runs(spoil=lambda c: c.update({channel: -c[channel]})))
    assert [one.kind for one in found] == ["sign"]


@pytest.mark.parametrize("channel", ["force", "voltage"])
def test_a_turned_force_or_voltage(channel):
    fault = only(sensor_faults(runs(spoil=lambda c: c.update({channel: -c[channel]}))))
    assert (fault.channel, fault.kind, fault.value) == (channel, "sign", -1.0)


@pytest.mark.parametrize("channel", ["force", "displacement", "velocity"])
def test_a_clipped_channel(channel):
    def clip(channels):
        values = channels[channel]
        level = 0.7 * np.max(np.abs(values))
        channels[channel] = np.clip(values, -level, level)

    all_runs = runs(after=clip)
    fault = only(sensor_faults(all_runs))
    assert (fault.channel, fault.kind) == (channel, "clipping")
    assert fault.value == pytest.approx(max(np.max(np.abs(one[channel])) for one in all_runs))


def test_a_force_that_is_clipped_in_one_run_names_it_and_both_ends():
    plain = runs()
    force = plain[1].channels["force"]
    top = float(np.max(np.abs(force)))
    spoilt = replace(
        plain[1], channels={**plain[1].channels, "force": np.clip(force, -0.6 * top, 0.5 * top)}
    )
    fault = only(clipped([plain[0], spoilt, *plain[2:]]))
    assert fault.runs == (spoilt.name,)
    ends = f"{quantity(-0.6 * top, 'N', 4)} and {quantity(0.5 * top, 'N', 4)}"
    assert fault.text.endswith(f"in {spoilt.name}: its range ended at {ends}.")
    assert fault_rows({"sensors": [as_json(fault)]})[0][-1] == spoilt.name
    assert as_json(replace(fault, value=np.float64(fault.value))) == as_json(fault)


@pytest.mark.parametrize("tau", [0.004, 0.01])
def test_a_velocity_that_lags(tau):
    def lag(channels):
        part = STEP / tau
        # Bilinear, so that the discrete filter has the same lag as the continuous one.
        b, a = [part, part], [2.0 + part, part - 2.0]
        v = channels["velocity"]
        channels["velocity"] = lfilter(b, a, v, zi=[v[0] * (1.0 - b[0] / a[0])])[0]

    fault = only(sensor_faults(runs(spoil=lag)))
    assert (fault.channel, fault.kind) == ("velocity", "lag")
    assert fault.value == pytest.approx(tau, rel=0.15)


def test_mended_channels_show_no_fault():
    spoilt = runs(late=0.006, spoil=lambda c: c.update(velocity=1.1 * c["velocity"]))
    found = sensor_faults(spoilt)
    assert {one.kind for one in found} == {"gain", "delay"}
    assert sensor_faults(corrected(spoilt, found)) == []


def test_a_channel_that_stands_at_its_ends_nearly_always_is_clipped_too():
    def clip(channels):
        level = 0.15 * np.max(np.abs(channels["force"]))
        channels["force"] = np.clip(channels["force"], -level, level)

    fault = only(sensor_faults(runs(after=clip)))
    assert (fault.channel, fault.kind) == ("force", "clipping")


def test_a_channel_cut_on_one_side():
    def clip(channels):
        channels["force"] = np.minimum(channels["force"], 0.6 * np.max(channels["force"]))

    spoilt = runs(after=clip)
    fault = only(sensor_faults(spoilt))
    assert (fault.channel, fault.kind) == ("force", "clipping")
    for before, after in zip(spoilt, corrected(spoilt, [fault]), strict=True):
        cut = before["force"] == before["force"].max()
        told, level = after.valid("force"), before["force"].max()
        assert not told[cut].any()
        far = before["force"] < level - 5.0 * before.noise["force"]
        assert told[far].all()
        assert after.valid("displacement").all()


def test_noise_that_comes_after_the_cut_is_lost_with_it():
    level = []

    def clip(channels):
        end = 0.6 * np.max(np.abs(channels["force"]))
        noise = 0.01 * end * np.random.default_rng(len(level)).standard_normal(5000)
        channels["force"] = np.clip(np.clip(channels["force"], -end, end) + noise, -end, end)
        level.append(end)

    spoilt = runs(after=clip)
    fault = only([one for one in sensor_faults(spoilt) if one.kind == "clipping"])
    for after, end in zip(corrected(spoilt, [fault]), level, strict=True):
        beyond = np.abs(after["force"]) > 0.985 * end
        assert beyond.sum() > 100
        assert np.mean(after.valid("force")[beyond]) < 0.1


def test_a_coarse_instrument_is_not_clipped():
    def coarse(channels):
        for name in ("displacement", "velocity"):
            step = np.max(np.abs(channels[name])) / 40.0
            channels[name] = step * np.round(channels[name] / step)

    assert [one for one in sensor_faults(runs(after=coarse)) if one.kind == "clipping"] == []


def test_a_rest_at_the_end_of_the_stroke_is_not_clipped():
    def parked(channels):
        channels["displacement"] = channels["displacement"] - channels["displacement"].min()
        channels["displacement"][:150] = 0.0  # read without noise: the instrument's steps are wider

    assert [one for one in sensor_faults(runs(after=parked)) if one.kind == "clipping"] == []


def test_a_turned_displacement_is_told_by_the_force():
    fault = only(sensor_faults(runs(spoil=lambda c: c.update(displacement=-c["displacement"]))))
    assert (fault.channel, fault.kind) == ("displacement", "sign")
    fault = only(sensor_faults(runs(spoil=lambda c: c.update(velocity=-c["velocity"]))))
    assert (fault.channel, fault.kind) == ("velocity", "sign")


def test_a_turned_velocity_with_an_offset_is_corrected():
    whole = runs(spoil=lambda c: c.update(velocity=0.005 - c["velocity"]))
    found = sensor_faults(whole)
    assert {one.kind for one in found} == {"sign", "bias"}
    assert sensor_faults(corrected(whole, found)) == []


def test_a_gain_names_the_other_channel_too():
    fault = only(sensor_faults(runs(spoil=lambda c: c.update(velocity=1.1 * c["velocity"]))))
    assert fault.either == "displacement"


@pytest.mark.parametrize("damping", [0.6, 0.7, 0.9])
def test_a_velocity_behind_an_instrument_of_second_order(damping):
    corner = 2.0 * np.pi * 16.0

    def lag(channels):
        # Exact for samples held linear: far inside the band of the motion.
        system = cont2discrete(
            ([corner**2], [1.0, 2.0 * damping * corner, corner**2]), STEP, method="bilinear"
        )
        b, a = np.ravel(system[0]), np.ravel(system[1])
        v = channels["velocity"]
        channels["velocity"] = lfilter(b, a, v, zi=lfilter_zi(b, a) * v[0])[0]

    fault = only(sensor_faults(runs(spoil=lag)))
    assert (fault.channel, fault.kind) == ("velocity", "lag")
    assert fault.value == pytest.approx(2.0 * damping / corner, rel=0.1)


def test_runs_too_short_for_a_spread_show_no_fault_of_the_motion():
    short = [replace(one, time=one.time[:300], channels=cut(one.channels, 300),
                     measured=one.measured[:300]) for one in runs()]  # fmt: skip
    assert sensor_faults(short) == []


def cut(channels, n):
    return {name: values[:n] for name, values in channels.items()}


def test_a_velocity_of_another_motion():
    fault = only(sensor_faults(runs(spoil=lambda c: c.update(velocity=c["velocity"][::-1].copy()))))
    assert fault.kind == "unrelated"
