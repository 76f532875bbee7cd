"""A page served for tests, and requests as a browser or a stranger sends them."""

from __future__ import annotations

import http.client
import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bristle.page.app import App, PageServer, serving


@dataclass(frozen=True)
class Answered:
    """What the server sent back."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)

    @property
    def error(self) -> str:
        return str(self.json["error"])


@dataclass(frozen=True)
class Client:
    """Asks a server as its own page does; headers that are given take the place of its own.

    None leaves one out.
    """

    server: PageServer

    def ask(self, method: str, path: str, body: Any = None, **headers: str | None) -> Answered:
        port = self.server.guard.port
        known: dict[str, str | None] = {
            "Host": f"127.0.0.1:{port}", "Origin": f"http://127.0.0.1:{port}",
            "Authorization": f"Bearer {self.server.guard.token}",
        }  # fmt: skip
        known |= {name.replace("_", "-"): value for name, value in headers.items()}
        data = body if isinstance(body, bytes) or body is None else json.dumps(body).encode()
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=600.0)
        try:
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in known.items():
                if value is not None:
                    connection.putheader(name, value)
            if data is not None and "Content-Length" not in known:
                connection.putheader("Content-Length", str(len(data)))
            with suppress(BrokenPipeError):  # a body that is refused is not read to its end
                connection.endheaders(data)
            answer = connection.getresponse()
            return Answered(answer.status, dict(answer.getheaders()), answer.read())
        finally:
            connection.close()

    def get(self, path: str, **headers: str | None) -> Answered:
        return self.ask("GET", path, **headers)

    def post(self, path: str, content: Any, **headers: str | None) -> Answered:
        return self.ask("POST", path, content, **headers)

    def run(self, what: str, study: str, seconds: float = 120.0, **options: Any) -> dict[str, Any]:
        """Start a command and return its job once it has ended."""
        started = self.post("/api/jobs", {"what": what, "study": study, "options": options})
        assert started.status == 201, started.body
        return self.ended(started.json["number"], seconds)

    def ended(self, number: int, seconds: float = 120.0) -> dict[str, Any]:
        """Return a job once it has ended."""
        limit = time.monotonic() + seconds
        while time.monotonic() < limit:
            job: dict[str, Any] = self.get(f"/api/jobs/{number}").json
            if job["state"] not in ("running", "cancelling"):
                return job
            time.sleep(0.05)
        raise AssertionError(f"job {number} is still at work: {job}")


@contextmanager
def page_on(folder: Path, start: bool = True) -> Iterator[Client]:
    """Serve a page on a folder; without `start` nothing is made ready ahead."""
    app = App(folder)
    if not start:
        app.start = lambda: None  # type: ignore[method-assign]
    with serving(app) as server:
        yield Client(server)
