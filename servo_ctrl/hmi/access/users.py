"""Users and roles: everybody on loopback; elsewhere, the owners of the tokens in the access file.

The access file is TOML, readable for its owner only. It holds the SHA-256 of each token, never the token:
a token is 256 random bits, so a slow hash would gain nothing.
"""

import hashlib
import hmac
import re
import secrets
import threading
from datetime import UTC, datetime
from enum import IntEnum
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, StringConstraints, ValidationError

from servo_ctrl.config.load import as_config_error, read_toml
from servo_ctrl.config.section import FileSection
from servo_ctrl.errors import ConfigError
from servo_ctrl.files.private_file import refuse_readable_for_others
from servo_ctrl.files.toml_text import toml_text
from servo_ctrl.files.whole_file import write_whole

NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.@ -]{0,39}$"
MAX_TOKEN_LENGTH = 200
"""Bounds the characters of a token that is hashed; chosen: tokens of `add_token` have 43."""
MAX_FILE_BYTES = 1 << 20
"""Bounds the access file; chosen: room for about 5000 tokens."""


class Role(IntEnum):
    """What a visitor may do; a higher role includes the lower ones."""

    VIEW = 0
    """See everything, and stop."""
    OPERATE = 1
    """Move the machine, learn, run programs."""
    CONFIGURE = 2
    """Change settings, objects and learned results."""

    @property
    def label(self) -> str:
        """The name in lower case, as in the access file and in messages."""
        return self.name.lower()


ROLES = {role.label: role for role in Role}


class _TokenEntry(FileSection):
    name: Annotated[str, StringConstraints(pattern=NAME_PATTERN)]
    role: Literal["view", "operate", "configure"]
    sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
    made: str = ""


class _AccessDocument(FileSection):
    format: Literal[1]
    tokens: Annotated[tuple[_TokenEntry, ...], Field(alias="token")] = ()


class TokenOwner(NamedTuple):
    """Somebody who has a token."""

    name: str
    role: Role
    sha256: str


LOCAL_USER = TokenOwner("local", Role.CONFIGURE, "")
"""Everybody on the controller's own computer."""


class Access:
    """Who may log in: the owners of the tokens in an access file; without a file, everybody as LOCAL_USER.

    The file is read again when it has changed.
    """

    def __init__(self, path: Path | None = None) -> None:
        """Read the file. Raises ConfigError."""
        self._path = path
        self._stamp: tuple[int, int, int] | None = None
        self._owners: tuple[TokenOwner, ...] = ()
        self.owners()

    @property
    def login_needed(self) -> bool:
        """Whether visitors have to show a token."""
        return self._path is not None

    def owners(self) -> tuple[TokenOwner, ...]:
        """Return everybody who has a token now. Raises ConfigError."""
        if self._path is None:
            return (LOCAL_USER,)
        try:
            found = self._path.stat()
        except OSError as error:
            raise ConfigError(self._path, "", f"cannot be read: {error.strerror}") from None
        stamp = (found.st_mtime_ns, found.st_size, found.st_ino)
        if stamp != self._stamp:
            self._owners = tuple(
                TokenOwner(entry.name, ROLES[entry.role], entry.sha256) for entry in _read(self._path).tokens
            )
            self._stamp = stamp
        return self._owners

    def owner_of(self, token: str) -> TokenOwner | None:
        """Return the owner of a token; None: nobody has it, or the file cannot be read."""
        if not self.login_needed:
            return LOCAL_USER
        if not 0 < len(token) <= MAX_TOKEN_LENGTH:
            return None
        digest, owners = digest_of(token), self._readable_owners()
        # all are compared: the time that it takes must not show which is nearly right
        found = [owner for owner in owners if hmac.compare_digest(owner.sha256, digest)]
        return found[0] if found else None

    def owner_now(self, before: TokenOwner) -> TokenOwner | None:
        """Return the owner of a token with their present role; None when the token was revoked."""
        key = (before.name, before.sha256)
        return next((owner for owner in self._readable_owners() if (owner.name, owner.sha256) == key), None)

    def _readable_owners(self) -> tuple[TokenOwner, ...]:
        """Return the owners; nobody while the file cannot be read."""
        try:
            return self.owners()
        except ConfigError:
            return ()


def digest_of(token: str) -> str:
    """Return the SHA-256 of a token in hexadecimal, as the access file holds it."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()


_WRITING = threading.Lock()
"""Two changes of the file at the same time would lose one of them."""


def add_token(path: Path, name: str, role: Role) -> str:
    """Make a token, write its hash to the access file, and return the token. Raises ConfigError.

    The file is made where there is none. The old token of a name is no longer valid.
    """
    if not re.fullmatch(NAME_PATTERN, name):
        raise ConfigError(path, "name", f"{name!r} is not 1 to 40 letters, digits, spaces, or _ . @ -")
    with _WRITING:
        entries = [entry.model_dump() for entry in _read(path).tokens] if path.exists() else []
        token = secrets.token_urlsafe(32)
        made = datetime.now(UTC).isoformat(timespec="seconds")
        kept = [entry for entry in entries if entry["name"] != name]
        kept.append({"name": name, "role": role.label, "sha256": digest_of(token), "made": made})
        _write(path, kept)
    return token


def remove_token(path: Path, name: str) -> None:
    """Remove a name from the access file; its pages close within a second. Raises ConfigError."""
    with _WRITING:
        entries = [entry.model_dump() for entry in _read(path).tokens]
        kept = [entry for entry in entries if entry["name"] != name]
        if len(kept) == len(entries):
            raise ConfigError(path, "token", f'there is none for "{name}"')
        _write(path, kept)


def _write(path: Path, entries: list[dict[str, str]]) -> None:
    def fill(temporary: Path) -> None:
        temporary.touch(mode=0o600)
        temporary.chmod(0o600)
        temporary.write_text(toml_text({"format": 1, "token": entries}), encoding="utf-8")

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, fill)
    except OSError as error:
        raise ConfigError(path, "", f"cannot be written: {error.strerror}") from None


def _read(path: Path) -> _AccessDocument:
    refuse_readable_for_others(path)
    if path.stat().st_size > MAX_FILE_BYTES:
        raise ConfigError(path, "", f"is larger than {MAX_FILE_BYTES} bytes")
    document = read_toml(path)
    try:
        return _AccessDocument.model_validate(document)
    except ValidationError as error:
        raise as_config_error(path, error) from None
