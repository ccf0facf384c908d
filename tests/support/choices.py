"""A choice from a list on a page."""

from playwright.sync_api import Locator, expect


def choose(field: Locator, option: str) -> None:
    """Choose an option of a field; return when its list is closed: the next list may have the same one."""
    field.click()
    found = field.page.get_by_role("option", name=option, exact=True)
    found.click()
    expect(found).to_have_count(0)
