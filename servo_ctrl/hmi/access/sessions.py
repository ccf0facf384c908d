"""Log-in sessions, and the delay after failed attempts. Pure: the caller gives the time."""

import secrets
from collections import OrderedDict

from servo_ctrl.hmi.access.users import Access, TokenOwner

SESSION_LIFETIME_S = 12 * 3600.0
"""Bounds a session, seconds; chosen: a shift, after which the token is asked for again."""
MAX_SESSIONS = 256
"""Bounds the memory: the oldest session ends when one more begins; chosen."""
FREE_FAILURES = 5
"""Bounds the failed attempts of an address before it has to wait; chosen."""
MAX_DELAY_S = 300.0
"""Bounds the delay before the next attempt, seconds; chosen. The delay doubles with each failure, from 2
s."""
FAILURE_MEMORY_S = 900.0
"""Time after the last failure of an address at which its count restarts at zero, seconds; chosen."""
MAX_ADDRESSES = 1024
"""Bounds the memory: the address whose last failure is oldest is dropped when one more fails; chosen."""


class Sessions:
    """The sessions by the secret in the browser's cookie."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._by_secret: OrderedDict[str, tuple[TokenOwner, float]] = OrderedDict()
        """The owner of the token that was shown, and when the session ends."""

    def begin(self, owner: TokenOwner, now_s: float) -> str:
        """Begin a session and return its secret."""
        secret = secrets.token_urlsafe(32)
        self._by_secret[secret] = owner, now_s + SESSION_LIFETIME_S
        while len(self._by_secret) > MAX_SESSIONS:
            self._by_secret.popitem(last=False)
        return secret

    def owner_of(self, secret: str | None, now_s: float) -> TokenOwner | None:
        """Return the owner of the session with their present role; None when it never began or has ended."""
        session = self._by_secret.get(secret or "")
        if session is None:
            return None
        owner, expires_s = self._access.owner_now(session[0]), session[1]
        if owner is None or now_s >= expires_s:
            self.end(secret)
            return None
        return owner

    def end(self, secret: str | None) -> None:
        """End a session; an unknown secret is ignored."""
        self._by_secret.pop(secret or "", None)


class LoginFailures:
    """Failed attempts by address, and how long each address has to wait."""

    def __init__(self) -> None:
        self._by_address: OrderedDict[str, tuple[int, float]] = OrderedDict()
        """Number of failures, and the time of the last."""

    def delay_s(self, address: str, now_s: float) -> float:
        """Return the time until this address may try again, seconds; 0 when it may now."""
        count, last_s = self._by_address.get(address, (0, 0.0))
        if count < FREE_FAILURES or now_s - last_s > FAILURE_MEMORY_S:
            return 0.0
        delay_s: float = min(MAX_DELAY_S, 2.0 ** (count - FREE_FAILURES + 1))
        return max(0.0, last_s + delay_s - now_s)

    def record(self, address: str, now_s: float) -> None:
        """Count one more failure; 64 are as good as any more, and keep the power of two finite."""
        count, last_s = self._by_address.pop(address, (0, now_s))
        if now_s - last_s > FAILURE_MEMORY_S:
            count = 0
        self._by_address[address] = (min(count + 1, 64), now_s)
        while len(self._by_address) > MAX_ADDRESSES:
            self._by_address.popitem(last=False)

    def clear(self, address: str) -> None:
        """Forget the failures of an address that has logged in."""
        self._by_address.pop(address, None)
