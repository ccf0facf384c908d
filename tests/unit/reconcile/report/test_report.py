"""report.html in a real browser: every picture is drawn, no network request, text is escaped."""

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from browser_program import CHROMIUM
from formula_residuals import NOISE_N, T
from report_examples import HOSTILE


def drawn(text: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="figures">(.*?)</script>', text, re.DOTALL)
    assert found
    pictures: dict[str, Any] = json.loads(found[1])
    return pictures


def test_one_file_below_eight_megabytes_with_plotly_once(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    assert len(text) < 8_000_000
    assert text.count("plotly.js v") == 1
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=", text)
    assert not list(report.parent.glob("*.tmp"))


def test_every_picture_is_one_that_plotly_knows(report: Path) -> None:
    pictures = drawn(report.read_text(encoding="utf-8"))
    assert {
        "x-force-time-0",
        "x-force-time-1",
        "x-force-spectrum",
        "x-force-orders",
        "x-force-whiteness",
        "x-replay",
    } <= (pictures.keys())
    assert {"x-force-since-reversal", "x-deviation-scale-less-motor"} <= pictures.keys()
    for picture in pictures.values():
        text = re.sub(r'"--[a-z-]+"', '"black"', json.dumps(picture))  # roles, that the page makes colours of
        go.Figure(json.loads(text))  # raises where it does not know a property


def test_text_from_files_stays_text(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    assert HOSTILE not in text
    assert text.count("&lt;script&gt;document.title=") >= 13


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium (make system)")
def test_a_browser_draws_all_and_the_page_asks_for_nothing(report: Path, tmp_path: Path) -> None:
    page, log = opened(report, tmp_path)
    pictures = drawn(page)
    assert 'data-ready="yes"' in page
    assert page.count('data-drawn="yes"') == page.count('data-figure="') == len(pictures)
    assert page.count('class="main-svg"') >= len(pictures)
    assert "<title>reconcile: effects</title>" in page
    assert "Content Security Policy" not in log  # the page forbids itself all requests; it would tell
    assert "Uncaught" not in log
    # the same page with a picture from elsewhere is reported, so the check can fail
    asking = tmp_path / "asking.html"
    text = report.read_text(encoding="utf-8")
    asking.write_text(
        text[: text.index("<script")] + '<img src="http://elsewhere.invalid/a.png">', encoding="utf-8"
    )
    assert "Content Security Policy" in opened(asking, tmp_path)[1]


def opened(file: Path, directory: Path) -> tuple[str, str]:
    """Return the page as the browser has rendered it, and the browser's messages."""
    assert CHROMIUM
    quiet = ["--disable-background-networking", "--disable-component-update", "--no-first-run"]
    done = subprocess.run(
        [
            CHROMIUM,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            *quiet,
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--enable-logging=stderr",
            f"--user-data-dir={directory / 'profile'}",
            "--virtual-time-budget=20000",
            "--dump-dom",
            file.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return done.stdout, done.stderr


def test_the_table_of_the_replays_has_both_recordings_with_their_errors(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    table = text[text.index("<h2>Closed-loop replay</h2>") :]
    table = table[: table.index("</table>")]
    assert table.count("2.8 µm") == table.count("0.77 µm") == 2
    squares = 10.0**2 * np.mean(np.sin(np.arange(20_000) * T) ** 2)
    relative = 100.0 * np.sqrt((0.9 * 1.0 + 0.1 * 9.0) / squares)
    assert table.count(f"{relative:.2f} %") == 2
    assert table.count(f"{0.1 * relative:.2f} %") == 2


def test_the_floor_of_the_built_noise_is_in_the_verdict(verdict: dict[str, Any]) -> None:
    floor = verdict["noise_floor"]["x"]["force"]
    assert floor["unit"] == "N"
    assert 0.2 * NOISE_N < floor["rms"] < NOISE_N
    assert verdict["located"][0]["coordinate"] == "order"
