"""Requests and answers of the page's server, as plain data."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any, BinaryIO

from ..errors import BristleError

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


def as_error(text: str, status: HTTPStatus, **more: Any) -> Answer:
    """Return a sentence about what is wrong as an answer."""
    return as_json({"error": text, **more}, status)
