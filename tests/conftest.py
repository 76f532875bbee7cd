"""Fixtures that several folders share: toy FMUs, and scenarios made of them."""

from __future__ import annotations

import gc
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

# The processes that tests start, hundreds of them, read what they import from bytecode, as does the
# next run; so it is written before anything large is imported.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import studies
from hypothesis import settings
from toys import Maker, build_toys

from bristle import trust
from bristle.user_code.load import unload_effects

_STATUS = pytest.StashKey[int]()
_AHEAD = pytest.StashKey["subprocess.Popen[bytes]"]()

# Whether the suite passes must not hang on the day's dice.
# HYPOTHESIS_PROFILE=default looks further.
settings.register_profile("steady", derandomize=True, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "steady"))

# Workers of a run are more than cores: threads of BLAS beside them wait for each other, at work.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# numba paints the errors of overloads that do not fit, which nobody reads: a twentieth of its time.
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")

# Little of what tests make is garbage that only a search finds: searching seldom saves a third of
# the collection, and a fifth of what numba compiles.
gc.set_threshold(200_000, 20, 20)

# Instances of the same FMU share its unpacked files, over all tests and workers.
_UNPACKED = "" if "BRISTLE_TEST_UNPACKED" in os.environ else tempfile.mkdtemp(prefix="bristle-fmu-")
os.environ.setdefault("BRISTLE_TEST_UNPACKED", _UNPACKED)

_STUDIES = "" if studies.FOLDER in os.environ else tempfile.mkdtemp(prefix="bristle-studies-")
os.environ.setdefault(studies.FOLDER, _STUDIES)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return one more than there are cores: tests wait, for time limits and for each other."""
    return (os.cpu_count() or 1) + 1


def pytest_sessionstart(session: pytest.Session) -> None:
    """Where the whole suite runs on several workers, compile once what each would compile."""
    config = session.config
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if whole and config.getoption("numprocesses", None) and not hasattr(config, "workerinput"):
        if not any(Path(__file__).parent.glob("__pycache__/test_units.*pytest*")):
            _make_bytecode()
        script = Path(__file__).with_name("compile_ahead.py")
        state = str(Path(os.environ[studies.FOLDER]) / "state")
        path = os.pathsep.join([str(script.parents[1]), os.environ.get("PYTHONPATH", "")])
        config.stash[_AHEAD] = subprocess.Popen(
            [sys.executable, str(script)],
            env={**os.environ, "PYTHONPATH": path, trust.VARIABLE: "1", "BRISTLE_STATE": state},
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip


def _make_bytecode() -> None:
    """Let two processes collect half of the tests each: else every worker compiles all modules."""
    tests = Path(__file__).parent
    parts = sorted(path for path in tests.iterdir() if path.is_dir() or path.match("test_*.py"))
    command = [sys.executable, "-m", "pytest", "-n0", "--collect-only", "-qq"]
    halves = [
        subprocess.Popen(
            [*command, *map(str, parts[k::2])],
            cwd=tests.parent, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        for k in (0, 1)
    ]  # fmt: skip
    for half in halves:
        half.wait()


_LONG = ("test_conform.py", "test_build.py", "test_slave.py", "test_run.py")
"""Files whose tests take longest: begun first, so that no worker waits for another at the end.

They compile nothing of what is compiled ahead, nor do the tests of the folders that come next.
"""
_COMPILE_NOTHING = ("conformance", "fmu", "native", "data")
_LONG_TOO = ("test_docs.py", "test_flat.py", "test_public_names.py", "test_public.py",
             "test_compiled_laws.py")  # fmt: skip


def _turn(item: pytest.Item) -> int:
    name, folder = item.path.name, item.path.parent.name
    if name in _LONG:
        return _LONG.index(name)
    if folder in _COMPILE_NOTHING:
        return 10
    return 20 + _LONG_TOO.index(name) if name in _LONG_TOO else 99


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Leave out of the search for garbage what all tests share."""
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put first what takes longest and waits for nothing; a worker runs a file whole."""
    items.sort(key=_turn)


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    session.config.stash[_STATUS] = int(exitstatus)
    if ahead := session.config.stash.get(_AHEAD, None):
        ahead.kill()  # it has ended long since, unless the run was stopped
        ahead.wait()


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """End the process with pytest's status, without calling the libraries of FMUs again.

    Some of these FMUs are broken on purpose, and some were left as they answered Fatal.
    """
    for folder in filter(None, (_UNPACKED, _STUDIES)):
        shutil.rmtree(folder, ignore_errors=True)
    if _STATUS in config.stash:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash[_STATUS])


@pytest.fixture(autouse=True)
def library() -> Iterator[None]:
    """Leave the library of effects as it came, whatever a test has loaded."""
    yield
    unload_effects()


@pytest.fixture(autouse=True, scope="session")
def consent(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Consent to the effects that tests write, and keep what a user keeps in a folder of theirs."""
    before = {name: os.environ.get(name) for name in (trust.VARIABLE, "BRISTLE_STATE")}
    os.environ[trust.VARIABLE] = "1"
    os.environ["BRISTLE_STATE"] = str(tmp_path_factory.mktemp("state"))
    yield
    for name, value in before.items():
        if value is None:
            del os.environ[name]
        else:
            os.environ[name] = value


@pytest.fixture(scope="session")
def toys(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the toy FMUs by name, built once."""
    return build_toys(tmp_path_factory.mktemp("toys"))


@pytest.fixture
def scenario_of(toys: dict[str, Path], tmp_path: Path) -> Maker:
    """Return a function that writes a scenario of toys and returns its file."""
    return Maker(toys, tmp_path)


@pytest.fixture
def bench_study(tmp_path: Path) -> Path:
    """Return a copy of the study of a bench with a hidden gas spring, identified and diagnosed."""
    return studies.study("bench", tmp_path)


@pytest.fixture
def building_study(tmp_path: Path) -> Path:
    """Return a copy of the study of a house whose isolation stiffens, identified and diagnosed."""
    return studies.study("building", tmp_path)


@pytest.fixture
def device_study(tmp_path: Path) -> Path:
    """Return a copy of the study of a brace between levels beside a tie, identified."""
    return studies.study("device", tmp_path)


@pytest.fixture
def learned_study(tmp_path: Path) -> Path:
    """Return a copy of the study of a bench with a force that a curve was learned of."""
    return studies.study("learned", tmp_path)
