"""Runs the page's server until Ctrl-C, and opens the browser."""

from __future__ import annotations

import html
import os
import signal
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from ..core.files import state_folder
from ..errors import not_usable
from .app import App, PageServer


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
