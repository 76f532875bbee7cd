"""What if: the sliders of a study's page move the model's numbers, in the exported scenario."""

from __future__ import annotations

import base64
import importlib.util
import json
import re
from pathlib import Path

import numpy as np
import pytest
from made import write_runs

import bristle
from bristle.cli import main
from bristle.errors import BuildError
from bristle.export import web
from bristle.native import zig
from bristle.prediction.export import export_study
from bristle.report.study_page import movable
from bristle.study import Study, create_study

VALUES = {"f_c": 1.3, "f_v": 0.8, "c_0": 20.0, "c_v": 2.0, "v_n": 5.0, "exponent": 0.0}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    root = tmp_path_factory.mktemp("what_if")
    files = write_runs(root / "lab", 2, seconds=2.0)
    study = create_study(root / "rig", files, law="bingham").study
    model = study.model().with_effect("gas_spring").with_values({**VALUES, "gas_spring.k": 90.0})
    study.add_step("identify bingham", "by hand", model, {}, {})
    return Study(study.folder)


def test_it_is_the_run_of_the_exported_fmu(study: Study, tmp_path: Path) -> None:
    fmu = bristle.run(export_study(study, tmp_path).scenario, engine="fmu")
    with movable(study) as found:
        own = bristle.run(found.scenario, engine="compiled")
    for name in ("damper.force", "measured.value"):
        apart = np.abs(own[name].to_numpy() - fmu[name].to_numpy())
        assert np.max(apart) <= 1e-9 * np.max(np.abs(fmu[name])), name


@pytest.mark.slow  # a whole report with a page of sliders
def test_the_report_has_sliders_for_the_numbers_of_the_model(
    study: Study, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(web, "module", lambda _system=None: b"\0asm")
    assert main(["report", str(study.folder), "--what-if"]) == 0
    page = (study.folder / "reports" / "report.html").read_text()
    assert "What if: the model in run_2, with other numbers" in page
    text = re.search(r'<script type="application/json" id="scenario">(.*?)</script>', page, re.S)
    assert text is not None
    description = json.loads(text[1])
    sliders = {one["name"]: one["value"] for one in description["sliders"]}
    numbers = {f"damper.{name}": value for name, value in VALUES.items() if value}
    assert sliders.items() >= {**numbers, "damper.gas_spring.k": 90.0}.items()
    assert "damper.exponent" not in sliders  # half and one and a half of nothing
    assert description["measured"] == {"damper.force": "measured.value"}
    assert base64.b64encode(b"\0asm").decode() in page
    assert len(page) < 8e6
    assert main(["report", str(study.folder)]) == 0
    assert "What if" not in (study.folder / "reports" / "report.html").read_text()


def test_without_zig_it_says_what_to_install(
    study: Study, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    zig.version.cache_clear()
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    try:
        code = main(["report", str(study.folder), "--what-if"])
    finally:
        zig.version.cache_clear()
    assert code == BuildError.exit_code
    assert "pip install 'bristle[native]'" in capsys.readouterr().err
