import hashlib
import time
from pathlib import Path

import pytest

from servo_ctrl.errors import ConfigError
from servo_ctrl.hmi.access.admission import address_of, is_loopback, load_access
from servo_ctrl.hmi.access.control_right import ControlRight
from servo_ctrl.hmi.access.sessions import (
    FREE_FAILURES,
    MAX_DELAY_S,
    MAX_SESSIONS,
    SESSION_LIFETIME_S,
    LoginFailures,
    Sessions,
)
from servo_ctrl.hmi.access.users import LOCAL_USER, Access, Role, add_token, remove_token
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.hmi.shell.open_page import LOGIN_ENDED, OpenPage, PageServices


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


def test_only_the_exact_token_gives_its_name_and_role(file: Path) -> None:
    token = add_token(file, "anna", Role.OPERATE)
    access = Access(file)
    owner = access.owner_of(token)
    assert owner is not None
    assert (owner.name, owner.role) == ("anna", Role.OPERATE)
    for wrong in ("", token[:-1], token + "x", "x" * 10_000, "\ud800", owner.sha256):
        assert access.owner_of(wrong) is None


def test_a_new_token_and_a_revocation_end_running_sessions(file: Path) -> None:
    first = add_token(file, "anna", Role.CONFIGURE)
    access = Access(file)
    sessions = Sessions(access)
    owner = access.owner_of(first)
    assert owner is not None
    secret = sessions.begin(owner, 0.0)
    assert sessions.owner_of(secret, 1.0) == owner
    second = add_token(file, "anna", Role.VIEW)
    assert access.owner_of(first) is None
    assert sessions.owner_of(secret, 2.0) is None
    assert access.owner_now(owner) is None
    new = owner._replace(sha256=hashlib.sha256(second.encode()).hexdigest())
    assert access.owner_now(new) == new._replace(role=Role.VIEW)
    remove_token(file, "anna")
    assert access.owner_of(second) is None


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
def test_an_invalid_access_file_is_refused_naming_the_key(file: Path, text: str, complaint: str) -> None:
    file.write_text(text)
    file.chmod(0o600)
    with pytest.raises(ConfigError, match=complaint):
        Access(file)


def test_a_file_that_others_may_read_is_refused(file: Path) -> None:
    add_token(file, "anna", Role.VIEW)
    file.chmod(0o640)
    with pytest.raises(ConfigError, match="chmod 600"):
        Access(file)


def test_an_access_file_that_becomes_invalid_refuses_everyone(file: Path) -> None:
    token = add_token(file, "anna", Role.VIEW)
    access = Access(file)
    file.write_text("format = ")
    assert access.owner_of(token) is None


@pytest.mark.parametrize("name", ["", "a\nb", "../x", "a" * 41, " anna"])
def test_an_ambiguous_name_is_refused(file: Path, name: str) -> None:
    with pytest.raises(ConfigError):
        add_token(file, name, Role.VIEW)
    assert not file.exists()


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.0.7", "::", "services.example"])  # noqa: S104  # refused
def test_an_address_beyond_loopback_needs_tokens_and_tls(host: str) -> None:
    with pytest.raises(ConfigError, match="--access, --certificate"):
        load_access(host, None, None, None)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.9", "::1", "localhost"])
def test_loopback_needs_no_login_and_has_every_role(host: str) -> None:
    access = load_access(host, None, None, None)
    assert is_loopback(host)
    assert not access.login_needed
    assert access.owner_now(LOCAL_USER) is LOCAL_USER
    assert LOCAL_USER.role is Role.CONFIGURE


def test_one_of_the_three_files_is_not_enough(file: Path) -> None:
    add_token(file, "anna", Role.VIEW)
    with pytest.raises(ConfigError, match="--certificate, --key missing"):
        load_access("127.0.0.1", file, None, None)


@pytest.mark.parametrize("listen", ["8080", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:66000", ":80", "a:b"])
def test_an_invalid_address_is_refused(listen: str) -> None:
    with pytest.raises(ConfigError, match="HOST:PORT"):
        address_of(listen)
    assert address_of("[::1]:8080") == ("::1", 8080)


def test_a_session_ends_after_a_shift_and_with_log_out(file: Path) -> None:
    access = Access(file) if file.exists() else Access()
    sessions = Sessions(access)
    first, second = sessions.begin(LOCAL_USER, 0.0), sessions.begin(LOCAL_USER, 0.0)
    assert sessions.owner_of(first, SESSION_LIFETIME_S - 1.0) is not None
    sessions.end(first)
    assert sessions.owner_of(first, 1.0) is None
    assert sessions.owner_of(second, SESSION_LIFETIME_S) is None
    assert sessions.owner_of(None, 0.0) is None


def test_an_open_page_loses_its_role_when_the_login_ends(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    token = add_token(file, "anna", Role.OPERATE)
    visitors = Access(file)
    services = PageServices(MachineLink(tmp_path), visitors, ControlRight(), tmp_path)
    owner = services.access.owner_of(token)
    assert owner is not None
    now_s = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now_s)
    anna, other = (
        OpenPage(
            services, "anna", Role.OPERATE, "192.0.2.7", "browser", services.sessions.begin(owner, now_s)
        )
        for _ in range(2)
    )
    stranger = OpenPage(services, "anna", Role.CONFIGURE, "192.0.2.7", "browser", "made up")
    assert (anna.current_role(), stranger.current_role()) == (Role.OPERATE, None)
    services.sessions.end(other.session)
    assert other.current_role() is None
    now_s = SESSION_LIFETIME_S
    assert anna.current_role() is None
    assert anna.refusal("read_object") == LOGIN_ENDED


def test_sessions_are_bounded() -> None:
    sessions = Sessions(Access())
    secrets = [sessions.begin(LOCAL_USER, 0.0) for _ in range(MAX_SESSIONS + 1)]
    assert sessions.owner_of(secrets[0], 0.0) is None
    assert sessions.owner_of(secrets[-1], 0.0) is not None


def test_repeated_failures_delay_their_own_address_more_and_more() -> None:
    failures, now_s, waits = LoginFailures(), 0.0, []
    for _ in range(20):
        wait_s = failures.delay_s("10.0.0.1", now_s)
        waits.append(wait_s)
        now_s += wait_s
        failures.record("10.0.0.1", now_s)
    assert waits[:FREE_FAILURES] == [0.0] * FREE_FAILURES
    assert waits[FREE_FAILURES : FREE_FAILURES + 3] == [2.0, 4.0, 8.0]
    assert waits[-1] == MAX_DELAY_S
    assert failures.delay_s("10.0.0.2", now_s) == 0.0
    failures.clear("10.0.0.1")
    assert failures.delay_s("10.0.0.1", now_s) == 0.0
