"""The two forms of the built-in components' FMUs: in Python, or native, which a compiler makes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..errors import not_usable
from ..interrupt import deferred

FORMS = ("python", "native")


def ensure_of(form: str, engine: str) -> Callable[..., Path]:
    """Return what gives a built-in component's FMU of a form: `ensure` of fmu or of native.

    Parameters
    ----------
    form : str
        Of `FORMS`.
    engine : str
        "fmu", or "compiled", which steps none.

    Raises
    ------
    BristleError
        If there is no such form; if native FMUs are asked for where none is stepped.
    KeyboardInterrupt
        Ctrl-C while what makes native FMUs was imported, raised once that is whole.
    """
    if form not in FORMS:
        raise not_usable(f'fmus "{form}" is not known; there are: {", ".join(FORMS)}.')
    if form == "python":
        from ..fmu.build import ensure

        return ensure
    if engine != "fmu":
        raise not_usable(f'native FMUs: engine "{engine}" steps no FMUs; "fmu" does.')
    with deferred():  # an import of llvmlite that Ctrl-C breaks off is never made good
        from ..native.build import ensure as ensure_native
    return ensure_native
