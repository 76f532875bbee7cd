"""The page's server: each route is a function from a request to an answer."""

from __future__ import annotations

import html
import json
import os
import re
import secrets
import shutil
import signal
import socketserver
import subprocess
import sys
import threading
import time
import traceback
import webbrowser
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import FrameType
from typing import IO, Any
from urllib.parse import parse_qs, unquote, urlsplit

from ..core.config import Document, toml_content
from ..core.files import state_folder
from ..core.interrupt import INTERRUPTED
from ..core.progress import LINES
from ..errors import BristleError, StudyError, not_usable
from ..version import __version__
from .orders import COMMANDS, Order, order_of, write_design
from .requests import (
    HEADERS,
    PACKED,
    UPLOADS,
    Answer,
    Guard,
    Handler,
    Request,
    RequestError,
    as_error,
    as_json,
    batch_name,
    consent,
    file_name,
    files_of,
    is_given,
    kind_of,
    waiting_texts,
)
from .view_cache import ViewCache, fingerprint

KEPT_LINES = 500
"""Lines of progress that are kept of a job."""
KEPT_JOBS = 50
LONGEST_ANSWER = 32 * 1024**2
"""Bytes of a command's output that are kept."""
AGAIN = 3.0
"""Seconds after Ctrl-C until it is sent again: one that comes amid an import may be lost."""
PATIENCE = 10.0
"""Seconds after Ctrl-C until a command that does not end is ended."""
ENDED = {0: "done", INTERRUPTED: "cancelled", -signal.SIGINT: "cancelled"}
"""Exit codes of commands that did not fail."""


@dataclass
class Job:
    """A command at work, or what came of it.

    `state` is "running", "cancelling", "done", "failed" or "cancelled"; `lines` what it told on its
    way, `first` the number of the oldest that is kept; `error` why it failed, `output` its answer.
    """

    number: int
    order: Order
    process: subprocess.Popen[bytes] = field(repr=False)
    began: float
    state: str = "running"
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=KEPT_LINES))
    first: int = 0
    ended: float | None = None
    error: str = ""
    output: bytes = b""
    watching: threading.Thread | None = field(default=None, repr=False)

    @property
    def at_work(self) -> bool:
        """Whether its process has not ended."""
        return self.ended is None

    def told(self, text: str) -> None:
        """Keep a line that the command told."""
        self.first += len(self.lines) == KEPT_LINES
        self.lines.append(text)

    def as_dict(self, since: int = 0) -> dict[str, Any]:
        """Return what a page shows of it, with the lines from a number on."""
        lines = list(self.lines)
        end = self.ended or time.monotonic()
        return {
            "number": self.number, "study": self.order.study, "what": self.order.what,
            "command": self.order.shown, "state": self.state, "error": self.error,
            "seconds": round(end - self.began, 1), "next": self.first + len(lines),
            "lines": lines[max(0, since - self.first) :], "now": lines[-1] if lines else "",
        }  # fmt: skip

    def answer(self) -> Any:
        """Return what the command printed, read as JSON where it is that, else its text."""
        text = self.output.decode(errors="replace")
        try:
            return json.loads(text)
        except ValueError:
            return text


class Jobs:
    """The jobs of a server.

    Parameters
    ----------
    folder : path
        Where the commands run: the folder that holds the studies.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._jobs: dict[int, Job] = {}
        self._lock = threading.Lock()
        self._count = 0

    def start(self, order: Order) -> Job:
        """Start a command; return its job.

        Raises
        ------
        RequestError
            If another one of the same study is at work, or the server is about to end.
        """
        with self._lock:
            for one in self._jobs.values():
                if one.at_work and one.order.study == order.study:
                    raise RequestError(
                        f"{order.study}: `{one.order.shown}` is at work. Wait for it, or cancel "
                        "it.", HTTPStatus.CONFLICT,
                    )  # fmt: skip
            self._count += 1
            process = subprocess.Popen(
                program(order), cwd=self._folder, stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                env={**os.environ, LINES: "lines"}, **_own_group(),
            )  # fmt: skip
            job = Job(self._count, order, process, time.monotonic())
            self._jobs[job.number] = job
            for old in [n for n, one in self._jobs.items() if not one.at_work][:-KEPT_JOBS]:
                del self._jobs[old]
        job.watching = threading.Thread(target=self._watch, args=(job,), daemon=True)
        job.watching.start()
        return job

    def get(self, number: int) -> Job:
        """Return a job; RequestError if there is none of that number."""
        with self._lock:
            if number not in self._jobs:
                raise RequestError(f"there is no job {number}.", HTTPStatus.NOT_FOUND)
            return self._jobs[number]

    def all(self) -> list[Job]:
        """Return the jobs, the newest last."""
        with self._lock:
            return list(self._jobs.values())

    def cancel(self, number: int) -> Job:
        """Send Ctrl-C to a job's command; return the job."""
        job = self.get(number)
        with self._lock:
            if not job.at_work or job.state == "cancelling":
                return job
            job.state = "cancelling"
        _interrupt(job.process)
        threading.Thread(target=_insist, args=(job.process,), daemon=True).start()
        return job

    def close(self) -> None:
        """Cancel what is at work, and wait for it."""
        working = [self.cancel(one.number) for one in self.all() if one.at_work]
        for job in working:
            if job.watching is not None:
                job.watching.join(PATIENCE + 1.0)

    def _watch(self, job: Job) -> None:
        """Read what a command tells and prints until it ends."""
        assert job.process.stdout is not None
        assert job.process.stderr is not None
        wrong: list[str] = []
        told = threading.Thread(
            target=_each_line, daemon=True,
            args=(job.process.stderr, lambda text: self._sort(text, job, wrong)),
        )  # fmt: skip
        told.start()
        output = job.process.stdout.read(LONGEST_ANSWER)
        while job.process.stdout.read(1024**2):
            pass  # so that it does not wait for a reader
        code = job.process.wait()
        told.join()
        job.process.stdout.close()
        job.process.stderr.close()
        with self._lock:
            job.output, job.ended = output, time.monotonic()
            # A command that ended before Ctrl-C reached it has done its work; one that it reached
            # while Python was still starting may end with any code.
            asked = job.state == "cancelling" and code != 0
            job.state = "cancelled" if asked else ENDED.get(code, "failed")
            if job.state == "failed":
                job.error = "\n".join(wrong) or f"the process ended with code {code}."

    def _sort(self, text: str, job: Job, wrong: list[str]) -> None:
        """Keep progress, which ends in dots, apart from what is wrong."""
        if text.endswith(" ..."):
            job.told(text.removesuffix(" ..."))
        elif text.strip():
            wrong.append(text)


def program(order: Order) -> list[str]:
    """Return the words of the process that runs a command."""
    return [sys.executable, "-m", "bristle.cli", *order.words]


def _each_line(stream: IO[bytes], take: Callable[[str], None]) -> None:
    lines: Iterable[bytes] = iter(stream.readline, b"")
    for line in lines:
        take(line.decode(errors="replace").rstrip())


def _own_group() -> dict[str, Any]:
    """Return what keeps Ctrl-C in the server's terminal from the commands: they get their own."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    return {"start_new_session": True}


def _interrupt(process: subprocess.Popen[bytes]) -> None:
    if sys.platform == "win32":
        process.send_signal(signal.CTRL_BREAK_EVENT)
    else:
        process.send_signal(signal.SIGINT)


def _insist(process: subprocess.Popen[bytes]) -> None:
    """Send Ctrl-C again to a process that lost the first one, and end one that does not end."""
    try:
        process.wait(AGAIN)
        return
    except subprocess.TimeoutExpired:
        _interrupt(process)
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()


LARGEST_UPLOAD = 256 * 1024**2
"""Bytes of a file that may be dropped: as much as the reader of measurements takes."""
ROOM = 512 * 1024**2
"""Bytes that must be free on the disk beside an upload."""
_PIECE = 1024**2

OF_STUDY = (
    "data", "check", "fit", "errors", "residual", "verdict", "history", "design",
    "controllers", "channels",
)  # fmt: skip
"""Views of a study."""


class App:
    """The page on a folder that holds studies.

    Parameters
    ----------
    folder : path
        The folder of a study, or one that holds studies.

    Attributes
    ----------
    home : path
        The folder that holds studies.
    first : str
        The study that the page opens, "" where it shows them all.
    """

    def __init__(self, folder: Path) -> None:
        folder = folder.resolve()
        if not folder.is_dir():
            raise StudyError(
                f"{folder}: there is no such folder. Name a study, or a folder for studies."
            )
        is_study = (folder / "study.toml").is_file()
        self.home = folder.parent if is_study else folder
        self.first = folder.name if is_study else ""
        self.jobs = Jobs(self.home)
        self.answers = ViewCache()
        self._routes: list[tuple[str, re.Pattern[str], Handler]] = [
            (method, re.compile(pattern), handler)
            for method, pattern, handler in (
                ("GET", "/api/home", self._home),
                ("GET", "/api/state", self._state),
                ("GET", rf"/api/studies/([^/]+)/({'|'.join(OF_STUDY)})", self._view),
                ("GET", "/api/studies/([^/]+)/files", self._files),
                ("GET", "/api/studies/([^/]+)/file", self._file),
                ("GET", "/api/studies/([^/]+)/consent", self._waiting),
                ("POST", "/api/studies/([^/]+)/consent", self._consent),
                ("POST", "/api/studies/([^/]+)/(weights|preview)", self._asked),
                ("POST", "/api/studies/([^/]+)/design", self._design),
                ("PUT", "/api/uploads/([^/]+)/(building/)?([^/]+)", self._upload),
                ("GET", "/api/uploads/([^/]+)/columns", self._columns),
                ("POST", "/api/jobs", self._start),
                ("GET", "/api/jobs/([0-9]+)", self._job),
                ("POST", "/api/jobs/([0-9]+)/cancel", self._cancel),
                ("GET", "/api/scenarios", self._scenarios),
                ("POST", "/api/(simulate|spectrum)", self._simulate),
            )
        ]

    def start(self) -> None:
        """Start what takes time before anybody asks."""
        self.answers.start()

    def close(self) -> None:
        """End the worker, and interrupt the commands that are at work."""
        self.answers.close()
        self.jobs.close()

    def route(self, method: str, path: str) -> tuple[Handler, tuple[str, ...]]:
        """Return what answers a request, and what its path names.

        Raises
        ------
        RequestError
            If there is nothing at that path, or not for that method.
        """
        there = [(m, found, h) for m, p, h in self._routes if (found := p.fullmatch(path))]
        for own, found, handler in there:
            if own == method:
                return handler, tuple(part or "" for part in found.groups())
        if there:
            raise RequestError(f"{path}: {method} is not for this.", HTTPStatus.METHOD_NOT_ALLOWED)
        raise RequestError(f"{path}: there is no such page.", HTTPStatus.NOT_FOUND)

    def study(self, name: str) -> Path:
        """Return the folder of a study; RequestError if there is none of that name."""
        folder = self.home / file_name(name, "the study")
        if not (folder / "study.toml").is_file():
            raise RequestError(f"{name}: there is no such study.", HTTPStatus.NOT_FOUND)
        return folder

    def _home(self, request: Request) -> Answer:
        studies = [_about(folder) for folder in sorted(self.home.iterdir()) if _is_study(folder)]
        return as_json(
            {
                "version": __version__, "folder": str(self.home), "first": self.first,
                "studies": studies, "commands": sorted(COMMANDS),
                "jobs": [job.as_dict() for job in self.jobs.all()],
            }
        )  # fmt: skip

    def _state(self, request: Request) -> Answer:
        name = request.query.get("study", "")
        known = bool(name) and _is_study(self.home / file_name(name, "the study"))
        since = _whole(request.query.get("since", "0"))
        jobs = [job.as_dict(since if job.at_work else 0) for job in self.jobs.all()]
        return as_json({"jobs": jobs, "stamp": fingerprint(self.home / name) if known else ""})

    def _view(self, request: Request) -> Answer:
        name, view = request.parts
        arguments = {key: request.query[key] for key in ("role", "name") if key in request.query}
        # Dropped records and other studies are beside the study.
        keep = view not in ("controllers", "design")
        return Answer(self.answers.get(view, self.study(name), arguments, keep), PACKED)

    def _files(self, request: Request) -> Answer:
        return as_json({"files": files_of(self.study(request.parts[0]))})

    def _file(self, request: Request) -> Answer:
        folder = self.study(request.parts[0])
        name = request.query.get("name", "")
        if not is_given(folder, name):
            raise RequestError(f"{name}: there is no such file.", HTTPStatus.NOT_FOUND)
        path = folder / name
        headers = {"Content-Disposition": "attachment"}
        return Answer(_pieces(path), kind_of(path), length=path.stat().st_size, headers=headers)

    def _waiting(self, request: Request) -> Answer:
        return as_json({"texts": waiting_texts(self.study(request.parts[0]))})

    def _consent(self, request: Request) -> Answer:
        asked = request.json()
        consent(self.study(request.parts[0]), asked.get("file"), asked.get("digest"))
        return as_json({"ok": True})

    def _asked(self, request: Request) -> Answer:
        folder, view = self.study(request.parts[0]), request.parts[1]
        return Answer(self.answers.get(view, folder, request.json(), keep=False), PACKED)

    def _design(self, request: Request) -> Answer:
        folder, asked = self.study(request.parts[0]), request.json()
        name = write_design(folder, asked.get("kind"), asked.get("values", {}), _building(folder))
        return as_json({"name": name}, HTTPStatus.CREATED)

    def _upload(self, request: Request) -> Answer:
        batch, below, name = request.parts
        if request.length > LARGEST_UPLOAD:
            raise RequestError(
                f"{name}: {request.length / 1024**2:.0f} MB; a measurement may have "
                f"{LARGEST_UPLOAD // 1024**2} MB. Cut it, or sample it more coarsely.",
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
            )
        if request.length == 0:
            raise RequestError(f"{name}: the file is empty.")
        folder = self.home / UPLOADS / batch_name(batch) / below
        path = folder / file_name(name, "the file")
        if shutil.disk_usage(self.home).free < request.length + ROOM:
            raise RequestError(
                f"{name}: the disk has no room for it.", HTTPStatus.INSUFFICIENT_STORAGE
            )
        folder.mkdir(parents=True, exist_ok=True)
        _receive(request, path)
        return as_json({"name": path.name, "bytes": request.length}, HTTPStatus.CREATED)

    def _columns(self, request: Request) -> Answer:
        folder = self.home / UPLOADS / batch_name(request.parts[0])
        if not folder.is_dir():
            raise RequestError("these files are no longer there; drop them again.")
        arguments = {"building": request.query.get("building", "")}
        return Answer(self.answers.get("columns", folder, arguments, keep=False), PACKED)

    def _start(self, request: Request) -> Answer:
        asked = request.json()
        options = asked.get("options", {})
        if not isinstance(options, dict):
            raise RequestError("options: an object is right.")
        order = order_of(asked.get("what"), asked.get("study"), options)
        if order.what not in ("new", "example"):
            self.study(order.study)
        return as_json(self.jobs.start(order).as_dict(), HTTPStatus.CREATED)

    def _job(self, request: Request) -> Answer:
        job = self.jobs.get(int(request.parts[0]))
        told = job.as_dict(_whole(request.query.get("since", "0")))
        return as_json({**told, "answer": None if job.at_work else job.answer()})

    def _cancel(self, request: Request) -> Answer:
        return as_json(self.jobs.cancel(int(request.parts[0])).as_dict())

    def _scenarios(self, request: Request) -> Answer:
        return Answer(self.answers.get("scenarios", self.home, {}, keep=False), PACKED)

    def _simulate(self, request: Request) -> Answer:
        view = request.parts[0]
        return Answer(self.answers.get(view, self.home, request.json(), keep=False), PACKED)


def _is_study(folder: Path) -> bool:
    return (folder / "study.toml").is_file() and not folder.name.startswith(".")


def _building(folder: Path) -> str:
    """Return the file of a study's building, as its model names it, "" where there is none."""
    return str(toml_content(folder / "model.toml").get("building", ""))


def _about(folder: Path) -> dict[str, Any]:
    """Return what the first screen tells of a study, without reading its measurements."""
    about: dict[str, Any] = {"name": folder.name, "title": folder.name, "error": ""}
    try:
        settings = Document(folder / "study.toml", StudyError).data
        runs = [run for run in settings.get("runs", []) if isinstance(run, dict)]
        about |= {
            "title": str(settings.get("title", folder.name)),
            "rig": str(settings.get("rig", "bench")), "runs": len(runs),
            "held_out": sum(run.get("role") == "holdout" for run in runs),
        }  # fmt: skip
    except StudyError as error:
        about["error"] = str(error)
    with suppress(OSError, ValueError):
        verdict = json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
        about |= {"verdict": str(verdict["kind"]), "effects": list(verdict.get("effects", []))}
    return about


def _receive(request: Request, path: Path) -> None:
    """Write the body of a request into a file, whole or not at all."""
    draft = path.with_name(f".{path.name}.part")
    left = request.length
    try:
        with draft.open("wb") as file:
            while left:
                piece = request.body.read(min(left, _PIECE))
                if not piece:
                    raise RequestError(f"{path.name}: the upload broke off. Drop it again.")
                file.write(piece)
                left -= len(piece)
        draft.replace(path)
    except OSError as error:
        raise RequestError(f"{path.name}: cannot be kept ({error.strerror or error}).") from None
    finally:
        draft.unlink(missing_ok=True)


def _pieces(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            yield piece


def _whole(text: str) -> int:
    return int(text) if text.isascii() and text.isdigit() and len(text) < 10 else 0


def error_of(error: BristleError) -> tuple[HTTPStatus, dict[str, Any]]:
    """Return how an error is told to a page: status, and what JSON holds."""
    status = getattr(error, "status", HTTPStatus.UNPROCESSABLE_ENTITY)
    told = getattr(error, "told", {"error": str(error), "kind": type(error).__name__})
    return status, told


# The page's server: HTTP on 127.0.0.1 for the browser of one user.
#
# It is the standard library's, in threads: a page of one user needs no more, and what it sends are
# files of this package and answers of `app`. It starts before anything heavy is imported.

STATIC = Path(__file__).with_name("static")
KINDS = {
    ".html": "text/html; charset=utf-8", ".css": "text/css; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8", ".svg": "image/svg+xml",
}  # fmt: skip
IDLE = 60.0
"""Seconds after which a connection without a request is closed."""


class PageServer(ThreadingHTTPServer):
    """Serves the page of an app on 127.0.0.1.

    Parameters
    ----------
    app : App
    port : int
        0 takes a free one.
    """

    daemon_threads = True
    allow_reuse_address = sys.platform != "win32"  # there it would let another process in

    def __init__(self, app: App, port: int = 0) -> None:
        self.app = app
        super().__init__(("127.0.0.1", port), _Handler)
        self.guard = Guard(self.server_address[1], secrets.token_urlsafe(32))
        self.parts = static_parts()

    @property
    def address(self) -> str:
        """What is opened in a browser; the token stands behind #, which no browser sends."""
        return f"http://127.0.0.1:{self.guard.port}/#token={self.guard.token}"

    def server_bind(self) -> None:
        """Bind without asking a name server what this machine is called."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = "127.0.0.1", self.server_address[1]

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Keep quiet where a browser has gone; else show the traceback on stderr."""
        if not isinstance(sys.exc_info()[1], ConnectionError | TimeoutError):
            traceback.print_exc()

    def server_close(self) -> None:
        """Close the socket, interrupt commands at work, end the worker."""
        super().server_close()
        self.app.close()


def static_parts() -> dict[str, Path]:
    """Return the files that the page consists of, by path: no other file is ever read for it."""
    own = [path for path in STATIC.rglob("*") if path.suffix in KINDS]
    found = {f"/{path.relative_to(STATIC).as_posix()}": path for path in own}
    return {**found, "/": STATIC / "page.html"}


class _Handler(BaseHTTPRequestHandler):
    """Lets requests in or refuses them, and sends answers."""

    server: PageServer
    protocol_version = "HTTP/1.1"
    server_version = "bristle"
    sys_version = ""
    timeout = IDLE

    def do_GET(self) -> None:
        self._serve()

    def do_POST(self) -> None:
        self._serve()

    def do_PUT(self) -> None:
        self._serve()

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: requests are of no interest, and answers may be private."""

    def _serve(self) -> None:
        self._left = 0
        try:
            answer = self._answer()
        except BristleError as error:
            status, told = error_of(error)
            answer = as_json(told, status)
        except Exception as error:
            traceback.print_exc()
            text = f"an unexpected error ({type(error).__name__}); the terminal shows more."
            answer = as_error(text, HTTPStatus.INTERNAL_SERVER_ERROR)
        self._send(answer)

    def _answer(self) -> Answer:
        path = urlsplit(self.path)
        name = unquote(path.path)
        part = self.server.parts.get(name) if self.command == "GET" else None
        refusal = self.server.guard.refusal(self.headers, needs_token=part is None)  # type: ignore[arg-type]
        length = self._length()
        if refusal is not None:
            self.close_connection = True  # its body stays unread
            return as_error(refusal.text, refusal.status)
        if part is not None:
            return Answer(part.read_bytes(), KINDS[part.suffix])
        query = {key: values[0] for key, values in parse_qs(path.query).items()}
        handler, parts = self.server.app.route(self.command, path.path)
        self._left = length
        request = Request(tuple(map(unquote, parts)), query, length, self)  # type: ignore[arg-type]
        return handler(request)

    def read(self, count: int) -> bytes:
        """Return up to `count` bytes of the body."""
        found = self.rfile.read(min(count, self._left))
        self._left -= len(found)
        return found

    def _length(self) -> int:
        """Return the length of the body [bytes]; one that is not told is refused."""
        text = self.headers.get("Content-Length", "0")
        if "Transfer-Encoding" in self.headers or not (text.isascii() and text.isdigit()):
            self.close_connection = True
            raise RequestError("the length of a body must be told.", HTTPStatus.LENGTH_REQUIRED)
        return int(text)

    def _send(self, answer: Answer) -> None:
        if self._left:
            self.close_connection = True  # what is left of the body is no next request
        body = answer.body
        length = answer.length if answer.length is not None else len(body)  # type: ignore[arg-type]
        with suppress(ConnectionError, TimeoutError):
            self.send_response(answer.status)
            for name, value in {**HEADERS, **answer.headers}.items():
                self.send_header(name, value)
            self.send_header("Content-Type", answer.kind)
            self.send_header("Content-Length", str(length))
            if self.close_connection:
                self.send_header("Connection", "close")
            self.end_headers()
            for piece in [body] if isinstance(body, bytes) else body:
                self.wfile.write(piece)


# Runs the page's server until Ctrl-C, and opens the browser.


def serve(app: App, port: int, ready: Callable[[str], None]) -> None:
    """Serve an app until Ctrl-C, then interrupt its commands.

    Parameters
    ----------
    app : App
    port : int
        0 takes a free one.
    ready : callable
        Is given the address once it is answered.

    Raises
    ------
    RunError
        If the port cannot be had.
    """
    over = threading.Event()

    def end(number: int, frame: FrameType | None) -> None:
        over.set()

    with serving(app, port) as server:
        before = {one: signal.signal(one, end) for one in (signal.SIGINT, signal.SIGTERM)}
        try:
            ready(server.address)
            while not over.wait(0.5):  # Windows wakes for a signal between two waits alone
                pass
        finally:
            for one, handler in before.items():
                signal.signal(one, handler)
            opener().unlink(missing_ok=True)


@contextmanager
def serving(app: App, port: int = 0) -> Iterator[PageServer]:
    """Serve an app from a thread; at the end interrupt its commands.

    Parameters
    ----------
    app : App
    port : int
        0 takes a free one.

    Raises
    ------
    RunError
        If the port cannot be had.
    """
    try:
        server = PageServer(app, port)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise not_usable(f"port {port} of 127.0.0.1 cannot be had ({reason}).") from None
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        app.start()
        yield server
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def opener() -> Path:
    """Return the file that leads a browser to the page of this process."""
    return state_folder() / "page" / f"{os.getpid()}.html"


def open_browser(address: str) -> None:
    """Open an address in the user's browser.

    The browser is given a file of this user that leads there: other users of the machine can read
    the arguments of a process, and the token is in the address.
    """
    file = opener()
    try:
        file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        file.unlink(missing_ok=True)
        with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as stream:
            target = html.escape(address)
            stream.write(f'<meta http-equiv="refresh" content="0; url={target}">\n')
    except OSError:
        return  # the address is printed
    webbrowser.open(file.as_uri())
