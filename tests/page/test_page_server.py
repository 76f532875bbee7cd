"""The routes: what is refused in one sentence, uploads, commands as jobs, downloads, consent."""

from __future__ import annotations

import http.client
import json
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from made import bench_run, write, write_runs
from page.served import Client, page_on

from bristle import trust
from bristle.cli import main
from bristle.errors import StudyError
from bristle.page import app as page_app
from bristle.page.app import App
from bristle.page.orders import order_of
from bristle.page.requests import RequestError, consent, waiting_texts
from bristle.study import Study, create_study
from bristle.user_code.templates import file_text
from bristle.view.html import pack, unpack


@pytest.fixture(scope="module", autouse=True)
def interrupts() -> Iterator[None]:
    """Let commands be interrupted also where the tests run as a shell's background job."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("home")
    files = write_runs(folder / "lab", 4, seconds=3.0)
    create_study(folder / "rig", files, law="bingham")
    return folder


@pytest.fixture(scope="module")
def client(home: Path) -> Iterator[Client]:
    with page_on(home) as found:
        yield found


def test_the_first_screen_lists_the_studies(client: Client, home: Path) -> None:
    found = client.get("/api/home").json
    assert found["folder"] == str(home)
    assert [(one["name"], one["runs"], one["held_out"]) for one in found["studies"]] == [
        ("rig", 4, 1)
    ]


def test_a_study_is_opened_where_its_folder_is_named(home: Path) -> None:
    app = App(home / "rig")
    assert (app.home, app.first) == (home.resolve(), "rig")


def test_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="no such folder"):
        App(tmp_path / "gone")
    assert main(["page", str(tmp_path / "gone"), "--no-browser"]) == 2


def test_a_port_that_is_taken_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["page", str(tmp_path), "--port", str(port), "--no-browser"]) == 2
    assert f"port {port} of 127.0.0.1" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["..", "%2e%2e", "a%2fb", ".hidden", "-x", "gone", "%00"])
@pytest.mark.parametrize("view", ["data", "files", "consent"])
def test_a_name_that_is_no_study_is_refused(client: Client, name: str, view: str) -> None:
    assert client.get(f"/api/studies/{name}/{view}").status in (400, 404)


@pytest.mark.parametrize(
    ("what", "study", "options", "words"),
    [
        ("rm", "rig", {}, "command"),
        ("identify", "../rig", {}, "study"),
        ("identify", "--trust", {}, "study"),
        ("identify", "rig", {"law": "--trust"}, "law"),
        ("add", "rig", {"effects": ["--trust"]}, "effects"),
        ("add", "rig", {"effects": []}, "effects"),
        ("add", "rig", {"effects": ["gas_spring"], "why": "a\nb"}, "why"),
        ("plan", "rig", {"stroke": "1" * 99}, "stroke"),
        ("new", "rig", {"batch": "../x"}, "batch"),
        ("new", "rig", {"batch": "a", "building": "../b.toml"}, "building"),
        ("example", "rig", {"rig": "house"}, "bench"),
        ("example", "rig", {"rig": "bench", "seed": -1}, "seed"),
        ("roles", "rig", {"train": "run_1"}, "train"),
        ("channels", "rig", {}, "nothing would change"),
        ("channels", "rig", {"channels": "force=F@N"}, "a list"),
        ("channels", "rig", {"channels": ["force=F\n@N"]}, "CHANNEL=COLUMN@UNIT"),
        ("channels", "rig", {"without": ["--trust"]}, "without"),
        ("export_ssp", "rig", {}, "scenario"),
        ("export_ssp", "rig", {"scenario": "../bench.toml"}, "scenario"),
        ("export_ssp", "rig", {"scenario": "-o.toml"}, "scenario"),
        ("export_ssp", "rig", {"scenario": "bench.fmu"}, "toml"),
    ],
)
def test_what_is_no_command_is_refused(
    what: str, study: str, options: dict[str, object], words: str
) -> None:
    with pytest.raises(RequestError, match=words):
        order_of(what, study, options)


def test_a_command_is_shown_as_a_shell_takes_it() -> None:
    order = order_of("add", "my rig", {"effects": ["gas_spring"], "why": "to see"})
    assert order.shown == "bristle add 'my rig' gas_spring '--why=to see'"


@pytest.mark.parametrize("body", [b"", b"[]", b"{", b"\xff"])
def test_a_body_that_is_no_json_is_refused(client: Client, body: bytes) -> None:
    assert client.post("/api/jobs", body).status == 400


def test_a_body_of_json_that_is_too_large_is_refused(client: Client) -> None:
    assert client.post("/api/jobs", b" " * (2 * 1024**2)).status == 413


def test_a_body_of_unknown_length_is_refused(client: Client) -> None:
    found = client.ask("PUT", "/api/uploads/a/run.csv", Transfer_Encoding="chunked")
    assert found.status == 411


def test_a_method_that_is_not_for_a_path_is_refused(client: Client) -> None:
    assert client.post("/api/home", {}).status == 405
    assert client.get("/api/nowhere").status == 404


def test_files_are_dropped_looked_at_and_made_a_study(client: Client, home: Path) -> None:
    for k in (1, 2, 3):
        file = write(home / "lab" / f"drop_{k}.csv", bench_run(10 + k, seconds=3.0))
        sent = client.ask("PUT", f"/api/uploads/b1/drop_{k}.csv", file.read_bytes())
        assert sent.status == 201
        assert (home / "uploads" / "b1" / file.name).read_bytes() == file.read_bytes()
    found = unpack(client.get("/api/uploads/b1/columns").body)
    chosen = {one["text"]: one["channel"] for one in found["columns"]}
    assert chosen == {
        "time [s]": "time", "x [mm]": "displacement", "v [mm/s]": "velocity", "F [N]": "force",
        "U [V]": "voltage",
    }  # fmt: skip
    assert all(len(one["values"]) > 100 for one in found["columns"])
    job = client.run("new", "dropped", batch="b1", channels=["force=-F [N]@N"])
    assert job["state"] == "done", job
    assert job["command"].startswith("bristle study new dropped --data uploads/b1")
    assert Study(home / "dropped").settings.channels["force"].sign == -1


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("words.csv", b"a,b\nx,y\n", "words.csv"),
        ("book.xlsx", b"PK\x03\x04nothing", "book.xlsx"),
        # A worker process each: other damaged files.
        pytest.param("cut.parquet", b"PAR1nothing", "cut.parquet", marks=pytest.mark.slow),
        pytest.param(
            "packed.csv.gz", b"\x1f\x8b\x08broken", "packed.csv.gz", marks=pytest.mark.slow
        ),
    ],
)
def test_a_bad_file_gives_one_sentence(
    client: Client, name: str, content: bytes, words: str
) -> None:
    batch = f"bad-{name.partition('.')[0]}"
    assert client.ask("PUT", f"/api/uploads/{batch}/{name}", content).status == 201
    found = client.get(f"/api/uploads/{batch}/columns")
    told = found.error if found.status == 422 else " ".join(
        one["error"] for one in unpack(found.body)["files"]
    )  # fmt: skip
    if found.status == 200 and not told:  # it can be read, and holds no run
        job = client.run("new", f"of-{batch}", batch=batch)
        assert job["state"] == "failed"
        told = job["error"]
    assert words in told
    assert "Traceback" not in told


@pytest.mark.parametrize("name", ["..", "%2e%2e%2fx.csv", ".x.csv", "-x.csv", "a%2fb.csv"])
def test_a_file_is_kept_under_its_own_name_alone(client: Client, home: Path, name: str) -> None:
    before = sorted(home.rglob("*"))
    assert client.ask("PUT", f"/api/uploads/b2/{name}", b"1,2\n").status in (400, 404)
    assert sorted(home.rglob("*")) == before


def test_a_file_that_is_too_large_is_refused_before_it_is_read(client: Client, home: Path) -> None:
    length = page_app.LARGEST_UPLOAD + 1
    found = client.ask("PUT", "/api/uploads/b3/huge.csv", Content_Length=str(length))
    assert found.status == 413
    assert "MB" in found.error
    assert not (home / "uploads" / "b3").exists()


def test_an_upload_that_breaks_off_leaves_nothing(client: Client, home: Path) -> None:
    guard = client.server.guard
    with socket.create_connection(("127.0.0.1", guard.port)) as line:
        head = [
            "PUT /api/uploads/b4/run.csv HTTP/1.1", f"Host: 127.0.0.1:{guard.port}",
            f"Authorization: Bearer {guard.token}", "Content-Length: 1000", "", "time",
        ]  # fmt: skip
        line.sendall("\r\n".join(head).encode())
        line.shutdown(socket.SHUT_WR)
        said = b"".join(iter(lambda: line.recv(65536), b""))
    assert b"broke off" in said
    assert not list((home / "uploads" / "b4").iterdir())


def test_a_command_that_fails_says_why(client: Client) -> None:
    job = client.run("diagnose", "rig", law="gone")
    assert job["state"] == "failed"
    assert job["error"].startswith("StudyError: ")
    assert "gone" in job["error"]


def test_one_command_of_a_study_at_a_time_and_cancel_leaves_the_study_as_it_was(
    client: Client, home: Path
) -> None:
    before = (home / "rig" / "model.toml").read_bytes()
    order = {"what": "diagnose", "study": "rig", "options": {"law": "all"}}
    started = client.post("/api/jobs", order)
    assert started.status == 201
    again = client.post("/api/jobs", order)
    assert again.status == 409
    assert "cancel" in again.error
    number = started.json["number"]
    while not client.get(f"/api/jobs/{number}").json["lines"]:
        time.sleep(0.05)
    assert client.post(f"/api/jobs/{number}/cancel", {}).json["state"] == "cancelling"
    job = client.ended(number, 20.0)
    assert job["state"] == "cancelled"
    assert (home / "rig" / "model.toml").read_bytes() == before
    assert not (home / "rig" / "verdict.json").exists()


@pytest.mark.parametrize("after", [0.0, 0.2, 0.5])
def test_a_command_is_cancelled_while_it_is_starting(client: Client, after: float) -> None:
    order = {"what": "diagnose", "study": "rig", "options": {"law": "all"}}
    number = client.post("/api/jobs", order).json["number"]
    time.sleep(after)
    client.post(f"/api/jobs/{number}/cancel", {})
    assert client.ended(number, 30.0)["state"] == "cancelled"


def test_the_server_ends_its_commands_when_it_ends(home: Path) -> None:
    with page_on(home, start=False) as own:
        order = {"what": "diagnose", "study": "rig", "options": {"law": "all"}}
        number = own.post("/api/jobs", order).json["number"]
        process = own.server.app.jobs.get(number).process
    assert process.poll() is not None


def test_a_worker_whose_page_has_ended_ends_without_a_word(tmp_path: Path) -> None:
    worker = subprocess.Popen(
        [sys.executable, "-m", "bristle.page.worker"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    assert worker.stdin is not None
    assert worker.stdout is not None
    worker.stdout.close()
    asked = {"view": "data", "folder": str(tmp_path), "arguments": {}}
    _, said = worker.communicate(json.dumps(asked).encode() + b"\n", timeout=60.0)
    assert (worker.returncode, b"Traceback" in said) == (0, False)


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C of another process is POSIX")
def test_ctrl_c_ends_the_page_and_its_worker(home: Path) -> None:
    order = [sys.executable, "-m", "bristle.cli", "page", str(home), "--no-browser"]
    process = subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    host, token = re.fullmatch(r"http://(127\.0\.0\.1:\d+)/#token=(\S+)", address).groups()  # type: ignore[union-attr]
    line = http.client.HTTPConnection(host, timeout=20.0)
    line.request("GET", "/api/home", headers={"Authorization": f"Bearer {token}"})
    assert line.getresponse().status == 200
    line.close()
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=20.0)
    assert (process.returncode, told) == (0, "")


@pytest.mark.slow  # a file of 200 MB
def test_a_file_of_200_mb_is_read_in_another_process(client: Client, home: Path) -> None:
    rows = "".join(f"{np.sin(0.01 * k):.6f},{np.cos(0.01 * k):.6f}\n" for k in range(20_000))
    body = b"x [mm],F [N]\n" + rows.encode() * (200 * 1024**2 // len(rows))
    assert client.ask("PUT", "/api/uploads/large/large.csv", body).status == 201
    assert (home / "uploads" / "large" / "large.csv").stat().st_size == len(body)
    found = unpack(client.get("/api/uploads/large/columns").body)
    assert [one["channel"] for one in found["columns"]] == ["displacement", "force"]
    assert max(len(one["values"]) for one in found["columns"]) < 5000
    shutil.rmtree(home / "uploads" / "large")


@pytest.mark.slow  # an export by the page
def test_a_study_is_handed_on_as_a_package(client: Client, home: Path) -> None:
    assert client.run("export", "rig")["state"] == "done"
    job = client.run("export_ssp", "rig", scenario="bench.toml")
    assert job["state"] == "done", job
    assert job["command"] == "bristle export-ssp rig/export/bench.toml --out=rig/export/bench.ssp"
    assert zipfile.is_zipfile(home / "rig" / "export" / "bench.ssp")
    names = [one["name"] for one in client.get("/api/studies/rig/files").json["files"]]
    assert "export/bench.ssp" in names


def test_roles_are_written_by_a_command(client: Client, home: Path) -> None:
    job = client.run("roles", "rig", test=["data/run_4.csv"], holdout=["data/run_2.csv"])
    assert job["state"] == "done", job
    text = (home / "rig" / "study.toml").read_text()
    assert 'role = "test"' in text


@pytest.mark.slow  # two workers and fits
def test_channels_are_previewed_and_corrected_by_a_command(client: Client, home: Path) -> None:
    asked = {"channels": ["force=-F [N]@kN"], "without": []}
    seen = client.post("/api/studies/rig/preview", asked)
    assert seen.status == 200, seen.body
    assert client.get("/api/studies/rig/channels").status == 200
    wrong = client.post("/api/studies/rig/preview", {"channels": ["force=G@N"]})
    assert (wrong.status, 'no column is called "G"' in wrong.error) == (422, True)
    before = (home / "rig" / "study.toml").read_bytes()
    job = client.run("channels", "rig", **asked)
    assert job["state"] == "done", job
    assert job["command"] == "bristle study channels rig '--channel=force=-F [N]@kN'"
    assert Study(home / "rig").settings.channels["force"].unit == "kN"
    refused = client.run("channels", "rig", channels=["force=U [V]"])
    assert refused["state"] == "failed"
    assert "no unit of this quantity" in refused["error"]
    assert client.run("channels", "rig", channels=["force=F [N]@N"])["state"] == "done"
    (home / "rig" / "study.toml").write_bytes(before)


def test_what_the_commands_wrote_can_be_downloaded_and_nothing_else(
    client: Client, home: Path
) -> None:
    (home / "rig" / "sealed").mkdir(exist_ok=True)
    (home / "rig" / "sealed" / "answer.txt").write_text("hidden")
    (home / "rig" / "reports" / "page.html").write_text("<script>alert(1)</script>")
    (home / "rig" / "reports" / "out").symlink_to(home / "lab" / "run_1.csv")
    names = [one["name"] for one in client.get("/api/studies/rig/files").json["files"]]
    assert {"study.toml", "model.toml", "data/run_1.csv", "reports/page.html"} <= set(names)
    assert not {"sealed/answer.txt", "reports/out"} & set(names)
    page = client.get("/api/studies/rig/file?name=reports/page.html")
    assert page.body == b"<script>alert(1)</script>"
    assert page.headers["Content-Type"] == "application/octet-stream"
    assert page.headers["Content-Disposition"] == "attachment"
    for name in ("sealed/answer.txt", "../lab/run_1.csv", "reports/out", "", "reports"):
        assert client.get(f"/api/studies/rig/file?name={name}").status == 404


def test_consent_is_to_the_text_that_was_shown(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(trust.VARIABLE)
    monkeypatch.setenv("BRISTLE_STATE", str(tmp_path / "state"))
    files = sorted((home / "lab").glob("run_*.csv"))
    create_study(home / "foreign", files, law="bingham")
    file = home / "foreign" / "effects" / "rub.py"
    file.write_text(file_text("effect", "rub"))
    with page_on(home, start=False) as own:
        (shown,) = own.get("/api/studies/foreign/consent").json["texts"]
        assert shown["file"] == "effects/rub.py"
        assert shown["text"] == file.read_text()
        file.write_text(file.read_text() + "# more\n")
        path = "/api/studies/foreign/consent"
        given = {"file": shown["file"], "digest": shown["digest"]}
        assert own.post(path, given).status == 409
        assert not trust.is_trusted(file.read_text())
        (shown,) = own.get(path).json["texts"]
        assert own.post(path, {"file": "../x", "digest": shown["digest"]}).status == 404
        given = {"file": shown["file"], "digest": shown["digest"]}
        assert own.post(path, given).status == 200
        assert trust.is_trusted(file.read_text())
        assert own.get(path).json["texts"] == []


def test_consent_counts_for_a_file_with_a_byte_order_mark(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(trust.VARIABLE)
    monkeypatch.setenv("BRISTLE_STATE", str(tmp_path / "state"))
    files = sorted((home / "lab").glob("run_*.csv"))
    folder = create_study(home / "marked", files, law="bingham").study.folder
    (folder / "effects" / "rub.py").write_text(file_text("effect", "rub"), encoding="utf-8-sig")
    assert "not run" in Study(folder).own_effects[0].error
    (shown,) = waiting_texts(folder)
    assert shown["text"] == file_text("effect", "rub")
    consent(folder, shown["file"], shown["digest"])
    assert Study(folder).own_effects[0].error == ""
    assert waiting_texts(folder) == []


def test_commands_of_the_page_are_never_given_trust() -> None:
    for what in ("identify", "diagnose", "report", "export"):
        assert "--trust" not in order_of(what, "rig", {"trust": True}).words


def test_numbers_are_packed_and_unpacked() -> None:
    content = {
        "a": np.arange(5.0),
        "b": [1, "two", None, {"c": np.zeros((2, 2))}],
        "d": float("nan"),
    }
    found = unpack(pack(content))
    assert found["a"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert found["b"][:3] == [1, "two", None]
    assert found["b"][3]["c"].tolist() == [0.0] * 4
    assert found["d"] is None
    assert json.dumps(unpack(pack({"x": []}))) == '{"x": []}'
