"""The pictures of the operator's pages at both widths, on a simulated table: `python -m ... OUT`.

An axis learns in short strokes, a circle runs before and after, and its recording is diagnosed with a model
that lacks the table's friction: what the pages show is what they show a reader who does the same.
"""

import os
import re
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "tests" / "support"))  # pytest has it on its path, a program has not: E402
from browser_program import CHROMIUM  # noqa: E402
from free_port import free_tcp_port  # noqa: E402  # likewise
from live_page import go  # noqa: E402
from machine_files import XY_TABLE, text_of  # noqa: E402
from playwright.sync_api import Page, expect, sync_playwright  # noqa: E402
from simulated_table import SHORT_CIRCLE, SHORT_LEARNING, opened, served_table, table_directory  # noqa: E402

from servo_ctrl.files.toml_text import toml_text  # noqa: E402

LIMIT_MS = 240_000
TUNING_LIMIT_MS = 1_200_000
HEIGHT_PX = 830
WHOLE = {"drive", "motion", "tuning"}
"""Pages that are shown down to their end."""
DRAWN_MS = 1500
"""Time for plots to fit themselves to another width."""
CONCEALED = ("stribeck_friction", "presliding_gms", "cogging")
"""Effects of the simulated table that the diagnosed model lacks, where the table has them."""


def nominal_model() -> str:
    """Return the table's model without some of its friction."""
    document = tomllib.loads(text_of(XY_TABLE / "plant.toml"))
    for axis in document["axis"].values():
        for effect in CONCEALED:
            axis.pop(effect, None)
    return toml_text(document)


SEE_TAB = "document.querySelector('nav [aria-current=page]').scrollIntoView({inline: 'center'})"


def shoot(page: Page, name: str, out: Path) -> None:
    """Keep the page as it is at both widths."""
    for width, end in ((1280, ""), (390, "_390")):
        page.set_viewport_size({"width": width, "height": HEIGHT_PX})
        page.wait_for_timeout(DRAWN_MS)
        page.evaluate(SEE_TAB)
        if name in WHOLE:
            whole = page.evaluate("document.documentElement.scrollHeight")
            page.set_viewport_size({"width": width, "height": whole})
            page.wait_for_timeout(DRAWN_MS)
        page.screenshot(path=out / f"operator_{name}{end}.png")
    page.set_viewport_size({"width": 1280, "height": HEIGHT_PX})


def load(page: Page, url: str, program: str) -> None:
    go(page, f"{url}/motion")
    page.get_by_test_id("program-choice").click()
    page.get_by_role("option", name=program).click()
    expect(page.get_by_test_id("program-verdict")).to_contain_text("within the limits")
    page.get_by_test_id("load-program").click()
    expect(page.get_by_test_id("program-name")).to_have_text(program, timeout=LIMIT_MS)


def start(page: Page, url: str) -> None:
    go(page, f"{url}/motion")
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("program-step")).to_contain_text("circle", timeout=LIMIT_MS)


def run(page: Page, url: str) -> None:
    start(page, url)
    expect(page.get_by_test_id("stage")).to_contain_text("Ready", timeout=LIMIT_MS)


def learn(page: Page, url: str, limit_ms: float = LIMIT_MS) -> None:
    go(page, f"{url}/friction")
    page.get_by_test_id("start-learning").click()
    expect(page.get_by_test_id("version-x")).to_contain_text("version 1", timeout=limit_ms)
    expect(page.get_by_test_id("stage")).to_contain_text("Ready", timeout=LIMIT_MS)


def diagnose(page: Page, url: str) -> None:
    go(page, f"{url}/reconcile")
    page.get_by_test_id("recordings").get_by_text(re.compile("^run ")).first.click()
    model = page.get_by_test_id("model")
    model.fill("nominal.toml")
    model.press("Enter")
    page.get_by_test_id("run-diagnosis").click()
    expect(page.get_by_test_id("verdict-sentence")).to_be_visible(timeout=LIMIT_MS)


def tune(page: Page, url: str) -> None:
    """Tune the first axis on the simulator."""
    go(page, f"{url}/tuning")
    page.get_by_test_id("run-tuning").click()
    expect(page.get_by_test_id("tuning-ms")).to_be_visible(timeout=TUNING_LIMIT_MS)


def take(page: Page, url: str, out: Path) -> None:
    """Operate the table, and keep the pages on the way."""
    page.get_by_test_id("take-control").click()
    page.get_by_test_id("enable").click()
    expect(page.get_by_test_id("stage")).to_contain_text("Ready", timeout=LIMIT_MS)
    load(page, url, "circle.toml")
    run(page, url)
    learn(page, url)
    run(page, url)
    for name in ("friction", "contour", "bus"):
        go(page, f"{url}/{name}")
        shoot(page, name, out)
    start(page, url)
    go(page, f"{url}/scope")
    page.wait_for_timeout(DRAWN_MS)
    page.get_by_test_id("scope-hold").click()
    shoot(page, "scope", out)
    expect(page.get_by_test_id("stage")).to_contain_text("Ready", timeout=LIMIT_MS)
    diagnose(page, url)
    shoot(page, "reconcile", out)
    tune(page, url)
    shoot(page, "tuning", out)
    load(page, url, "bracket.ngc")
    shoot(page, "motion", out)
    go(page, url)
    shoot(page, "drive", out)


def main() -> None:
    """Take all pictures."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    bracket = (XY_TABLE / "programs" / "bracket.ngc").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory(prefix="servo-operator-") as name, sync_playwright() as playwright:
        folder = Path(name)
        programs = {"circle.toml": SHORT_CIRCLE, "bracket.ngc": bracket}
        machine = table_directory(folder / "table", SHORT_LEARNING, programs)
        (machine / "nominal.toml").write_text(nominal_model(), encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        context = browser.new_context(viewport={"width": 1280, "height": HEIGHT_PX})
        context.set_default_timeout(LIMIT_MS)
        port = free_tcp_port()
        with served_table(machine, folder, port, dict(os.environ)) as served:
            take(opened(context, served.url), served.url, out)
        browser.close()


if __name__ == "__main__":
    main()
