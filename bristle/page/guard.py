"""Which requests the page answers: those of its own page, which has its token.

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
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; "
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
