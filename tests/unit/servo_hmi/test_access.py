from __future__ import annotations

import hashlib
import time
from typing import TYPE_CHECKING

import pytest

from servo_ctrl.config.errors import ConfigError
from servo_ctrl.hmi.access import LOCAL, Access, AccessFile, Role, add_token, remove_token
from servo_ctrl.hmi.admission import address_of, admission, is_loopback
from servo_ctrl.hmi.bench import LOGIN_ENDED, Bench, Directories, Visitor, refusal, role_of
from servo_ctrl.hmi.control_right import ControlRight
from servo_ctrl.hmi.machine_link import MachineLink
from servo_ctrl.hmi.sessions import FREE_FAILURES, LASTS_S, LONGEST_WAIT_S, SESSIONS, Failures, Sessions

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "access.toml"


def test_the_file_has_the_hash_of_a_token_and_is_for_its_owner_only(file: Path) -> None:
    token = add_token(file, "anna", Role.OPERATE)
    text = file.read_text()
    assert token not in text
    assert hashlib.sha256(token.encode()).hexdigest() in text
    assert file.stat().st_mode & 0o777 == 0o600
    assert len(token) >= 43


def test_a_token_is_known_with_its_name_and_role_and_nothing_else_is(file: Path) -> None:
    token = add_token(file, "anna", Role.OPERATE)
    access = Access(AccessFile(file))
    entry = access.entry_of(token)
    assert entry is not None
    assert (entry.name, entry.role) == ("anna", Role.OPERATE)
    for wrong in ("", token[:-1], token + "x", "x" * 10_000, "\ud800", entry.sha256):
        assert access.entry_of(wrong) is None


def test_a_new_token_and_a_revocation_act_on_who_is_in_already(file: Path) -> None:
    first = add_token(file, "anna", Role.CONFIGURE)
    access = Access(AccessFile(file))
    sessions = Sessions(access)
    entry = access.entry_of(first)
    assert entry is not None
    secret = sessions.begin(entry, 0.0)
    assert sessions.entry_of(secret, 1.0) == entry
    second = add_token(file, "anna", Role.VIEW)
    assert access.entry_of(first) is None
    assert sessions.entry_of(secret, 2.0) is None
    assert access.role_now("anna", hashlib.sha256(second.encode()).hexdigest()) is Role.VIEW
    remove_token(file, "anna")
    assert access.entry_of(second) is None


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("format = 2\n", "format"),
        ("format = 1\n[[token]]\nname = 'a'\nrole = 'god'\nsha256 = '" + "0" * 64 + "'\n", "role"),
        ("format = 1\n[[token]]\nname = 'a'\nrole = 'view'\nsha256 = 'secret'\n", "sha256"),
        ("format = 1\ntokens = 3\n", "tokens"),
        ("format = ", "not valid TOML"),
    ],
)
def test_a_file_that_is_none_is_refused_with_its_key(file: Path, text: str, complaint: str) -> None:
    file.write_text(text)
    file.chmod(0o600)
    with pytest.raises(ConfigError, match=complaint):
        AccessFile(file)


def test_a_file_that_others_may_read_is_refused(file: Path) -> None:
    add_token(file, "anna", Role.VIEW)
    file.chmod(0o640)
    with pytest.raises(ConfigError, match="chmod 600"):
        AccessFile(file)


def test_a_file_that_breaks_while_it_is_in_use_lets_nobody_in(file: Path) -> None:
    token = add_token(file, "anna", Role.VIEW)
    access = Access(AccessFile(file))
    file.write_text("format = ")
    assert access.entry_of(token) is None


@pytest.mark.parametrize("name", ["", "a\nb", "../x", "a" * 41, " anna"])
def test_a_name_that_could_be_misread_is_refused(file: Path, name: str) -> None:
    with pytest.raises(ConfigError):
        add_token(file, name, Role.VIEW)
    assert not file.exists()


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.0.7", "::", "bench.example"])  # noqa: S104  # refused
def test_another_address_than_loopback_needs_tokens_and_tls(host: str) -> None:
    with pytest.raises(ConfigError, match="--access, --certificate"):
        admission(host, None, None, None)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.9", "::1", "localhost"])
def test_loopback_needs_nothing_and_may_all(host: str) -> None:
    access = admission(host, None, None, None)
    assert is_loopback(host)
    assert not access.login_needed
    assert access.role_now("local", "") is LOCAL.role is Role.CONFIGURE


def test_one_of_the_three_files_is_not_enough(file: Path) -> None:
    add_token(file, "anna", Role.VIEW)
    with pytest.raises(ConfigError, match="--certificate, --key missing"):
        admission("127.0.0.1", file, None, None)


@pytest.mark.parametrize("listen", ["8080", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:66000", ":80", "a:b"])
def test_an_address_that_is_none_is_refused(listen: str) -> None:
    with pytest.raises(ConfigError, match="HOST:PORT"):
        address_of(listen)
    assert address_of("[::1]:8080") == ("::1", 8080)


def test_a_session_ends_after_a_shift_and_with_log_out(file: Path) -> None:
    access = Access(AccessFile(file)) if file.exists() else Access()
    sessions = Sessions(access)
    first, second = sessions.begin(LOCAL, 0.0), sessions.begin(LOCAL, 0.0)
    assert sessions.entry_of(first, LASTS_S - 1.0) is not None
    sessions.end(first)
    assert sessions.entry_of(first, 1.0) is None
    assert sessions.entry_of(second, LASTS_S) is None
    assert sessions.entry_of(None, 0.0) is None


def test_a_page_that_stays_open_loses_its_role_with_the_login(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    token = add_token(file, "anna", Role.OPERATE)
    bench = Bench(MachineLink(tmp_path), Access(AccessFile(file)), ControlRight(), Directories(tmp_path))
    entry = bench.access.entry_of(token)
    assert entry is not None
    now_s = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now_s)
    anna, other = (
        Visitor("anna", Role.OPERATE, "192.0.2.7", "browser", bench.sessions.begin(entry, now_s))
        for _ in range(2)
    )
    stranger = Visitor("anna", Role.CONFIGURE, "192.0.2.7", "browser", "made up")
    assert (role_of(bench, anna), role_of(bench, stranger)) == (Role.OPERATE, None)
    bench.sessions.end(other.session)
    assert role_of(bench, other) is None
    now_s = LASTS_S
    assert role_of(bench, anna) is None
    assert refusal(bench, anna, "read_object", {}) == LOGIN_ENDED


def test_sessions_are_bounded() -> None:
    sessions = Sessions(Access())
    secrets = [sessions.begin(LOCAL, 0.0) for _ in range(SESSIONS + 1)]
    assert sessions.entry_of(secrets[0], 0.0) is None
    assert sessions.entry_of(secrets[-1], 0.0) is not None


def test_whoever_guesses_waits_longer_and_longer_and_nobody_else_does() -> None:
    failures, now_s, waits = Failures(), 0.0, []
    for _ in range(20):
        wait_s = failures.wait_s("10.0.0.1", now_s)
        waits.append(wait_s)
        now_s += wait_s
        failures.note("10.0.0.1", now_s)
    assert waits[:FREE_FAILURES] == [0.0] * FREE_FAILURES
    assert waits[FREE_FAILURES : FREE_FAILURES + 3] == [2.0, 4.0, 8.0]
    assert waits[-1] == LONGEST_WAIT_S
    assert failures.wait_s("10.0.0.2", now_s) == 0.0
    failures.forgive("10.0.0.1")
    assert failures.wait_s("10.0.0.1", now_s) == 0.0
