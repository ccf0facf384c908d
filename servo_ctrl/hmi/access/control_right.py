"""The right to control: one browser at a time may move the machine from the page, and everybody sees which.

Pure: the caller gives the time, from one monotonic clock. The right ends a minute after the last page of its
browser was closed, so that a reload or a lost connection keeps it. Any other browser may take it over.
"""

from typing import NamedTuple

GRACE_S = 60.0
"""Bounds the time without an open page before the right ends, seconds; chosen: longer than a reload on a
slow network."""


class ControlHolder(NamedTuple):
    """The browser that has the right."""

    browser: str
    user: str
    address: str


class ControlHandover(NamedTuple):
    """The right went from one holder to another; None: nobody. Each is an object of its own."""

    before: ControlHolder | None
    after: ControlHolder | None


class ControlRight:
    """The one right to control a machine."""

    def __init__(self) -> None:
        self._holder: ControlHolder | None = None
        self._open_pages: dict[str, set[str]] = {}
        """By browser."""
        self._closed_s: dict[str, float] = {}
        """When the last page was closed, by browser without a page."""
        self.last: ControlHandover = ControlHandover(None, None)

    def holder(self, now_s: float) -> ControlHolder | None:
        """Return who has the right now."""
        self._expire(now_s)
        return self._holder

    def held_by(self, browser: str, now_s: float) -> bool:
        """Whether this browser has the right now."""
        holder = self.holder(now_s)
        return holder is not None and holder.browser == browser

    def take(self, browser: str, user: str, address: str, now_s: float) -> None:
        """Give the right to this browser, also if another one has it; the browser must have a page open."""
        self._expire(now_s)
        if browser in self._open_pages and not self.held_by(browser, now_s):
            self._hand_over(ControlHolder(browser, user, address))

    def release(self, browser: str, now_s: float) -> None:
        """Give the right up, if this browser has it."""
        if self.held_by(browser, now_s):
            self._hand_over(None)

    def page_opened(self, browser: str, page: str) -> None:
        """Note that a page was opened or has connected again."""
        self._open_pages.setdefault(browser, set()).add(page)
        self._closed_s.pop(browser, None)

    def page_closed(self, browser: str, page: str, now_s: float) -> None:
        """Note that a page was closed or has lost its connection."""
        pages = self._open_pages.get(browser, set())
        pages.discard(page)
        if browser in self._open_pages and not pages:
            del self._open_pages[browser]
            self._closed_s[browser] = now_s
        self._expire(now_s)

    def _expire(self, now_s: float) -> None:
        self._closed_s = {
            browser: closed_s for browser, closed_s in self._closed_s.items() if now_s - closed_s <= GRACE_S
        }
        holder = self._holder
        if holder and holder.browser not in self._open_pages and holder.browser not in self._closed_s:
            self._hand_over(None)

    def _hand_over(self, after: ControlHolder | None) -> None:
        self.last = ControlHandover(self._holder, after)
        self._holder = after
