"""Who has logged in, and who has tried too often. Pure: whoever asks brings the time."""

from __future__ import annotations

import secrets
from collections import OrderedDict
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from servo_ctrl.hmi.access import Access, Entry

LASTS_S = 12 * 3600.0
"""A shift; then the token is asked for again."""
SESSIONS = 256
"""More are not kept: the oldest goes."""
FREE_FAILURES = 5
"""So often one may mistype before waiting."""
LONGEST_WAIT_S = 300.0
FORGOTTEN_S = 900.0
"""So long after the last failure it counts no more."""
ADDRESSES = 1024
"""More are not kept apart."""


class Session(NamedTuple):
    """Somebody who has shown a token."""

    entry: Entry
    until_s: float


class Sessions:
    """Those who are logged in, by the secret in their browser's cookie."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._by_secret: OrderedDict[str, Session] = OrderedDict()

    def begin(self, entry: Entry, now_s: float) -> str:
        """Let somebody in; returns the secret."""
        secret = secrets.token_urlsafe(32)
        self._by_secret[secret] = Session(entry, now_s + LASTS_S)
        while len(self._by_secret) > SESSIONS:
            self._by_secret.popitem(last=False)
        return secret

    def entry_of(self, secret: str | None, now_s: float) -> Entry | None:
        """Who has this secret, with the role that they have now; None when not, or no longer."""
        session = self._by_secret.get(secret or "")
        if session is None:
            return None
        role = self._access.role_now(session.entry.name, session.entry.sha256)
        if role is None or now_s >= session.until_s:
            self.end(secret)
            return None
        return session.entry._replace(role=role)

    def end(self, secret: str | None) -> None:
        """Log out."""
        self._by_secret.pop(secret or "", None)


class Failures:
    """How long an address has to wait before its next attempt to log in."""

    def __init__(self) -> None:
        self._by_address: OrderedDict[str, tuple[int, float]] = OrderedDict()
        """Failures, and when the last one was."""

    def wait_s(self, address: str, now_s: float) -> float:
        """0 when it may try now."""
        count, last_s = self._by_address.get(address, (0, 0.0))
        if count < FREE_FAILURES or now_s - last_s > FORGOTTEN_S:
            return 0.0
        wait_s: float = min(LONGEST_WAIT_S, 2.0 ** (count - FREE_FAILURES + 1))
        return max(0.0, last_s + wait_s - now_s)

    def note(self, address: str, now_s: float) -> None:
        """One more."""
        count, last_s = self._by_address.pop(address, (0, now_s))
        if now_s - last_s > FORGOTTEN_S:
            count = 0
        self._by_address[address] = (min(count + 1, 64), now_s)
        while len(self._by_address) > ADDRESSES:
            self._by_address.popitem(last=False)

    def forgive(self, address: str) -> None:
        """It has come in."""
        self._by_address.pop(address, None)
