"""The devices that no law has: they take energy, their labels matter, their files make a study."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks._odd_devices import MAKERS, Labels, write
from bristle.study.study import Study

FAR, FAST, STEP = 0.01, 0.1, 1e-4
USUAL = Labels(25.0, 1.0)


def cycles(device: str, labels: Labels) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement [m] and force of the fifth cycle of a sine at a steady current."""
    force = MAKERS[device][0](np.random.default_rng(3), FAR, FAST)(labels)
    w = FAST / FAR
    t = STEP * np.arange(round(5.0 * 2.0 * np.pi / w / STEP))
    x, v = FAR * np.sin(w * t), FAST * np.cos(w * t)
    felt = [force(*one, 1.0, STEP) for one in zip(x.tolist(), v.tolist(), strict=True)]
    return x[-len(x) // 5 :], np.array(felt)[-len(x) // 5 :]


@pytest.mark.parametrize("device", MAKERS)
def test_a_closed_cycle_takes_energy_and_both_labels_change_it(device: str) -> None:
    x, usual = cycles(device, USUAL)
    assert np.trapezoid(usual, x) > 0.0
    size = np.std(usual)
    for labels in (Labels(40.0, 1.0), Labels(25.0, 1.3)):
        change = np.sqrt(np.mean((cycles(device, labels)[1] - usual) ** 2))
        assert 0.02 * size < change < size


@pytest.mark.slow  # integrates two cases of ten runs in plain Python
def test_the_files_of_a_case_make_a_study_that_has_its_labels(tmp_path: Path) -> None:
    for case in (7, 8):  # labels in columns, labels in the files' names
        folder = tmp_path / f"lab{case}"
        folder.mkdir()
        rig = write(case, folder)
        study = Study.create(tmp_path / f"rig{case}", sorted(folder.glob("*.csv")))
        told = {name.partition("_")[0] for run in study.runs().all for name in run.labels}
        assert told >= rig.matter
