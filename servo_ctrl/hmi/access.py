"""Who may see the page and do what: everybody on loopback; elsewhere, whoever has a token of the access file.

The access file is TOML, for its owner only. No token is in it, only SHA-256 of each: a token is 256 random
bits, so that a slow hash would gain nothing.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
import threading
from datetime import UTC, datetime
from enum import IntEnum
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import tomli_w
from pydantic import Field, StringConstraints, ValidationError

from servo_ctrl.config.errors import ConfigError
from servo_ctrl.config.load import as_config_error, read_toml
from servo_ctrl.config.private_file import refuse_readable_for_others
from servo_ctrl.config.section import Section
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from pathlib import Path

NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.@ -]{0,39}$"
TOKEN_LIMIT = 200
"""Characters; a longer one is no token of ours, and is not even hashed."""
LARGEST_FILE = 1 << 20


class Role(IntEnum):
    """What a visitor may do; each may what those below it may."""

    VIEW = 0
    """See everything, and stop."""
    OPERATE = 1
    """Move the machine, learn, run programs."""
    CONFIGURE = 2
    """Change settings, objects and learned results."""

    @property
    def word(self) -> str:
        """As it is written."""
        return self.name.lower()


ROLES = {role.word: role for role in Role}


class _Token(Section):
    """One entry of the access file."""

    name: Annotated[str, StringConstraints(pattern=NAME_PATTERN)]
    role: Literal["view", "operate", "configure"]
    sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
    made: str = ""


class _File(Section):
    """A whole access file."""

    format: Literal[1]
    tokens: Annotated[tuple[_Token, ...], Field(alias="token")] = ()


class Entry(NamedTuple):
    """Who a token belongs to."""

    name: str
    role: Role
    sha256: str


LOCAL = Entry("local", Role.CONFIGURE, "")
"""Whoever sits at the controller itself."""


class AccessFile:
    """The tokens of an access file, read again when it changes: what is taken out is no longer valid."""

    def __init__(self, path: Path) -> None:
        """Raises ConfigError."""
        self.path = path
        self._stamp: tuple[int, int, int] | None = None
        self._entries: tuple[Entry, ...] = ()
        self.entries()

    def entries(self) -> tuple[Entry, ...]:
        """Everybody in it now. Raises ConfigError."""
        try:
            found = self.path.stat()
        except OSError as error:
            raise ConfigError(self.path, "", f"cannot be read: {error.strerror}") from None
        stamp = (found.st_mtime_ns, found.st_size, found.st_ino)
        if stamp != self._stamp:
            self._entries = _read(self.path)
            self._stamp = stamp
        return self._entries

    def entry_of(self, token: str) -> Entry | None:
        """Whose token this is. Raises ConfigError."""
        if not 0 < len(token) <= TOKEN_LIMIT:
            return None
        digest = digest_of(token)
        found = None
        for entry in self.entries():  # all of them, each in the same time
            if hmac.compare_digest(entry.sha256, digest):
                found = entry
        return found


class Access:
    """Who a visitor is. Without a file, everybody is the local user."""

    def __init__(self, file: AccessFile | None = None) -> None:
        self._file = file

    @property
    def login_needed(self) -> bool:
        """Visitors have to show a token."""
        return self._file is not None

    def entry_of(self, token: str) -> Entry | None:
        """Who comes with this token; None: nobody that is known, or the file cannot be read."""
        if self._file is None:
            return LOCAL
        try:
            return self._file.entry_of(token)
        except ConfigError:
            return None

    def role_now(self, name: str, sha256: str) -> Role | None:
        """What somebody who has come in with this token may do now; None when it was taken out."""
        if self._file is None:
            return LOCAL.role
        try:
            entries = self._file.entries()
        except ConfigError:
            return None
        return next((entry.role for entry in entries if (entry.name, entry.sha256) == (name, sha256)), None)


def digest_of(token: str) -> str:
    """What the access file has of a token."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()


_WRITING = threading.Lock()


def add_token(path: Path, name: str, role: Role) -> str:
    """Make a token and note it in the access file, which is made where there is none. Raises ConfigError.

    The token is returned and kept nowhere. A name that is in the file already gets a new token; the
    old one is no longer valid.
    """
    if not re.fullmatch(NAME_PATTERN, name):
        raise ConfigError(path, "name", f"{name!r} is not 1 to 40 letters, digits, spaces, or _ . @ -")
    with _WRITING:
        entries = [entry.model_dump() for entry in _document(path).tokens] if path.exists() else []
        token = secrets.token_urlsafe(32)
        made = datetime.now(UTC).isoformat(timespec="seconds")
        kept = [entry for entry in entries if entry["name"] != name]
        kept.append({"name": name, "role": role.word, "sha256": digest_of(token), "made": made})
        _write(path, kept)
    return token


def remove_token(path: Path, name: str) -> None:
    """Take a name out of the access file; it is locked out within a second. Raises ConfigError."""
    with _WRITING:
        entries = [entry.model_dump() for entry in _document(path).tokens]
        kept = [entry for entry in entries if entry["name"] != name]
        if len(kept) == len(entries):
            raise ConfigError(path, "token", f'there is none for "{name}"')
        _write(path, kept)


def _write(path: Path, entries: list[dict[str, str]]) -> None:
    def fill(temporary: Path) -> None:
        temporary.touch(mode=0o600)
        temporary.chmod(0o600)
        temporary.write_text(tomli_w.dumps({"format": 1, "token": entries}), encoding="utf-8")

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, fill)
    except OSError as error:
        raise ConfigError(path, "", f"cannot be written: {error.strerror}") from None


def _document(path: Path) -> _File:
    refuse_readable_for_others(path)
    if path.stat().st_size > LARGEST_FILE:
        raise ConfigError(path, "", f"is larger than {LARGEST_FILE} bytes")
    document = read_toml(path)
    try:
        return _File.model_validate(document)
    except ValidationError as error:
        raise as_config_error(path, error) from None


def _read(path: Path) -> tuple[Entry, ...]:
    return tuple(Entry(entry.name, ROLES[entry.role], entry.sha256) for entry in _document(path).tokens)
