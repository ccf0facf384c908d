"""Who may move the machine from the page: one browser at a time, and everybody sees which.

Pure: whoever asks brings the time. The right ends with the browser that has it: a minute after its last
page has gone. A reload and a network that stumbles keep it; anybody who may can take it over meanwhile.
"""

from __future__ import annotations

from typing import NamedTuple

GRACE_S = 60.0
"""So long the right outlives the last page of its browser."""


class Holder(NamedTuple):
    """Who has the control right, and since when."""

    browser: str
    user: str
    address: str
    since_s: float
    """In the time of whoever asks, as all of them."""


class Change(NamedTuple):
    """The right went from one to another; None stands for nobody."""

    number: int
    """Counted from 1, so that a page knows which ones it has shown."""
    before: Holder | None
    after: Holder | None


class ControlRight:
    """The one control right of a machine."""

    def __init__(self) -> None:
        self._holder: Holder | None = None
        self._pages: dict[str, set[str]] = {}
        """By browser, the pages that it has open."""
        self._last_gone_s: dict[str, float] = {}
        """By browser without a page, when the last one went."""
        self.last: Change = Change(0, None, None)

    def holder(self, now_s: float) -> Holder | None:
        """Who has it."""
        self._expire(now_s)
        return self._holder

    def held_by(self, browser: str, now_s: float) -> bool:
        """This browser has it."""
        holder = self.holder(now_s)
        return holder is not None and holder.browser == browser

    def take(self, browser: str, user: str, address: str, now_s: float) -> None:
        """Give it to this browser, whoever had it; it must have a page open."""
        self._expire(now_s)
        if browser in self._pages and not self.held_by(browser, now_s):
            self._give(Holder(browser, user, address, now_s))

    def release(self, browser: str, now_s: float) -> None:
        """Nobody has it any more, if this browser had it."""
        if self.held_by(browser, now_s):
            self._give(None)

    def page_came(self, browser: str, page: str) -> None:
        """A page was opened."""
        self._pages.setdefault(browser, set()).add(page)
        self._last_gone_s.pop(browser, None)

    def page_went(self, browser: str, page: str, now_s: float) -> None:
        """A page was closed, or its connection was lost."""
        pages = self._pages.get(browser, set())
        pages.discard(page)
        if browser in self._pages and not pages:
            del self._pages[browser]
            self._last_gone_s[browser] = now_s
        self._expire(now_s)

    def _expire(self, now_s: float) -> None:
        self._last_gone_s = {
            browser: gone_s for browser, gone_s in self._last_gone_s.items() if now_s - gone_s <= GRACE_S
        }
        holder = self._holder
        if holder and holder.browser not in self._pages and holder.browser not in self._last_gone_s:
            self._give(None)

    def _give(self, after: Holder | None) -> None:
        self.last = Change(self.last.number + 1, self._holder, after)
        self._holder = after
