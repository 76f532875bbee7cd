"""Figures: what is drawn, from which numbers, and what cannot be drawn or written."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
import pytest

from benchmarks.paper import stiction
from benchmarks.paper.command import main
from benchmarks.paper.figures import make
from bristle.engine.results import summarise
from bristle.engine.view import draw_run, run_figure
from bristle.errors import RunError

# The sine loops at 2 Hz, 0.1 m/s: largest force [N] and energy per cycle [J] of an independent
# integration at tight tolerance.
LOOPS = {
    ("LuGre", 0.0): (2.034849, 0.0394721),
    ("LuGre", 2.0): (3.987894, 0.0815347),
    ("LuGre", 4.0): (5.940939, 0.1235973),
    ("LuGre", 8.0): (9.847029, 0.2077226),
    ("Bingham", 0.0): (2.035759, 0.0476150),
    ("Bingham", 2.0): (3.990062, 0.1029483),
    ("Bingham", 4.0): (5.944366, 0.1582816),
    ("Bingham", 8.0): (9.852973, 0.2689483),
}


def a_run(
    columns: dict[str, np.ndarray | list[float]],
    units: dict[str, str] | None = None,
    connections: str = "",
    **made: object,
) -> pd.DataFrame:
    """Return a frame as a run returns it, of the given outputs."""
    length = len(next(iter(columns.values())))
    frame = pd.DataFrame(columns, index=pd.Index(np.arange(length) * 0.01, name="time"))
    about = {"title": "A run", "scenario": f"[connections]\n{connections}"} | made
    frame.attrs.update(units=units or {}, made=about, complete=True)
    return frame


def titles(frame: pd.DataFrame) -> list[str]:
    return [axes.get_title(loc="left") for axes in draw_run(frame).figure.axes]


def notes(frame: pd.DataFrame) -> list[str]:
    return [text.get_text() for axes in draw_run(frame).figure.axes for text in axes.texts]


SINE = np.sin(np.arange(200) * 0.1) * np.linspace(1.0, 0.5, 200)
BUILDING = {
    "house.floor1_acceleration_absolute": SINE,
    "house.floor2_acceleration_absolute": 3.0 * SINE,
    "house.base_displacement": 0.004 * SINE,
}
UNITS = {
    "house.floor1_acceleration_absolute": "m/s2",
    "house.floor2_acceleration_absolute": "m/s2",
    "house.base_displacement": "m",
    "damper.force": "N",
    "damper.stroke_ratio": "1",
}


def test_a_structure_shows_its_top_floor_and_its_drift_with_units_and_peaks() -> None:
    frame = a_run(BUILDING, UNITS)
    assert titles(frame) == ["Absolute acceleration of floor 2 [m/s²]", "Base drift [mm]"]
    assert "2.88 m/s² at 0.15 s" in notes(frame)  # 3 sin(1.5) (1 - 0.5 x 15/199)


def test_a_damper_adds_its_loops_and_the_share_of_its_stroke() -> None:
    columns = {**BUILDING, "damper.force": 5.0 * SINE, "damper.stroke_ratio": 0.2 * np.abs(SINE)}
    wires = '"damper.displacement" = "house.base_displacement"'
    frame = a_run(columns, UNITS, wires)
    assert titles(frame)[2:] == ["Damper force [N] over displacement"]
    assert any(note.endswith("19 % of the damper's stroke") for note in notes(frame))


def test_the_measured_force_is_laid_behind_that_of_the_model() -> None:
    columns = {"rod.displacement": SINE, "rod.velocity": np.gradient(SINE, 0.01)}
    columns |= {"damper.force": 5.0 * SINE, "measured.value": 4.0 * SINE}
    wires = "".join(f'"damper.{of}" = "rod.{of}"\n' for of in ("displacement", "velocity"))
    axes = draw_run(a_run(columns, UNITS, wires)).figure.axes
    assert [one.get_title(loc="left") for one in axes[1:3]] == [
        "Force [N]", "Damper force [N] over displacement"
    ]  # fmt: skip
    said = [one.get_title(loc="right") for one in axes[1:]]
    assert said == ["grey: measured", *["one cycle; red: measured"] * 2]
    assert {line.get_ydata()[15] for line in axes[1].lines[1:3]} == {4.0 * SINE[15], 5.0 * SINE[15]}
    for one in axes[2:]:
        model, measured = (line.get_ydata() for line in one.lines[-3:-1])
        np.testing.assert_allclose(measured, 0.8 * model)


def test_a_voltage_is_drawn_only_if_it_varies() -> None:
    columns = {**BUILDING, "a.voltage": np.full(200, 4.0), "b.voltage": 4.0 + SINE}
    assert [title for title in titles(a_run(columns, UNITS)) if "Voltage" in title] == [
        "Voltage, b"
    ]


def test_a_fixed_building_shows_the_drift_of_its_first_storey() -> None:
    columns = {"s.floor1_acceleration_absolute": SINE, "s.drift1": SINE}
    units = {"s.floor1_acceleration_absolute": "m/s2", "s.drift1": "m"}
    assert titles(a_run(columns, units))[1] == "Drift of the first storey [mm]"


def test_what_a_connection_scales_is_drawn_as_it_arrives() -> None:
    frame = a_run(
        BUILDING | {"shaker.value": 0.1 * SINE, "damper.force": SINE}, UNITS,
        '"house.ground_acceleration" = { from = "shaker.value", factor = 9.81, offset = 0.5 }\n'
        '"damper.velocity" = { from = "shaker.value", factor = -0.2, offset = 0.0 }',
    )  # fmt: skip
    axes = draw_run(frame).figure.axes
    ground = next(line for line in axes[0].lines if line.get_color() == "#9a9a9a")
    assert np.allclose(ground.get_ydata(), 0.981 * SINE + 0.5)
    assert axes[-1].get_xlabel() == "velocity [mm/s]"
    loop = max(axes[-1].lines, key=lambda line: len(line.get_xdata()))
    assert np.allclose(loop.get_xdata(), -20.0 * SINE)


def test_outputs_that_are_not_known_are_drawn_over_time() -> None:
    frame = a_run({"plant.pressure": SINE, "plant.flow": -SINE}, {"plant.pressure": "Pa"})
    assert titles(frame) == ["plant.pressure [Pa]", "plant.flow"]


FOREIGN = """
[components.house]
fmu = "Structure"
[components.sensors]
fmu = "Sensors"
[components.held]
fmu = "SignalSource"
[components.pump]
fmu = "/others/Pump.fmu"
"""


def test_every_component_is_drawn_and_a_foreign_one_with_all_its_outputs() -> None:
    own = {
        "sensors.damper_force_measured": SINE,
        "held.value": np.ones_like(SINE),
        "pump.force": SINE,
        "pump.pressure": SINE,
        "pump.inlet": -SINE,
        "pump.idle": np.zeros_like(SINE),
    }
    units = {"pump.force": "N", "pump.pressure": "Pa", "pump.inlet": "Pa"}
    frame = a_run(BUILDING | own, UNITS | units, scenario=FOREIGN)
    assert titles(frame)[-4:] == [
        "sensors.damper_force_measured", "pump.force [N]", "pump [Pa]", "pump.idle",
    ]  # fmt: skip
    labels = [text.get_text() for axes in draw_run(frame).figure.axes if axes.get_legend()
              for text in axes.get_legend().get_texts()]  # fmt: skip
    assert labels == ["pressure", "inlet"]
    shown = [row.name for row in summarise(frame)]
    assert set(own) <= set(shown), "in the table too"
    assert "house.floor1_displacement" not in shown


def test_panels_beyond_reason_are_left_out_and_said_so() -> None:
    many = {f"pump.p{i}": SINE for i in range(20)}
    page = draw_run(a_run(many, {f"pump.p{i}": f"m{i}" for i in range(20)}, scenario=FOREIGN))
    assert len(page.figure.axes) == 12
    assert "8 further panels left out" in " ".join(text.get_text() for text in page.figure.texts)


@pytest.mark.parametrize(
    "values",
    [[0.0], [0.0, 0.0], [np.nan, np.nan], [1.0, np.inf], [1e-320, 2e-320], [1e300, -1e300]],
    ids=["one row", "zero", "nan", "inf", "tiny", "huge"],
)
def test_values_that_are_hard_to_draw_are_drawn(values: list[float], tmp_path: Path) -> None:
    run_figure(a_run({"plant.x": values}), tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "title", ["$5 and $6 per metre", "El Centro 地震", "a_b^c {", "x" * 500, ""]
)
def test_a_title_is_drawn_as_it_stands(title: str, tmp_path: Path) -> None:
    run_figure(a_run({"a$b$.x": SINE}, title=title), tmp_path / "figure.svg", title=title)
    text = (tmp_path / "figure.svg").read_text(encoding="utf-8")
    assert title[:40] in text


def test_a_run_without_real_outputs_gives_a_figure_with_its_title(tmp_path: Path) -> None:
    run_figure(a_run({"plant.fault": [0, 0, 0]}), tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 1000


def test_a_run_that_ended_early_says_so() -> None:
    frame = a_run(BUILDING, UNITS)
    frame.attrs["complete"] = False
    words = " ".join(text.get_text() for text in draw_run(frame).figure.texts)
    assert "INCOMPLETE, stopped at t = 1.99 s" in words


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_the_same_run_gives_the_same_bytes(ending: str, tmp_path: Path) -> None:
    for name in ("a", "b"):
        run_figure(a_run(BUILDING, UNITS), tmp_path / f"{name}.{ending}")
    assert (tmp_path / f"a.{ending}").read_bytes() == (tmp_path / f"b.{ending}").read_bytes()


def test_drawing_leaves_the_users_settings_alone(tmp_path: Path) -> None:
    with matplotlib.rc_context({"font.size": 23.0, "axes.grid": False}):
        before = dict(matplotlib.rcParams)
        page = draw_run(a_run(BUILDING, UNITS))
        run_figure(a_run(BUILDING, UNITS), tmp_path / "figure.png")
        assert dict(matplotlib.rcParams) == before
    assert page.figure.axes


@pytest.mark.parametrize("name", ["figure.gif", "figure"])
def test_a_format_that_is_none_is_an_error(name: str, tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"no format of a figure; there are png, svg, pdf") as caught:
        run_figure(a_run(BUILDING, UNITS), tmp_path / name)
    assert caught.value.exit_code == 2
    assert not list(tmp_path.iterdir())


def test_a_figure_that_cannot_be_written_says_where(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"gone.figure\.png: cannot be written"):
        run_figure(a_run(BUILDING, UNITS), tmp_path / "gone" / "figure.png")


# -- the paper's figures


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the figures that are drawn from the compiled laws."""
    folder = tmp_path_factory.mktemp("figures")
    for name in ("loops-voltage", "stiction"):
        make(name, folder)
    return folder


def table(folder: Path, name: str) -> pd.DataFrame:
    return pd.read_csv(folder / f"{name}.csv", comment="#")


@pytest.mark.parametrize(("law", "voltage"), LOOPS)
def test_loops_have_the_force_and_energy_of_the_reference(
    drawn: Path, law: str, voltage: float
) -> None:
    loops = table(drawn, "loops-voltage")
    loop = loops[(loops["law"] == law) & (loops["voltage [V]"] == voltage)]
    force = loop["force [N]"].to_numpy()
    energy = np.trapezoid(force, loop["displacement [m]"])
    peak, per_cycle = LOOPS[law, voltage]
    assert force.max() == pytest.approx(peak, rel=1e-4)
    assert energy == pytest.approx(per_cycle, rel=1e-3)


@pytest.mark.slow  # FMUs are stepped over many cycles: the figure by them
def test_loops_over_frequency_by_fmus_agree_with_the_law(tmp_path: Path) -> None:
    image, csv = make("loops-frequency", tmp_path, engine="fmu", format="svg")
    assert image.name == "loops-frequency.svg"
    loops = pd.read_csv(csv, comment="#")
    bingham = loops[loops["law"] == "Bingham"]
    v = bingham["velocity [m/s]"].to_numpy()
    moving = np.abs(v) > 1e-6
    law = (1.3 + 0.83 * 4) * np.sign(v) + (100 + 20 * 4) * v * np.exp(-np.abs(v) / 0.02)
    np.testing.assert_allclose(bingham["force [N]"][moving], law[moving], rtol=1e-7)
    lugre = loops[loops["law"] == "LuGre"].groupby("frequency [Hz]")["force [N]"].max()
    assert lugre.is_monotonic_decreasing
    assert lugre[1.0] == pytest.approx(bingham["force [N]"].max(), rel=1e-3)
    text = image.read_text(encoding="utf-8")
    assert "the same at every frequency" in text
    assert "reconstructed" in text


def test_stiction_peaks_stand_at_crossings_at_low_force_only(drawn: Path) -> None:
    peaks = table(drawn, "stiction_peaks")
    heights = peaks.groupby(["law", "voltage [V]"])["height [m/s2]"]
    crest = 2.7 * (1 - np.cos(2 * np.pi * 1.5 * stiction.HALF_WIDTH))  # of a sine of 2.7 m/s2
    assert heights.min()["LuGre", 0.0] > crest
    assert heights.min()["Bingham", 0.0] > heights.max()["LuGre", 0.0]
    assert all(heights.max()["LuGre", voltage] < crest for voltage in (2.0, 4.0, 8.0))
    off = peaks["peak after crossing [s]"].abs()
    assert off.max() <= stiction.HALF_WIDTH + 1e-3


def test_the_height_of_a_known_peak_is_found() -> None:
    time = np.arange(0.0, 8.0, 1e-3)
    v = np.sin(2 * np.pi * 0.5 * (time - 5.2))  # turns at 4.2, 5.2, 6.2, 7.2 s
    spike = sum(
        sign * np.clip(1 - np.abs(time - at) / 0.02, 0, None)
        for at, sign in ((4.2, -1), (5.2, 1), (6.2, -1), (7.2, 1))
    )
    frame = pd.DataFrame({stiction._V: v, stiction._A: 0.25 * time + 0.4 * spike}, index=time)
    found = stiction.find_peaks(frame)
    np.testing.assert_allclose(found["crossing [s]"], [4.2, 5.2, 6.2, 7.2], atol=1e-9)
    np.testing.assert_allclose(found["height [m/s2]"], 0.4, rtol=1e-3)
    np.testing.assert_allclose(found["peak after crossing [s]"], 0.0, atol=1.1e-3)


def test_a_smooth_acceleration_has_the_height_of_a_crest() -> None:
    time = np.arange(0.0, 8.0, 1e-3)
    phase = 2 * np.pi * 1.5 * time
    frame = pd.DataFrame({stiction._V: -np.sin(phase), stiction._A: -2.0 * np.cos(phase)}, time)
    heights = stiction.find_peaks(frame)["height [m/s2]"]
    np.testing.assert_allclose(heights, stiction._smooth_height(frame), rtol=0.03)


@pytest.mark.slow  # 2 s of runs: tests/campaign/test_passive.py has this table by default
def test_the_optimum_voltages_are_the_papers_within_two_percent(tmp_path: Path) -> None:
    make("passive-optimum", tmp_path)
    curves = table(tmp_path, "passive-optimum").set_index(["intensity", "voltage [V]"])
    peak = curves["peak floor 2 acceleration [m/s2]"]
    for intensity, best in {"0.2 g": 2, "0.4 g": 4, "0.6 g": 4, "0.8 g": 8}.items():
        assert peak[intensity, best] <= 1.02 * peak[intensity].min()
    assert peak["0.6 g", 4] == pytest.approx(6.10, rel=5e-3)  # tight integration: 6.10339
    assert peak["0.8 g", 0] == pytest.approx(15.75, rel=5e-3)


def test_the_command_says_where_everything_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "deep" / "er"
    assert main(["figures", "loops-voltage", "--out", str(out)]) == 0
    written = capsys.readouterr().out.splitlines()[1:]
    assert sorted(Path(line.strip()) for line in written) == sorted(out.iterdir())


def test_an_unknown_figure_is_an_error_that_names_those_there_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["figures", "stictoin", "--out", str(tmp_path / "new")])
    assert "stiction" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_place_that_cannot_be_written_is_found_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RunError, match="is a file; figures go into a folder"):
        make("passive-optimum", tmp_path / "file")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
