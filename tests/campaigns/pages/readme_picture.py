"""README's picture, a whole learning run with the table's own settings: `python -m ... OUT`.

A circle runs, X learns, the circle runs again. OUT gets the page and, as JSON, the figures on it, which
README names.
"""

import json
import os
import re
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

from tests.campaigns.pages.operator_pictures import (
    CHROMIUM,
    DRAWN_MS,
    HEIGHT_PX,
    XY_TABLE,
    free_tcp_port,
    go,
    learn,
    load,
    opened,
    run,
    served_table,
    text_of,
)

LIMIT_MS = 1_800_000
"""For 1.2 million cycles of learning, also beside other work."""
PERIOD_US = 50
"""Faster than real time, and the page still gets its share of two processors."""
CIRCLES = """
[[step]]
kind = "move"
label = "to the start"
to_mm = { x = 25.0, y = 0.0 }
feed_mm_min = 6000.0

[[step]]
kind = "circle"
label = "circle"
radius_mm = 25.0
feed_mm_min = 2000.0
turns = 4.2
ramp_s = 0.5

[[step]]
kind = "move"
label = "home"
to_mm = { x = 0.0, y = 0.0 }
feed_mm_min = 6000.0
"""


def shown_um(page: Page, mark: str) -> float:
    """Return the first length that an element shows."""
    found = re.search(r"([\d.]+)\s*µm", page.get_by_test_id(mark).inner_text())
    assert found, f"{mark} shows no length"
    return float(found[1])


def take(page: Page, url: str, out: Path) -> None:
    """Run, learn and run again; keep the Friction page and its figures."""
    page.get_by_test_id("take-control").click()
    page.get_by_test_id("enable").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Ready")
    load(page, url, "circles.toml")
    run(page, url)
    go(page, f"{url}/friction")
    before_um = shown_um(page, "j-x")
    learn(page, url, LIMIT_MS)
    strokes = re.search(r"\d+$", page.get_by_test_id("versions").inner_text().strip())
    assert strokes, "no version has strokes"
    run(page, url)
    go(page, f"{url}/friction")
    page.wait_for_timeout(DRAWN_MS)
    whole = page.evaluate("document.documentElement.scrollHeight")
    page.set_viewport_size({"width": 1280, "height": whole})  # else the foot lies across the middle
    page.wait_for_timeout(DRAWN_MS)
    page.screenshot(path=out / "operator_page.png")
    figures = {
        "strokes": int(strokes[0]),
        "J_before_um": before_um,
        "J_after_um": shown_um(page, "j-x"),
        "J_required_um": float(page.get_by_test_id("required").input_value()),
    }
    (out / "operator_page.json").write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Take the picture."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="servo-readme-") as name, sync_playwright() as playwright:
        folder = Path(name)
        (folder / "xy_table" / "programs").mkdir(parents=True)
        for file in ("controller.toml", "plant.toml"):
            (folder / "xy_table" / file).write_text(text_of(XY_TABLE / file), encoding="utf-8")
        (folder / "xy_table" / "programs" / "circles.toml").write_text(CIRCLES, encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        context = browser.new_context(viewport={"width": 1280, "height": HEIGHT_PX})
        context.set_default_timeout(LIMIT_MS)
        expect.set_options(timeout=LIMIT_MS)
        with served_table(
            folder / "xy_table", folder, free_tcp_port(), dict(os.environ), period_us=PERIOD_US
        ) as served:
            take(opened(context, served.url), served.url, out)
        browser.close()


if __name__ == "__main__":
    main()
