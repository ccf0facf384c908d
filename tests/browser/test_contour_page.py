"""The Contour page: the path, the error about the circle, and the last turn with and without compensation."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from choices import choose
from playwright.sync_api import expect

if TYPE_CHECKING:
    from collections.abc import Callable

    from page_server import Stub
    from playwright.sync_api import Page

FRAMES = "document.querySelector('[data-testid=contour-{}]').dataset.frames"


def wait_for_frames(page: Page, chart: str, wanted: int) -> None:
    page.wait_for_function(f"Number({FRAMES.format(chart)} || 0) >= {wanted}")


def test_a_circle_is_found_drawn_and_measured(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/contour")
    table = page.get_by_test_id("contour-table")
    row = table.get_by_role("row", name="without compensation")
    expect(row).to_be_visible()
    about = page.get_by_test_id("contour-about")
    # the stub's circle: R 25 mm in 4 s a turn, and its bumps of 5 um
    expect(about).to_contain_text(re.compile("R 25[.]0000 mm, 2.356[.]2 mm/min, counterclockwise"))
    coupling = page.get_by_test_id("contour-coupling")
    expect(coupling).to_have_text("Contour control couples X, Y: contour error now +1.20 µm.")
    for cell in row.get_by_role("cell").all()[:4]:
        assert abs(float(cell.inner_text().replace("\N{MINUS SIGN}", "-"))) > 4.5
    wait_for_frames(page, "path", 5)
    wait_for_frames(page, "polar", 1)
    wait_for_frames(page, "quadrants", 1)
    arrays = "getElement(document.querySelector('[data-testid=contour-path]').id.slice(1)).arrays"
    assert page.evaluate(f"Math.max(...{arrays}[0])") > 0.0249
    choose(page.get_by_test_id("contour-factor"), "\N{MULTIPLICATION SIGN} 500")
    expect(about).to_contain_text("Error drawn 500 times")
    choose(page.get_by_test_id("contour-path-factor"), "\N{MULTIPLICATION SIGN} 1000")
    page.wait_for_function(f"Math.max(...{arrays}[2]) > 0.0275")
    picture(page, "contour")


def test_it_fits_a_narrow_dark_screen_in_inches(
    visit: Callable[..., Page], stub: Stub, picture: Callable[[Page, str], None]
) -> None:
    page = visit("/contour", width=360, dark=True)
    choose(page.get_by_label("Units"), "inch")
    expect(page.get_by_test_id("contour-about")).to_contain_text("0.98425 in")
    wait_for_frames(page, "polar", 1)
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    picture(page, "contour_narrow_dark")
    page.get_by_test_id("contour-forget").click()
    expect(page.get_by_test_id("contour-table")).not_to_contain_text("without compensation")
