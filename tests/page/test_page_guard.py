"""Who is let in: the page itself, with its token, at its own address; nobody else."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from page.served import Client, page_on

from bristle.page.app import static_parts
from bristle.page.requests import Guard

FOREIGN = "https://foreign.example"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with page_on(tmp_path_factory.mktemp("home"), start=False) as found:
        yield found


def test_the_page_itself_is_let_in(client: Client) -> None:
    assert client.get("/api/home").status == 200
    assert client.get("/api/home", Sec_Fetch_Site="same-origin").status == 200


def test_it_listens_on_this_machine_alone(client: Client) -> None:
    assert client.server.server_address[0] == "127.0.0.1"


@pytest.mark.parametrize("given", [None, "", "Bearer", "Bearer wrong", "Basic {token}", "{token}"])
def test_without_its_token_nothing_is_told(client: Client, given: str | None) -> None:
    said = given.format(token=client.server.guard.token) if given else given
    found = client.get("/api/home", Authorization=said)
    assert found.status == 401
    assert "bristle page" in found.error


def test_the_token_of_another_server_is_no_token(client: Client, tmp_path: Path) -> None:
    """What another user's server at another port would get from a browser does not open this."""
    with page_on(tmp_path, start=False) as other:
        own = other.server.guard.token
        assert own != client.server.guard.token
        assert client.get("/api/home", Authorization=f"Bearer {own}").status == 401


def test_no_cookie_is_set_that_other_ports_would_get(client: Client) -> None:
    for path in ("/", "/main.mjs", "/api/home"):
        assert "Set-Cookie" not in client.get(path).headers


@pytest.mark.parametrize(
    "host", ["foreign.example", "foreign.example:{port}", "127.0.0.1", "127.0.0.1:1", "", None,
             "127.0.0.1:{port}.foreign.example", "[::1]:{port}"],
)  # fmt: skip
@pytest.mark.parametrize("path", ["/", "/api/home"])
def test_a_name_that_a_name_server_leads_here_is_refused(
    client: Client, host: str | None, path: str
) -> None:
    said = host.format(port=client.server.guard.port) if host else host
    found = client.get(path, Host=said, Origin=None)
    assert found.status in (400, 421)
    assert client.server.guard.token.encode() not in found.body


@pytest.mark.parametrize(
    "origin",
    [FOREIGN, "null", "http://127.0.0.1", "http://127.0.0.1:1", "https://127.0.0.1:{port}"],
)
@pytest.mark.parametrize("path", ["/", "/api/home"])
def test_the_request_of_a_foreign_page_is_refused(client: Client, origin: str, path: str) -> None:
    said = origin.format(port=client.server.guard.port)
    assert client.get(path, Origin=said).status == 403


@pytest.mark.parametrize("site", ["cross-site", "same-site", "none"])
def test_what_the_browser_says_comes_from_elsewhere_is_refused(client: Client, site: str) -> None:
    assert client.get("/api/home", Origin=None, Sec_Fetch_Site=site).status == 403


def test_a_foreign_page_starts_no_command(client: Client) -> None:
    order = {"what": "example", "study": "planted", "options": {"rig": "bench"}}
    for headers in ({"Origin": FOREIGN}, {"Authorization": None}, {"Host": "foreign.example"}):
        assert client.post("/api/jobs", order, **headers).status in (401, 403, 421)
    assert client.get("/api/state").json["jobs"] == []


def test_no_answer_allows_another_origin(client: Client) -> None:
    found = client.ask("OPTIONS", "/api/home", Origin=FOREIGN)
    assert found.status >= 400
    for one in (found, client.get("/"), client.get("/api/home")):
        assert not [name for name in one.headers if name.lower().startswith("access-control")]


def test_nothing_is_fetched_from_elsewhere_nor_shown_in_a_frame(client: Client) -> None:
    policy = client.get("/").headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe-inline" not in policy
    assert "'unsafe-eval'" not in policy
    texts = [path.read_text(encoding="utf-8") for path in static_parts().values()]
    for text in texts:
        assert "https://" not in text
        assert "http://" not in text.replace("http://www.w3.org/2000/svg", "")


def test_the_address_holds_the_token_where_no_browser_sends_it(client: Client) -> None:
    guard = client.server.guard
    before, _, after = client.server.address.partition("#")
    assert before == f"http://127.0.0.1:{guard.port}/"
    assert after == f"token={guard.token}"
    assert len(guard.token) >= 40


@pytest.mark.parametrize(
    "path", ["/../server.py", "/..%2fserver.py", "/%2e%2e/server.py", "/views/../../server.py",
             "/page.html/", "//etc/passwd", "/server.py"],
)  # fmt: skip
def test_only_the_files_of_the_page_are_read(client: Client, path: str) -> None:
    found = client.get(path)
    assert found.status == 404
    assert b"def " not in found.body


def test_the_guard_compares_names_of_headers_as_http_does() -> None:
    from email.message import Message

    headers = Message()
    headers["host"] = "127.0.0.1:9"
    headers["AUTHORIZATION"] = "Bearer secret"
    assert Guard(9, "secret").refusal(headers, needs_token=True) is None  # type: ignore[arg-type]
