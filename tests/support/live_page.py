"""A page that is connected: what is pressed before that is not carried out, and the page says so."""

from playwright.sync_api import Page

LIMIT_MS = 240_000


def await_connection(page: Page) -> None:
    """Wait until a page that has been opened or loaded again has its connection."""
    page.wait_for_function("window.did_handshake === true", timeout=LIMIT_MS)


def go(page: Page, url: str) -> None:
    """Go to a page, and wait until it is connected."""
    page.goto(url)
    await_connection(page)
