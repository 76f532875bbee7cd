"""Takes a screenshot of every view of the page, at 1280 and 400 px, light and dark.

python docs/page_pictures.py FOLDER OUT [VIEW ...]   FOLDER as for `bristle page`; a study in it
is named first: the views are those of the study that the page opens. Needs Playwright and Chromium.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROOT = Path(__file__).resolve().parent.parent
VIEWS = (
    "home", "data", "fit", "errors", "verdict", "history", "hand_on", "simulate", "design",
    "controllers",
)  # fmt: skip
WIDTHS = (1280, 400)
THEMES = ("light", "dark")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
READY = 'html[data-ready="{place}"]:not(:has(.loading))'


def browser_path() -> str | None:
    """Return the Chromium of the system, None where there is none."""
    return next((found for name in BROWSERS if (found := shutil.which(name))), None)


@contextmanager
def chromium(width: int = 1280, theme: str = "light", **choices: Any) -> Iterator[Page]:
    """Give a page of the system's Chromium.

    Parameters
    ----------
    width : of the window [px]
    theme : "light" or "dark", which the system is said to prefer
    choices : passed on to Playwright's `new_context`
    """
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=browser_path(), args=["--no-sandbox"], headless=True
        )
        scheme: Any = theme
        context = browser.new_context(
            viewport={"width": width, "height": 900}, color_scheme=scheme, **choices
        )
        try:
            yield context.new_page()
        finally:
            browser.close()


def open_view(page: Page, address: str, study: str, view: str) -> None:
    """Open a view, and wait until it is shown whole."""
    place = "/home" if view == "home" else f"{study}/{view}"
    hash_ = "#/" if view == "home" else f"#/{study}/{view}"
    page.evaluate(f"location.hash = {hash_!r}")
    page.wait_for_selector(READY.format(place=place), timeout=120_000)
    page.wait_for_timeout(150)  # pictures are drawn with the next frame of the screen


def main(folder: Path, out: Path, views: tuple[str, ...] = VIEWS) -> None:
    """Write FOLDER's views as OUT/VIEW_WIDTH_THEME.png."""
    sys.path.insert(0, str(ROOT))
    from bristle.page.app import App
    from bristle.page.run import serving

    out.mkdir(parents=True, exist_ok=True)
    with serving(App(folder)) as server:
        study = server.app.first
        for width in WIDTHS:
            for theme in THEMES:
                with chromium(width, theme) as page:
                    page.goto(server.address)
                    page.wait_for_selector("html[data-ready]", timeout=60_000)
                    for view in views:
                        open_view(page, server.address, study, view)
                        target = out / f"{view}_{width}_{theme}.png"
                        page.screenshot(path=target, full_page=True)
                        print(target)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]), tuple(sys.argv[3:]) or VIEWS)
