"""What a user types after `import bristle`, whatever else was imported before or after."""

from __future__ import annotations

import importlib.util
import inspect
import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path
from types import ModuleType

import pytest

import bristle

ROOT = Path(__file__).resolve().parents[1]
NAMES = sorted(name for name in bristle.__all__ if name != "__version__")
FUNCTIONS = [name for name in NAMES if inspect.isfunction(getattr(bristle, name))]
CLASSES = [name for name in NAMES if inspect.isclass(getattr(bristle, name))]
LIGHT = 0.15
"""Seconds that `import bristle` and `bristle --help` may take, Python's own start included."""


def reference() -> ModuleType:
    """Return the script that makes the API's page."""
    spec = importlib.util.spec_from_file_location("docs_reference", ROOT / "docs" / "reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def python(code: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)


@pytest.mark.parametrize(
    "lines",
    [
        "import bristle.engine.run; import bristle.campaign.ensemble; import bristle",
        pytest.param(  # 2 s: names first is what most tests do
            "import bristle; bristle.run; bristle.identify; import bristle.campaign.ensemble",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_public_names_are_functions_in_any_order_of_imports(lines: str) -> None:
    code = f"""
{lines}
import sys
from types import FunctionType
names = {FUNCTIONS}
assert all(type(getattr(bristle, name)) is FunctionType for name in names)
import bristle.identification.problem, bristle.synthesis.task
assert all(type(getattr(bristle, name)) is FunctionType for name in names)
assert sys.modules["bristle.identification"].__path__
print(bristle.run.__module__, bristle.identify.__module__, bristle.design.__module__)
"""
    done = python(code)
    assert done.stdout.split() == [
        "bristle.engine.run", "bristle.study.api", "bristle.synthesis"
    ], done.stderr  # fmt: skip


def test_what_dir_shows_is_what_a_user_may_type() -> None:
    wanted = "run load_results Study identify compare diagnose design ensemble Law Effect Parameter"
    assert set(wanted.split()) <= set(dir(bristle))
    assert dir(bristle) == sorted(bristle.__all__)
    for name in dir(bristle):
        value = getattr(bristle, name)
        assert name == "__version__" or value.__name__ == name
    with pytest.raises(AttributeError, match="has no attribute 'runn'"):
        bristle.runn  # type: ignore[attr-defined]  # noqa: B018


def test_an_attribute_of_the_package_can_still_be_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bristle, "run", lambda: "replaced")
    assert bristle.run() == "replaced"  # type: ignore[call-arg, comparison-overlap]


def test_importing_the_package_is_light() -> None:
    heavy = "{'numpy', 'pandas', 'numba', 'matplotlib', 'scipy'} & {*sys.modules}"
    done = python(f"import sys, bristle; dir(bristle); print({heavy})")
    assert done.stdout == "set()\n", done.stderr
    done = python(
        "import sys, contextlib, io\nfrom bristle.cli import main\n"
        "with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):\n"
        f"    main(['--help'])\nprint({heavy})"
    )
    assert done.stdout == "set()\n", done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="a child's processor time is POSIX")
@pytest.mark.parametrize("arguments", [["-c", "import bristle"], ["-m", "bristle.cli", "--help"]])
def test_importing_and_help_are_quick(arguments: list[str]) -> None:
    import resource

    def spent() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    times = []
    for _ in range(3):  # the least, of processor time: the machine has other work, too
        before = spent()
        subprocess.run([sys.executable, *arguments], capture_output=True, check=True)
        times.append(spent() - before)
    assert min(times) <= LIGHT


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_is_documented(name: str) -> None:
    found = reference().documented()[name]
    thing = getattr(bristle, name)
    assert found[""].endswith(".")
    assert "Examples" in found
    if name in FUNCTIONS:
        assert {"Parameters", "Returns", "Raises"} <= set(found)
        for argument in inspect.signature(thing).parameters:
            assert re.search(rf"^{argument} : ", found["Parameters"], re.MULTILINE), argument
    else:
        assert {"Parameters", "Attributes", "Class data"} & set(found)


def test_the_page_of_the_api_has_every_name_with_all_its_arguments() -> None:
    made = reference()
    assert sorted(made.ORDER) == NAMES
    page = made.api_page()
    for name in NAMES:
        part = page.split(f"\n## {name} {{ #{name} }}\n")[1].split("\n## ")[0]
        assert "```pycon\n>>> " in part
        thing = getattr(bristle, name)
        for argument in inspect.signature(thing).parameters if name in FUNCTIONS else ():
            assert f"| `{argument}` |" in part
    assert not re.search(r"^-{3,}$", page, re.MULTILINE)  # no heading of a docstring is left


SEARCHES = {"Comparison", "Diagnosis", "Identified", "Plan", "Study", "diagnose", "plan"}
"""Names whose examples search or fit; what they show is what tests of the commands show."""


@pytest.mark.parametrize(
    "names",
    [
        pytest.param([name for name in NAMES if name not in SEARCHES], id="quick"),
        # A search each: examples of docstrings.
        *(pytest.param([name], id=name, marks=pytest.mark.slow) for name in sorted(SEARCHES)),
    ],
)
def test_the_examples_of_public_names_run(names: list[str], tmp_path: Path) -> None:
    """In a process of their own: examples define effects and laws, and run FMUs."""
    code = f"""
import doctest, os, sys
import bristle
from bristle.user_code.load import unload_effects
runner = doctest.DocTestRunner()
finder = doctest.DocTestFinder(recurse=False)
for name in {names}:
    tests = finder.find(getattr(bristle, name), name, globs={{}})
    assert sum(runner.run(test).attempted for test in tests) >= 2, name
    unload_effects()
sys.stdout.flush()
os._exit(runner.failures > 0)
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        capture_output=True, text=True, timeout=600, check=False, cwd=tmp_path, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


USER = """
from typing import assert_type

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import bristle


def peak(name: str) -> float:
    results = bristle.run(name, {"run.stop": 1.0})
    assert_type(results, bristle.Results)
    assert_type(results.plot(), Figure)
    return float(results["damper.force"].abs().max())


t = np.arange(0.0, 1.0, 0.01)
run = {"time": t, "velocity": t, "force [kN]": t}
found = bristle.identify([run, run], "bingham", effects="gas_spring", holdout=pd.DataFrame(run))
assert_type(found, bristle.Identified)
assert_type(bristle.compare("lab/*.csv", found), bristle.Comparison)
assert_type(bristle.diagnose(bristle.Study("my_rig")), bristle.Diagnosis)
assert_type(bristle.design({"kind": "hinf", "tau": 2.0}).plot(), Figure)
assert_type(bristle.ensemble("my_ensemble.toml", runs=3), bristle.Ensemble)
assert_type(bristle.load_results("results/mine"), bristle.Results)
k = bristle.Parameter(1.0, "N/m", (0.0, 10.0), "stiffness")
try:
    peak("no_damper")
except bristle.BristleError as error:
    print(error.exit_code)
"""


@pytest.mark.slow  # mypy reads the whole package
def test_a_users_script_is_typed(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    assert (ROOT / "bristle" / "py.typed").is_file()
    right, wrong = tmp_path / "right.py", tmp_path / "wrong.py"
    right.write_text(USER)
    wrong.write_text("import bristle\nbristle.runn('x')\nbristle.identify(3)\nbristle.run()\n")
    options = ["--strict", "--follow-imports=silent", "--config-file=", "--python-version=3.11"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, f"--cache-dir={tmp_path}", str(right), str(wrong)],
        capture_output=True, text=True, timeout=500, check=False, cwd=ROOT,
    )  # fmt: skip
    errors = [line for line in done.stdout.splitlines() if ": error: " in line]
    assert not [line for line in errors if "right.py" in line], done.stdout
    lines = {int(match[1]) for line in errors if (match := re.search(r"wrong\.py:(\d+)", line))}
    assert lines == {2, 3, 4}, textwrap.indent(done.stdout + done.stderr, "  ")
