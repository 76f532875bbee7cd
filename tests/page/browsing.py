"""The page in a real Chromium, driven by Playwright: what its tests share."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from page.served import Client

ROOT = Path(__file__).resolve().parents[2]


def pictures() -> ModuleType:
    """Return the script that takes the screenshots: it starts the browser."""
    spec = importlib.util.spec_from_file_location(
        "docs_page_pictures", ROOT / "docs" / "page_pictures.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


shots = pictures()
needs_browser = [
    pytest.mark.skipif(
        importlib.util.find_spec("playwright") is None, reason="Playwright is not installed"
    ),
    pytest.mark.skipif(shots.browser_path() is None, reason="there is no Chromium"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]


def expect(part: Any) -> Any:
    """Return Playwright's assertions on a part of a page: each waits until it holds."""
    from playwright.sync_api import expect as found

    found.set_options(timeout=30_000)
    return found(part)


class Watched:
    """A page of the browser, with what its console and its network saw."""

    def __init__(self, page: Any, client: Client) -> None:
        self.page, self.client = page, client
        self.errors: list[str] = []
        self.elsewhere: list[str] = []
        own = f"http://127.0.0.1:{client.server.guard.port}/"
        page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on(
            "request",
            lambda r: (
                None if r.url.startswith((own, "data:", "blob:")) else self.elsewhere.append(r.url)
            ),
        )
        page.goto(client.server.address)
        page.wait_for_selector("html[data-ready]", timeout=60_000)

    def open(self, study: str, view: str) -> None:
        shots.open_view(self.page, self.client.server.address, study, view)

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).click()

    def wait(self, text: str, seconds: float = 300.0) -> None:
        self.page.get_by_text(text).first.wait_for(timeout=1000.0 * seconds)
