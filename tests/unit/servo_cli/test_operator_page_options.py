"""Addresses of the operator's page: checked before anything is started."""

import socket
from pathlib import Path

import pytest

from servo_ctrl.cli import operator_page
from servo_ctrl.cli.operator_page import PageError, free_address, occupied, page_at, url_of
from servo_ctrl.errors import ConfigError


def test_a_taken_port_is_refused_by_a_run_and_avoided_by_the_demo() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        listen = f"127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(PageError, match="another program listens there"):
            page_at(listen)
        other = free_address(listen)
    assert other != listen
    assert not occupied("127.0.0.1", int(other.rpartition(":")[2]))
    assert free_address(listen) == listen, "it is free again"


def test_an_address_that_others_reach_needs_tokens_and_tls() -> None:
    with pytest.raises(ConfigError, match="--hmi-access"):
        page_at("0.0.0.0:8080")
    with pytest.raises(ConfigError, match="HOST:PORT"):
        page_at("8080")


def test_without_its_library_there_is_no_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(operator_page.importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(PageError, match=r"servo-ctrl\[hmi\]"):
        page_at(free_address("127.0.0.1:8080"))


def test_the_page_gets_its_address() -> None:
    listen = free_address("127.0.0.1:8080")
    page = page_at(listen, recordings=Path("out"))
    assert page.arguments == ("--listen", listen, "--recordings", str(Path("out").resolve()))
    assert url_of(listen, tls=True) == f"https://{listen}"
