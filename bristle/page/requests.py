"""Which requests the page answers, and the names, files and consent that they may carry.

The server listens on 127.0.0.1, and that alone keeps nobody out: every page that the browser shows
may send requests there, and so may every user of the machine. Three things together do:

- the token, a secret of this server that the page sends in a header. It is no cookie: browsers send
  the cookies of 127.0.0.1 to every port there, and another user may listen at the next one.
- `Host` must be the address that was opened. A foreign name that a name server leads here (DNS
  rebinding) is another.
- `Origin` must be the page's own, as must what the browser says of where a request comes from.

What the page consists of (HTML, style, scripts) holds no secret and is given without a token: the
page reads it from the part of its address that no browser sends (behind #).
"""

from __future__ import annotations

import hmac
import json
import mimetypes
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from pathlib import Path
from typing import Any, BinaryIO

from ..core.text import written
from ..errors import BristleError
from ..trust import digest, is_trusted, readable, remember
from ..user_code.reading import text_of

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; "
        "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""What every answer tells the browser: nothing from elsewhere, nothing kept, shown in no frame."""


@dataclass(frozen=True)
class Refusal:
    """Why a request is not answered: status and sentence."""

    status: HTTPStatus
    text: str


@dataclass(frozen=True)
class Guard:
    """Knows the port and the token of a server."""

    port: int
    token: str

    @property
    def hosts(self) -> tuple[str, ...]:
        """The values of `Host` by which this server may be asked."""
        return f"127.0.0.1:{self.port}", f"localhost:{self.port}"

    def refusal(self, headers: Mapping[str, str], *, needs_token: bool) -> Refusal | None:
        """Return why a request is refused, None where it is not.

        Parameters
        ----------
        headers : of the request; names in any case
        needs_token : whether it asks for more than the parts that the page consists of
        """
        host, origin = headers.get("Host", ""), headers.get("Origin")
        if host not in self.hosts:
            return Refusal(
                HTTPStatus.MISDIRECTED_REQUEST,
                f'this server is {self.hosts[0]}, not "{host}". Open the address that '
                "`bristle page` printed.",
            )
        if origin is not None and origin != f"http://{host}":
            return Refusal(HTTPStatus.FORBIDDEN, "requests of other pages are refused.")
        if not needs_token:
            return None
        if headers.get("Sec-Fetch-Site", "same-origin") != "same-origin":
            return Refusal(HTTPStatus.FORBIDDEN, "requests of other pages are refused.")
        scheme, _, given = headers.get("Authorization", "").partition(" ")
        if scheme != "Bearer" or not hmac.compare_digest(given.encode(), self.token.encode()):
            return Refusal(
                HTTPStatus.UNAUTHORIZED,
                "the token is missing or of another server. Open the address that "
                "`bristle page` printed.",
            )
        return None


# Requests and answers of the page's server, as plain data.

LARGEST_JSON = 1024**2
"""Largest body of a request that is no upload [bytes]."""

PACKED = "application/x-bristle-packed"
"""Type of the answers that hold numbers: see `packing`."""


class RequestError(BristleError):
    """A request that cannot be answered as it is; `status` is what HTTP calls it."""

    def __init__(self, text: str, status: HTTPStatus = HTTPStatus.BAD_REQUEST) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True)
class Request:
    """A request that was let in.

    `parts` is what the route's pattern found in the path, `query` the first value of each name,
    `length` of the body in bytes, which `body` reads.
    """

    parts: tuple[str, ...]
    query: Mapping[str, str]
    length: int
    body: BinaryIO

    def json(self) -> dict[str, Any]:
        """Return the body as an object of JSON.

        Raises
        ------
        RequestError
            If it is too large or no such object.
        """
        if self.length > LARGEST_JSON:
            raise RequestError(
                f"{self.length} bytes of JSON; {LARGEST_JSON} are allowed.",
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
            )
        try:
            found = json.loads(self.body.read(self.length))
        except ValueError:
            found = None
        if not isinstance(found, dict):
            raise RequestError("the body is no JSON object.")
        return found


@dataclass(frozen=True)
class Answer:
    """What is sent back: a body of bytes, or pieces of one of a known length."""

    body: bytes | Iterator[bytes]
    kind: str = "application/json"
    status: HTTPStatus = HTTPStatus.OK
    length: int | None = None
    headers: Mapping[str, str] = field(default_factory=dict)


Handler = Callable[[Request], Answer]


def as_json(content: Any, status: HTTPStatus = HTTPStatus.OK) -> Answer:
    """Return plain data as an answer."""
    return Answer(json.dumps(content, ensure_ascii=False).encode(), status=status)


def as_error(text: str, status: HTTPStatus) -> Answer:
    """Return a sentence about what is wrong as an answer."""
    return as_json({"error": text}, status)


# Consent to a study's own effects and laws from the page: to the text that was shown, to no other.
#
# The commands that the page starts are never given `--trust`: they run what was consented to here.


def own_files(folder: Path) -> list[Path]:
    """Return the files of a study's own laws and effects."""
    return [file for name in ("laws", "effects") for file in sorted((folder / name).glob("*.py"))]


def waiting_texts(folder: Path) -> list[dict[str, Any]]:
    """Return what has not run on this machine before: file, text, digest.

    In the text nothing hides: what moves a cursor or turns writing is spelled.
    """
    found = []
    for file in own_files(folder):
        text = text_of(file, "replace")
        if not is_trusted(text):
            name = file.relative_to(folder).as_posix()
            found.append({"file": name, "text": readable(text), "digest": digest(text)})
    return found


def consent(folder: Path, name: object, shown: object) -> None:
    """Remember that the user consents to the file of this name with the text of this digest.

    Raises
    ------
    RequestError
        If there is no such file, or its text is no longer the one that was shown.
    TrustError
        If consent cannot be kept.
    """
    for file in own_files(folder):
        if file.relative_to(folder).as_posix() != name:
            continue
        text = text_of(file, "replace")
        if digest(text) != shown:
            raise RequestError(
                f"{name}: the file has changed since it was shown. Read it again.",
                HTTPStatus.CONFLICT,
            )
        remember(file, text)
        return
    raise RequestError(f"{name}: the study has no such file.", HTTPStatus.NOT_FOUND)


# The files of a study that are handed on: what the commands wrote, and the data.

SAFE = {
    ".csv": "text/csv", ".json": "application/json", ".png": "image/png",
    ".toml": "text/plain", ".md": "text/plain", ".py": "text/plain", ".txt": "text/plain",
}  # fmt: skip
"""Types that a browser may be told; all else is bytes."""
OWN = ("study.toml", "model.toml", "verdict.json", "README.md")
FOLDERS = ("reports", "export", "design", "comparisons", "data", "effects", "laws")


def _given(folder: Path) -> Iterator[Path]:
    """Yield the files that may be downloaded: no links, nothing hidden, no sealed answer."""
    yield from (folder / name for name in OWN)
    plans = sorted(one.name for one in folder.glob("plan*") if one.is_dir())
    for name in (*FOLDERS, *plans):
        yield from sorted((folder / name).rglob("*"))


def is_given(folder: Path, name: str) -> bool:
    """Return whether a study has a file of this name, relative to it, that may be downloaded."""
    return any(one["name"] == name for one in files_of(folder))


def files_of(folder: Path) -> list[dict[str, Any]]:
    """Return the files that may be downloaded: name relative to the study, bytes, when written."""
    found = []
    whole = folder.resolve()
    for path in _given(folder):
        parts = path.relative_to(folder).parts
        if any(part.startswith(".") or part == "__pycache__" for part in parts):
            continue
        if not path.is_file() or not path.resolve().is_relative_to(whole):
            continue
        about = path.stat()
        name = path.relative_to(folder).as_posix()
        found.append({"name": name, "bytes": about.st_size, "written": about.st_mtime})
    return found


def kind_of(path: Path) -> str:
    """Return the type of a file as HTTP calls it; a page of HTML is bytes: it is never shown."""
    if path.suffix.lower() in SAFE:
        return SAFE[path.suffix.lower()]
    guessed = mimetypes.guess_type(path.name)[0] or ""
    return guessed if guessed.startswith("image/") and "svg" not in guessed else (
        "application/octet-stream"
    )  # fmt: skip


# Names that a page sends: of studies and files. None can be an option or lead out of a folder.

UPLOADS = "uploads"
"""The folder beside the studies where files go that were dropped on the page."""

_NAME = re.compile(r"\w[\w .+-]{0,79}")
_BATCH = re.compile(r"[0-9a-z][0-9a-z-]{0,39}")


def file_name(text: object, what: str = "a name") -> str:
    """Return a text that is the name of a file or folder and no path.

    Raises
    ------
    RequestError
        If it is not.
    """
    if not isinstance(text, str) or not _NAME.fullmatch(text) or text.endswith((".", " ")):
        raise RequestError(
            f"{what}: {written(text)}; letters, digits, spaces, dots and dashes are right, "
            "beginning with a letter or digit."
        )
    return text


def batch_name(text: object) -> str:
    """Return a text that names files that were dropped together; RequestError if it does not."""
    if not isinstance(text, str) or not _BATCH.fullmatch(text):
        raise RequestError(f"a batch of files: {written(text)} is no name of one.")
    return text
