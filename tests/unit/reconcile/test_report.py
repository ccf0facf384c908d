"""report.html in a real browser: every picture is drawn, nothing is asked of a network, text stays text."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go
import pytest
from built_rests import LEAD_M, MASS_KG, NOISE_N, N, T, rest, scene

from reconcile.catalogue.kinds import Sense
from reconcile.model_file import load_model
from reconcile.replay import Replay
from reconcile.replay_models import Replayed, replays_json
from reconcile.report import write_report
from reconcile.report_figures import figures
from reconcile.report_replay import replay_figures
from reconcile.report_traces import peaks
from reconcile.views import verdict_noise, verdict_places, view
from servo_ctrl.report.packed import packed
from servo_ctrl.telemetry.min_max import thinned

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene
    from reconcile.views import View

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
HOSTILE = '<script>document.title="broken"</script>'
MODEL = """
[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
"""


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> list[View]:
    """Force of two recordings with a ripple, and a deviation with 3 um of play."""
    file: Path = tmp_path_factory.mktemp("model") / "model.toml"
    file.write_text(MODEL, encoding="utf-8")
    axis = load_model(file).axes["x"]

    def ripple_n(s: Scene) -> NDArray[np.float64]:
        return np.sin(2.0 * np.pi * s.motion.position_m / LEAD_M)

    ripple = [rest(ripple_n, seed=seed, source=f"{HOSTILE}{seed}") for seed in (0, 1)]
    way = scene()
    play_m = 1.5e-6 * way.motion.last_direction
    with_scale = way._replace(scale_m=way.motion.position_m - play_m)
    noise = rest(of=with_scale, noise=1e-7)
    deviation = noise._replace(measured=noise.after - play_m, before=noise.after - play_m)
    return [
        view("x", Sense.FORCE, ripple, axis, MASS_KG),
        view("x", Sense.DEVIATION, [deviation], axis, MASS_KG),
    ]


@pytest.fixture(scope="module")
def replayed() -> list[Replayed]:
    """Two recordings of 20 s; the nominal model errs by 1 N, and from 12 to 14 s by 3 N."""
    time_s = np.arange(20_000) * T
    force_n = 10.0 * np.sin(time_s)
    missed_n = np.where((time_s >= 12.0) & (time_s < 14.0), 3.0, 1.0)
    place_m = np.zeros_like(time_s)

    def run(number: int, wrong_n: NDArray[np.float64], wrong_m: float) -> Replay:
        return Replay(
            f"{HOSTILE}{number}",
            time_s,
            force_n,
            force_n + wrong_n,
            place_m,
            place_m + wrong_m,
            None,
            None,
            0.0,
        )

    return [Replayed("x", run(k, missed_n, 2.8e-6), run(k, 0.1 * missed_n, 7.7e-7)) for k in (0, 1)]


@pytest.fixture(scope="module")
def verdict(seen: list[View], replayed: list[Replayed]) -> dict[str, Any]:
    level = {"train": 1.0, "heldout": 1.2}
    fit = {"before": level, "refitted": level, "after": {"train": 0.3, "heldout": 0.31}}
    replays = replays_json(replayed, "x")
    return {
        "verdict": "effects",
        "notes": [f"run.csv: {HOSTILE}"],
        "located": verdict_places(seen),
        "noise_floor": verdict_noise(seen),
        "findings": [
            {
                "axis": "x",
                "effect": "cogging",
                "confidence": 0.97,
                "equivalent": ["torque_ripple"],
                "where": {"sensor": "force", "axis": "x"},
                "parameters": {"amplitude": {"value": 1.0, "ci95": [0.9, 1.1], "unit": "N"}},
                "gain": 0.5,
                "heldout_gain": 0.5,
                "explanation": f"a force {HOSTILE} repeats",
                "runners_up": [{"effect": "stribeck_friction", "confidence": 0.02, "why_not": HOSTILE}],
            }
        ],
        "not_observable": [{"axis": "x", "effects": ["backlash"], "why": HOSTILE}],
        "fit": {"x": {"force": {"unit": "N", **fit}, "deviation": {"unit": "m", **fit}, "replay": replays}},
        "minor": [{"axis": HOSTILE, "effect": "backlash", "heldout_gain": 0.004, "confidence": 0.6}],
        "next_experiment": {
            "why": HOSTILE,
            "separates": ["cogging", "torque_ripple"],
            "axis": "x",
            "motion": "several accelerations over the same places",
            "accelerations_mm_s2": [100.0, 300.0],
            "tells": HOSTILE,
        },
    }


@pytest.fixture(scope="module")
def report(
    seen: list[View],
    verdict: dict[str, Any],
    replayed: list[Replayed],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    file: Path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(verdict, seen, file, replayed)
    return file


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
    page, told = opened(report, tmp_path)
    pictures = drawn(page)
    assert 'data-ready="yes"' in page
    assert page.count('data-drawn="yes"') == page.count('data-figure="') == len(pictures)
    assert page.count('class="main-svg"') >= len(pictures)
    assert "<title>reconcile: effects</title>" in page
    assert "Content Security Policy" not in told  # the page forbids itself all requests; it would tell
    assert "Uncaught" not in told
    # the same page with a picture from elsewhere is told of, so the check can fail
    asking = tmp_path / "asking.html"
    text = report.read_text(encoding="utf-8")
    asking.write_text(
        text[: text.index("<script")] + '<img src="http://elsewhere.invalid/a.png">', encoding="utf-8"
    )
    assert "Content Security Policy" in opened(asking, tmp_path)[1]


def opened(file: Path, directory: Path) -> tuple[str, str]:
    """The page as the browser has it in the end, and what the browser tells."""
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


def test_held_out_stretches_are_shaded_and_the_floor_is_drawn(seen: list[View]) -> None:
    over_time = figures(seen[0], 500)[0]
    shaded = [shape for shape in over_time.layout["shapes"] if shape["fillcolor"] == "--held-out"]
    assert [(shape["x0"], shape["x1"]) for shape in shaded] == [pytest.approx((0.75 * N * T, (N - 1) * T))]
    bands = [shape for shape in over_time.layout["shapes"] if shape["fillcolor"] == "--floor-band"]
    assert bands[0]["y1"] == pytest.approx(2.0 * seen[0].floor.rms)


def test_the_ripple_stands_in_the_order_spectrum_and_is_gone_after(seen: list[View]) -> None:
    picture = next(one for one in figures(seen[0], 500) if one.name == "orders")
    (x, before), (_, after) = (
        tuple(np.frombuffer(base64.b64decode(trace[axis]["bdata"]), "<f4") for axis in "xy")
        for trace in picture.data
    )
    assert x[before.argmax()] == pytest.approx(1.0, abs=0.05)
    assert after.max() < 0.3 * before.max()


def test_the_replay_is_drawn_where_the_nominal_model_is_furthest_off(replayed: list[Replayed]) -> None:
    picture = replay_figures(replayed, 5000)["x"]
    x, recorded, before, after = (
        np.frombuffer(base64.b64decode(trace[axis]["bdata"]), "<f4")
        for trace, axis in zip((picture.data[0], *picture.data[:3]), "xyyy", strict=True)
    )
    assert x[-1] - x[0] == pytest.approx(4.0, abs=0.01)
    assert x[0] <= 12.0
    assert x[-1] + T >= 14.0
    assert (before - recorded).max() == pytest.approx(3.0, abs=1e-4)
    assert np.abs(after - recorded).max() == pytest.approx(0.3, abs=1e-4)


def test_the_table_of_the_replays_has_both_recordings_with_their_errors(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    table = text[text.index("<h2>Closed-loop replay</h2>") :]
    table = table[: table.index("</table>")]
    assert table.count("2.8 µm") == table.count("0.77 µm") == 2
    squares = 10.0**2 * np.mean(np.sin(np.arange(20_000) * T) ** 2)
    relative = 100.0 * np.sqrt((0.9 * 1.0 + 0.1 * 9.0) / squares)
    assert table.count(f"{relative:.2f} %") == 2
    assert table.count(f"{0.1 * relative:.2f} %") == 2


def test_the_gap_between_the_ways_is_the_play(seen: list[View]) -> None:
    picture = next(one for one in figures(seen[1], 500) if one.name == "scale-less-motor")
    forwards, backwards = (
        np.frombuffer(base64.b64decode(trace["y"]["bdata"]), "<f4") for trace in picture.data
    )
    assert np.median(backwards) - np.median(forwards) == pytest.approx(3.0, abs=0.2)


def test_no_peak_is_lost_where_a_series_is_cut() -> None:
    rng = np.random.default_rng(0)
    x, y = np.arange(1.0, 100_001.0), rng.normal(size=100_000)
    y[[777, 50_001]] = 40.0, -30.0
    short_x, short_y = thinned(x, y, 300)
    assert len(short_y) <= 600
    assert (short_y.max(), short_y.min()) == (40.0, -30.0)
    assert (np.diff(short_x) > 0.0).all()
    top_x, top_y = peaks(x, np.abs(y), 300)
    assert len(top_y) <= 301
    assert (top_y.max(), top_x[top_y.argmax()]) == (40.0, 778.0)
    assert np.isnan(thinned(x, np.where(x > 5e4, np.nan, y), 300)[1]).any()


def test_arrays_are_packed_as_plotly_reads_them() -> None:
    trace = go.Scatter(y=packed(np.array([1.0, -2.5, np.nan])))
    assert np.frombuffer(base64.b64decode(trace.to_plotly_json()["y"]["bdata"]), "<f4")[:2].tolist() == [
        1.0,
        -2.5,
    ]


def test_the_floor_of_the_built_noise_is_in_the_verdict(verdict: dict[str, Any]) -> None:
    floor = verdict["noise_floor"]["x"]["force"]
    assert floor["unit"] == "N"
    assert 0.2 * NOISE_N < floor["rms"] < NOISE_N
    assert verdict["located"][0]["coordinate"] == "order"
