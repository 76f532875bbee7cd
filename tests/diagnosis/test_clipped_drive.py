"""A voltage that was clipped throughout a run costs that run, not the diagnosis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_starts import LAW, recorded_rig

from bristle.core.finding import Finding
from bristle.diagnosis import diagnose_rig, rig_runs
from bristle.model.model import Model


def test_no_run_left_is_a_verdict_of_insufficiency(monkeypatch):
    runs = recorded_rig((), {})
    cut = Finding(
        "clipping",
        "warning",
        "The voltage stands at its end.",
        channel="voltage",
        value=1.0,
        std=0.0,
    )
    monkeypatch.setattr(rig_runs, "sensor_faults", lambda _runs: [cut])
    every = [replace(run, channels={**run.channels, "voltage": np.ones(3000)}) for run in runs]
    found = diagnose_rig(every[:2], every[2:], Model("bingham", values=LAW), identified=True)
    assert found.kind == "insufficient"
    assert "No run for training has the 200 samples that a fit needs." in found.words
    name = every[0].name
    assert f"{name}: of voltage 0 of 3,000 samples can be used (3,000 saturated)" in found.words
    assert "measure with a wider range" in found.words
    assert found.sensors == (cut,)
