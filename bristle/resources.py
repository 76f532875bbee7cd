"""Where things are: the checkout that the package runs from, or the wheel and the cache."""

from __future__ import annotations

import os
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def root() -> Path | None:
    """Return the checkout's folder, or None when the package is installed."""
    folder = _PACKAGE.parent
    return folder if (folder / "build_fmus.py").is_file() else None


def components_folder() -> Path:
    """Return the folder with one source file per built-in component."""
    return (root() or _PACKAGE) / "components"


def scenarios_folder() -> Path:
    """Return the folder with the stock scenarios."""
    return (root() or _PACKAGE) / "scenarios"


def ensembles_folder() -> Path:
    """Return the folder with the stock ensembles."""
    return (root() or _PACKAGE) / "ensembles"


def cache_folder() -> Path:
    """Return the user's cache folder, `$BRISTLE_CACHE` where that is set; it may not exist yet."""
    chosen = os.environ.get("BRISTLE_CACHE")
    if chosen:
        return Path(chosen).expanduser().absolute()
    from platformdirs import user_cache_path

    return user_cache_path("bristle", appauthor=False)


def state_folder() -> Path:
    """Return where what must outlive the cache is kept, `$BRISTLE_STATE` where that is set.

    Consent to code, and tracebacks; it may not exist yet.
    """
    chosen = os.environ.get("BRISTLE_STATE")
    if chosen:
        return Path(chosen).expanduser().absolute()
    from platformdirs import user_state_path

    return user_state_path("bristle", appauthor=False)


def fmus_folder() -> Path:
    """Return where built FMUs are kept: fmus/ of a checkout, else the cache."""
    checkout = root()
    return (
        checkout / "fmus"
        if checkout and not os.environ.get("BRISTLE_CACHE")
        else (cache_folder() / "fmus")
    )
