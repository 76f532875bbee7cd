"""Takes a screenshot of every view of the page, at 1280 and 400 px, light and dark.

python docs/page_pictures.py STUDY OUT [VIEW ...]

View 4 is shown at work as well, as verdict_live: on a copy of the study, whose work is cancelled.
Needs Playwright and Chromium.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
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
LIVE = {"verdict_live": ("Diagnose", "h3:text('What remains of the cost')")}
"""Views at work: the button that starts it, and what shows that it is well under way."""
WORK = 300.0
"""Seconds within which that must be shown."""
LATER = 1.0
"""Seconds from then to the picture."""
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
    page.wait_for_timeout(400)  # what is asked for when a view is shown, and the next frame
    page.wait_for_selector(READY.format(place=place), timeout=120_000)


def shoot(page: Page, out: Path, name: str, width: int, theme: str) -> None:
    """Write what is shown, whole, as OUT/NAME_WIDTH_THEME.png."""
    target = out / f"{name}_{width}_{theme}.png"
    page.screenshot(path=target, full_page=True)
    print(target)


def views_at_rest(study: Path, out: Path, views: tuple[str, ...]) -> None:
    """Write the pictures of views of a study."""
    from bristle.page.app import App, serving

    with serving(App(study)) as server:
        for width in WIDTHS:
            for theme in THEMES:
                with chromium(width, theme) as page:
                    page.goto(server.address)
                    page.wait_for_selector("html[data-ready]", timeout=60_000)
                    for view in views:
                        open_view(page, server.address, study.name, view)
                        shoot(page, out, view, width, theme)


def views_at_work(study: Path, out: Path, views: tuple[str, ...]) -> None:
    """Write the pictures of views while their command is at work on a copy of a study."""
    from bristle.page.app import App, serving

    with tempfile.TemporaryDirectory() as folder:
        copy = shutil.copytree(study, Path(folder, study.name))
        with serving(App(copy)) as server, chromium(WIDTHS[0], THEMES[0]) as page:
            page.goto(server.address)
            page.wait_for_selector("html[data-ready]", timeout=60_000)
            for view in views:
                open_view(page, server.address, study.name, view.partition("_")[0])
                button, shown = LIVE[view]
                page.get_by_role("button", name=re.compile(f"^{button}( again)?$")).click()
                page.wait_for_selector(shown, timeout=1000.0 * WORK)
                page.wait_for_timeout(1000.0 * LATER)
                for theme in THEMES:
                    for width in WIDTHS:
                        page.set_viewport_size({"width": width, "height": 900})
                        page.wait_for_timeout(150)
                        shoot(page, out, view, width, theme)
                    page.locator("#theme").click()
                end(page)


def end(page: Page) -> None:
    """Cancel what is at work, unless it is done."""
    cancel = page.get_by_role("button", name="Cancel")
    if cancel.is_visible():
        cancel.click()
    cancel.wait_for(state="hidden", timeout=1000.0 * WORK)


def main(study: Path, out: Path, views: tuple[str, ...] = (*VIEWS, *LIVE)) -> None:
    """Write a study's views as OUT/VIEW_WIDTH_THEME.png."""
    sys.path.insert(0, str(ROOT))
    for view in views:
        if view not in (*VIEWS, *LIVE):
            sys.exit(f"{view}: no view is called so. There are: {', '.join((*VIEWS, *LIVE))}.")
    if not (study / "study.toml").is_file():
        sys.exit(f"{study}: holds no study; a folder with study.toml is right.")
    out.mkdir(parents=True, exist_ok=True)
    study = study.resolve()
    if resting := tuple(view for view in views if view in VIEWS):
        views_at_rest(study, out, resting)
    if working := tuple(view for view in views if view in LIVE):
        views_at_work(study, out, working)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]), tuple(sys.argv[3:]) or (*VIEWS, *LIVE))
