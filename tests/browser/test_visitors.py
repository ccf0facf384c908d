"""Who may use the page: other sites, tokens and roles beyond this host."""

from __future__ import annotations

import http.client
import json
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest
from broker_certificates import needs_openssl
from playwright.sync_api import expect

from servo_ctrl.hmi.access.users import Role, add_token, remove_token

if TYPE_CHECKING:
    from collections.abc import Callable

    from page_server import Server, Stub
    from playwright.sync_api import Browser, BrowserContext, Page


def answer(server: Server, method: str, path: str, headers: dict[str, str]) -> int:
    connection = http.client.HTTPConnection(urlsplit(server.url).netloc, timeout=10.0)
    connection.request(method, path, headers=headers)
    status = connection.getresponse().status
    connection.close()
    return status


def test_requests_of_other_sites_are_refused(stub_server: Server, stub: Stub) -> None:
    upgrade = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    socket = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    assert answer(stub_server, "GET", "/", {"Host": "evil.example"}) == 403
    assert answer(stub_server, "POST", "/stop", {}) == 403
    assert answer(stub_server, "POST", "/stop", {"Origin": "http://evil.example"}) == 403
    assert answer(stub_server, "GET", socket, upgrade | {"Origin": "http://evil.example"}) == 403
    assert answer(stub_server, "GET", socket, upgrade | {"Origin": stub_server.url}) == 101
    assert stub.requests() == []


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with cert.pem and key.pem of localhost."""
    directory = tmp_path_factory.mktemp("tls")
    command = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost"
    subprocess.run(
        [*command.split(), "-keyout", directory / "key.pem", "-out", directory / "cert.pem"],
        check=True,
        capture_output=True,
    )
    (directory / "key.pem").chmod(0o600)
    return directory


def log_in(context: BrowserContext, url: str, token: str) -> Page:
    page = context.new_page()
    page.goto(url)
    page.get_by_label("Token").fill(token)
    page.get_by_role("button", name="Log in").click()
    return page


@needs_openssl
def test_beyond_loopback_a_token_is_needed_and_its_role_applies(
    chromium: Browser,
    certificate: Path,
    tmp_path: Path,
    serving: Callable[..., Server],
    visiting: Callable[..., BrowserContext],
    picture: Callable[[Page, str], None],
) -> None:
    access = tmp_path / "access.toml"
    viewer, operator = add_token(access, "vera", Role.VIEW), add_token(access, "otto", Role.OPERATE)
    server = serving(access, certificate / "cert.pem", certificate / "key.pem")

    watching = visiting(server.url, width=360, ignore_https_errors=True)
    refused = watching.request.post(f"{server.url}/stop", headers={"Origin": server.url})
    assert refused.status == 401
    page = log_in(watching, server.url, "not a token")
    expect(page.get_by_role("alert")).to_have_text("This token is not known here.")
    picture(page, "login_360")
    page.get_by_label("Token").fill(viewer)
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Ready")
    expect(page.get_by_test_id("take-control")).to_be_hidden()
    expect(page.get_by_test_id("home")).to_be_disabled()
    needed = "This needs the role operate; yours is view."
    expect(page.get_by_test_id("home")).to_have_accessible_description(needed)
    page.get_by_test_id("stop").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Standby")
    # the end of a login ends the pages that are open, by themselves
    left = watching.request.post(f"{server.url}/logout", headers={"Origin": server.url}, max_redirects=0)
    assert left.status == 303
    expect(page.get_by_label("Token")).to_be_visible()

    working = visiting(server.url, ignore_https_errors=True)
    page = log_in(working, server.url, operator)
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")
    page.get_by_test_id("enable").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Ready")
    requests = json.loads(working.request.get(f"{server.url}/stub/requests").text())
    commands = [one for one in requests if one["do"] == "command"]
    assert [(one["who"]["user"], one["command"]) for one in commands] == [
        ("vera", "quick_stop"),
        ("otto", "enable"),
    ]
    remove_token(access, "otto")
    expect(page.get_by_label("Token")).to_be_visible()

    statuses = [
        working.request.post(
            f"{server.url}/login", form={"token": "guess"}, headers={"Origin": server.url}
        ).status
        for _ in range(6)
    ]
    assert statuses[0] == 401
    assert statuses[-1] == 429
    log = server.log.read_text()
    assert viewer not in log
    assert operator not in log
