"""The picture of the data check: every run is in it, each where its time has come."""

import numpy as np
import pandas as pd
import pytest

from bristle.data.measurement import measurements_of_frame
from bristle.study.pictures import draw_data_check

DT = 0.01


def runs(*lengths: float):
    made = []
    for number, length in enumerate(lengths):
        t = np.arange(0.0, length, DT)
        columns = {
            "time [s]": t,
            "displacement [m]": 0.01 * np.sin(t),
            "force [N]": np.cos(t) * (number + 1.0),
        }
        made += measurements_of_frame(pd.DataFrame(columns), name=f"run_{number}")
    return made


def strips(figure):
    return [axes for axes in figure.axes if axes.get_title(loc="left").startswith("force [N]")]


def test_all_runs_stand_one_after_the_other():
    page = draw_data_check(runs(4.0, 6.0, 2.0))
    force, *_ = strips(page.figure)
    pieces = [line for line in force.lines if len(line.get_xdata()) > 2]
    begins = [float(line.get_xdata()[0]) for line in pieces]
    assert begins == pytest.approx([0.0, 4.0 - DT, 10.0 - 2 * DT])
    peaks = [float(np.max(np.abs(line.get_ydata()))) for line in pieces]
    assert peaks == pytest.approx([1.0, 2.0, 3.0], rel=1e-3)
    texts = [text.get_text() for axes in page.figure.axes for text in axes.texts]
    assert texts == ["run_0", "run_1", "run_2"]


def test_names_of_many_short_runs_are_left_out():
    page = draw_data_check(runs(*[1.0] * 15, 20.0))
    texts = [text.get_text() for axes in page.figure.axes for text in axes.texts]
    assert texts == ["run_15"]
