"""Files written whole or not at all, TOML read with its lines; folders of data and caches."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any

from ..errors import StudyError
from .config import read_text
from .text import written


@contextmanager
def writing(path: str | Path, raises: Callable[[str], Exception]) -> Iterator[None]:
    """Say, where a file, or one in a folder, cannot be written, which and why.

    Parameters
    ----------
    path : of the file or folder
    raises : makes the error from its text
    """
    try:
        yield
    except OSError as error:
        inside = error.filename and Path(error.filename).is_relative_to(path)
        which = error.filename if inside else path
        raise raises(f"{which}: cannot be written ({error.strerror or error}).") from error


@contextmanager
def reading(path: str | Path, raises: Callable[[str], Exception]) -> Iterator[None]:
    """Say, where a file cannot be read, which and why; parameters as for `writing`."""
    try:
        yield
    except OSError as error:
        raise raises(f"{path}: cannot be read ({error.strerror or error}).") from error


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file so that there is the old one or the new one at any time, never a part.

    Raises
    ------
    StudyError
        If it cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    draft: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
        draft = Path(name)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        draft.chmod(0o666 & ~_umask())
        draft.replace(path)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({error.strerror or error}).") from None
    finally:
        if draft is not None:
            draft.unlink(missing_ok=True)


def write_new(
    path: Path, text: str, raises: Callable[[str], Exception], folder: bool = False
) -> Path:
    """Write a file that is not there yet; return its path.

    Parameters
    ----------
    path, text : of the file
    raises : makes the error from its text, where it is there already or cannot be written
    folder : True makes its folder as well
    """
    try:
        if folder:
            path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise raises(f"{path} is there already; another name, or remove it.") from None
    except OSError as error:
        raise raises(f"{path}: cannot be written ({error.strerror or error}).") from None
    return path


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Yield a folder beside a new one's place, which goes there once it is whole.

    Raises
    ------
    StudyError
        If it cannot be written.
    """
    draft: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}-"))
        yield draft
        draft.chmod(0o755)
        draft.replace(path)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({error.strerror or error}).") from None
    finally:
        if draft is not None:
            shutil.rmtree(draft, ignore_errors=True)


def replaced_by(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` make a file beside another, and put it in that one's place once it is whole.

    Raises
    ------
    OSError
        If it cannot be written: the old file is left as it is.
    """
    new = path.with_name(path.name + ".new")
    try:
        write(new)
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file whole, as `json_text`."""
    write_whole(path, json_text(data) + "\n")


def json_text(data: Any) -> str:
    """Return data as the text of a JSON file; numbers that are not finite become null."""
    return json.dumps(as_json(data), indent=2, ensure_ascii=False)


def read_json(path: Path) -> dict[str, Any]:
    """Return the content of a JSON file that holds an object; StudyError if it does not."""
    try:
        found = json.loads(read_text(path, StudyError))
    except ValueError as error:
        raise StudyError(f"{path}: no JSON ({error}). Remove or correct the file.") from None
    if not isinstance(found, dict):
        raise StudyError(f"{path}: holds {written(found)}: expected an object.")
    return found


def as_json(value: Any, of_array: Callable[[Any], Any] | None = None) -> Any:
    """Return a value as JSON has it: NaN and infinity null, numbers of numpy and tuples turned.

    Parameters
    ----------
    value : plain data with numpy arrays in it
    of_array : what becomes of an array; else a list
    """
    if isinstance(value, Mapping):
        return {str(key): as_json(item, of_array) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(item, of_array) for item in value]
    if hasattr(value, "tolist"):
        if of_array and getattr(value, "ndim", 0) > 0:
            return of_array(value)
        return as_json(value.tolist(), of_array)
    if isinstance(value, float) and not isfinite(value):
        return None
    return value


def _umask() -> int:
    """Return the process's umask, which can only be read by setting it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


_PACKAGE = Path(__file__).resolve().parent.parent


def root() -> Path | None:
    """Return the checkout's folder, or None when the package is installed."""
    folder = _PACKAGE.parent
    return folder if (folder / "build_fmus.py").is_file() else None


def components_folder() -> Path:
    """Return the folder with one source file per built-in component."""
    return (root() or _PACKAGE) / "components"


def licence_file() -> Path:
    """Return the file with bristle's licence."""
    return (root() or _PACKAGE) / "LICENSE"


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
    own = None if os.environ.get("BRISTLE_CACHE") else root()
    return (own or cache_folder()) / "fmus"
