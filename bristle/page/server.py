"""The page's server: HTTP on 127.0.0.1 for the browser of one user.

It is the standard library's, in threads: a page of one user needs no more, and what it sends are
files of this package and answers of `app`. It starts before anything heavy is imported.
"""

from __future__ import annotations

import secrets
import socketserver
import sys
import traceback
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from ..errors import BristleError
from .app import App, error_of
from .guard import HEADERS, Guard
from .message import Answer, Request, RequestError, as_error, as_json

STATIC = Path(__file__).with_name("static")
LOADER = Path(__file__).parent.parent / "web"
"""Folder with what runs a scenario's WebAssembly module."""
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
    return {
        **found, "/": STATIC / "page.html", "/bristle.mjs": LOADER / "bristle.mjs",
    }  # fmt: skip


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
