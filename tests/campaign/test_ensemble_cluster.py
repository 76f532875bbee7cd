"""Ensembles on a Dask cluster: the numbers of this machine, lost workers, clusters not there."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import bristle
from bristle.campaign import campaign, read_ensemble
from bristle.campaign.campaign import Campaign, RunOutcome
from bristle.cli import main
from bristle.errors import EnsembleError

distributed = pytest.importorskip("distributed")
Write = Callable[..., Path]
# The library closes sockets and loops of its own late.
pytestmark = [
    pytest.mark.filterwarnings("ignore"),
    pytest.mark.skipif(sys.platform == "win32", reason="processes are killed by signals of POSIX"),
]


@pytest.fixture(scope="module")
def local() -> Iterator[Any]:
    """Return a cluster of two worker processes of one thread each."""
    import dask

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 2}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
        ) as found,
    ):
        yield found


def test_numbers_are_those_of_this_machine(write: Write, tmp_path: Path, local: Any) -> None:
    here = bristle.ensemble(write(), out=tmp_path / "here")
    there = bristle.ensemble(write(), out=tmp_path / "there", cluster=local.scheduler_address)
    pd.testing.assert_frame_equal(here.runs, there.runs)
    files = [(tmp_path / name / "runs.csv").read_bytes() for name in ("here", "there")]
    assert files[0] == files[1]


def test_another_version_on_a_worker_is_named(
    write: Write, local: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(campaign, "__version__", "99.0")
    with pytest.raises(EnsembleError, match=r"has bristle .*, here is 99.0"):
        bristle.ensemble(write(), cluster=local.scheduler_address)


def _slow(campaign: Campaign, run: int) -> RunOutcome:
    """Kill the worker at run 5, the first time; take a moment otherwise."""
    import time

    marker = campaign.draws.file.parent / "died_at_5"
    if run == 5 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.02)
    return RunOutcome(run, (float(run), 0.0, 0.0))


def test_a_lost_worker_loses_no_finished_run(
    write: Write, tmp_path: Path, local: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Not by name: workers do not see this folder of tests.
    monkeypatch.setattr(_slow, "__module__", "__main__")
    monkeypatch.setattr(campaign, "outcome_of", _slow)
    path = write(("runs = 12", "runs = 60"))
    found = bristle.ensemble(path, out=tmp_path / "out", cluster=local.scheduler_address)
    assert (tmp_path / "died_at_5").exists()
    assert (found.runs["status"] == "done").all()
    assert found.runs.iloc[:, -3].tolist() == [float(i) for i in range(60)]


@pytest.mark.slow  # workers die by turns, and what a busy machine sees of it differs
def test_a_run_that_kills_every_worker_is_a_failure(
    write: Write, local: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def deadly(campaign: object, run: int) -> RunOutcome:
        if run == 3:
            os.kill(os.getpid(), signal.SIGKILL)
        return RunOutcome(run, (0.0, 0.0, 0.0))

    monkeypatch.setattr(deadly, "__module__", "__main__")
    monkeypatch.setattr(campaign, "outcome_of", deadly)
    found = bristle.ensemble(write(), cluster=local.scheduler_address)
    # Dask may blame a neighbour as well, while a dead worker is not yet seen to be dead.
    failed = found.runs[found.runs["status"] == "failed"]
    assert 3 in failed.index
    assert len(found.runs) == 12
    assert failed["reason"].str.startswith("KilledWorker").all()


def test_a_cluster_that_is_not_there_is_named(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: Any
) -> None:
    monkeypatch.setattr(campaign, "CONNECT", 0.5)
    for address in ("tcp://127.0.0.1:9", "no_address", "tcp://nowhere.invalid:1"):
        command = ["ensemble", str(write()), "--out", str(tmp_path), "--cluster", address]
        assert main(command) == 2
        message = capsys.readouterr().err
        assert message.startswith(f"EnsembleError: --cluster {address}: no Dask scheduler answers")
        assert message.count("\n") == 1


def test_a_cluster_without_workers_is_named(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "CONNECT", 2.0)
    with (
        distributed.LocalCluster(
            n_workers=0, dashboard_address=None, host="127.0.0.1", protocol="tcp"
        ) as empty,
        pytest.raises(EnsembleError, match="has no worker"),
    ):
        bristle.ensemble(write(), cluster=empty.scheduler_address)


def test_the_library_is_asked_for_where_it_is_missing(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(EnsembleError, match=r"bristle\[cluster\]"):
        bristle.ensemble(write(), cluster="tcp://127.0.0.1:8786")
    assert len(bristle.ensemble(write(), runs=2).runs) == 2


def test_a_plan_is_small_enough_to_send_with_every_run() -> None:
    import pickle

    assert len(pickle.dumps(read_ensemble("el_centro_damper_and_building"))) < 10_000
