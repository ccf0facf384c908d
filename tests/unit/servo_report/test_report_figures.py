"""The figures of a report, on recordings by formula with known figures."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal
from synthetic_recording import PERIOD_S, circle, reversal, write_recording

from servo_ctrl.recording.min_max import thinned
from servo_ctrl.report.axis_section import WINDOW, axis_sections, longest_run, spectral_density
from servo_ctrl.report.circle_section import circle_section
from servo_ctrl.report.content import ReportPicture, ReportSection, ReportTable
from servo_ctrl.report.positioning_section import positioning_section, visits_of
from servo_ctrl.report.recorded_run import read_run
from servo_ctrl.report.reversal_section import reversal_section
from servo_ctrl.report.run_section import verdict
from servo_ctrl.report.write import report_of

UM = 1e-6


def table(section: ReportSection | None, heading: str) -> list[dict[str, str]]:
    """The rows of a table by the names of its columns."""
    assert section is not None
    (found,) = [part for part in section.parts if isinstance(part, ReportTable) and part.heading == heading]
    return [dict(zip(found.head, row, strict=True)) for row in found.rows]


def circles(tmp_path: Path, *several: dict[str, Any]) -> ReportSection | None:
    """A recording with one segment a circle, and its section."""
    columns = {name: np.concatenate([one[name] for one in several]) for name in several[0]}
    lengths = [len(one["x.position_command_m"]) for one in several]
    ends = np.cumsum(lengths)
    columns["segment"] = np.repeat(np.arange(len(several), dtype=np.float64), lengths)
    segments = [
        {
            "label": f"part {place}",
            "kind": "circle",
            "steady_first_cycle": int(end - length),
            "steady_last_cycle": int(end - 1),
        }
        for place, (end, length) in enumerate(zip(ends, lengths, strict=True))
    ]
    return circle_section(read_run(write_recording(tmp_path / "r", columns, segments=segments)))


def test_an_ellipse_has_its_known_deviations(tmp_path: Path) -> None:
    section = circles(tmp_path, circle(lambda a: 3 * UM * np.cos(2 * a) + 1 * UM, turns=1.2))
    (terms,) = table(section, "Radial and circular deviation")
    assert float(terms["F_max µm"]) == pytest.approx(4.0, abs=0.01)
    assert float(terms["F_min µm"]) == pytest.approx(-2.0, abs=0.01)
    assert float(terms["G µm"]) == pytest.approx(6.0, abs=0.01)
    assert (terms["plane"], terms["R mm"], terms["way"]) == ("XY", "20", "ccw")
    assert float(terms["F mm/min"]) == pytest.approx(2 * np.pi * 20 / 2 * 60, rel=1e-3)


def test_a_shifted_circle_has_no_circular_deviation_but_a_radial_one(tmp_path: Path) -> None:
    shifted = circle(lambda a: 0.0 * a, turns=1.1)
    shifted["x.scale_position_m"] = shifted["x.scale_position_m"] + 5 * UM
    (terms,) = table(circles(tmp_path, shifted), "Radial and circular deviation")
    assert float(terms["F_max µm"]) == pytest.approx(5.0, abs=0.01)
    assert float(terms["G µm"]) == pytest.approx(0.0, abs=0.01)


def test_quadrants_are_distinguished(tmp_path: Path) -> None:
    def steps_m(angle_rad: Any) -> Any:
        return np.array([1.0, 2.0, -3.0, 4.0])[(np.mod(angle_rad, 2 * np.pi) // (np.pi / 2)).astype(int)] * UM

    (row,) = table(circles(tmp_path, circle(steps_m, turns=1.3)), "Contour error by quadrant")
    for name, expected in zip(("I", "II", "III", "IV"), (1.0, 2.0, -3.0, 4.0), strict=True):
        assert float(row[f"{name} mean µm"]) == pytest.approx(expected, abs=0.02)


def test_hysteresis_is_the_difference_between_both_directions(tmp_path: Path) -> None:
    there = circle(lambda a: 2 * UM * np.sin(a), turns=1.1)
    back = circle(lambda a: -2 * UM * np.sin(a), turns=1.1, direction=-1)
    (row,) = table(circles(tmp_path, there, back), "Circular hysteresis")
    assert row["two ways round one circle"] == "1 part 0 / 2 part 1"
    assert float(row["H µm"]) == pytest.approx(4.0, abs=0.01)


def test_less_than_a_turn_is_no_circle(tmp_path: Path) -> None:
    assert circles(tmp_path, circle(lambda a: 0.0 * a, turns=0.9)) is None


def visits(deviation_m: dict[tuple[float, int], list[float]]) -> dict[str, Any]:
    """Moves of 0.1 s, rests of 0.3 s: up through the targets and down, as often as there are runs."""
    targets = sorted({target for target, _ in deviation_m})
    runs = len(next(iter(deviation_m.values())))
    stops = [(targets[0] - 2e-3, 0.0)]
    for run in range(runs):
        stops += [(target, deviation_m[target, 0][run]) for target in targets]
        stops.append((targets[-1] + 2e-3, 0.0))
        stops += [(target, deviation_m[target, 1][run]) for target in reversed(targets)]
        stops.append((targets[0] - 2e-3, 0.0))
    command, actual = [np.zeros(1)], [np.zeros(1)]
    for target_m, off_m in stops:
        way = np.linspace(command[-1][-1], target_m, 101)[1:]
        rest = np.full(300, target_m)
        command += [way, rest]
        actual += [way, rest + off_m]
    return {"x.position_command_m": np.concatenate(command), "x.scale_position_m": np.concatenate(actual)}


def test_positioning_by_iso_230_2(tmp_path: Path) -> None:
    known = {(0.01, 0): [1 * UM, 3 * UM], (0.01, 1): [5 * UM, 5 * UM]}
    known |= {(0.02, 0): [0.0, 0.0], (0.02, 1): [2 * UM, 2 * UM]}
    run = read_run(write_recording(tmp_path / "r", visits(known)))
    found = visits_of(run, run.axes[0])
    assert found is not None
    assert found.target_m == pytest.approx([0.01, 0.02])
    assert found.deviation_m[:, 0, 0] == pytest.approx([1 * UM, 3 * UM])
    assert visits_of(run, run.axes[1]) is None
    (row,) = table(positioning_section(run), "Accuracy and repeatability")
    s_um = np.std([1, 3], ddof=1)
    assert float(row["B µm"]) == pytest.approx(3.0, abs=0.01)  # 2 - 5 at the first target
    assert float(row["R up"]) == pytest.approx(4 * s_um, abs=0.01)
    assert float(row["R µm"]) == pytest.approx(max(2 * s_um + 3.0, 4 * s_um), abs=0.01)
    assert float(row["M µm"]) == pytest.approx(2.5, abs=0.01)
    assert (row["targets"], row["runs"]) == ("2", "2")


def test_force_at_its_limit_is_counted(tmp_path: Path) -> None:
    force_n = np.full(1000, 50.0)
    force_n[100:130] = 100.0
    force_n[400:420] = -100.0
    run = read_run(write_recording(tmp_path / "r", {"x.force_command_n": force_n}))
    rows = table(axis_sections(run)[0], "Force and its saturation")
    assert (rows[0]["at the limit %"], rows[0]["longest ms"]) == ("5.00", "30")
    assert rows[1]["force RMS N"] == "none commanded"
    assert longest_run(np.zeros(5, dtype=bool)) == 0


def test_following_error_is_that_of_the_program_only(tmp_path: Path) -> None:
    error_m = np.where(np.arange(1000) < 500, 8 * UM, 2 * UM)
    columns = {
        "x.position_command_m": np.linspace(0.0, 0.01, 1000),
        "x.scale_position_m": np.linspace(0.0, 0.01, 1000) - error_m,
        "segment": np.where(np.arange(1000) < 500, -1.0, 0.0),
    }
    rows = table(
        axis_sections(read_run(write_recording(tmp_path / "r", columns)))[0], "How well the axes followed"
    )
    assert (rows[0]["error RMS µm"], rows[0]["error largest µm"]) == ("2.00", "2.00")


def test_the_spectrum_holds_the_power_of_the_error() -> None:
    time_s = np.arange(20 * WINDOW) * PERIOD_S
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(time_s))
    error_m = (np.sqrt(2.0) * 3.0 * np.sin(2 * np.pi * 50.0 * time_s) + noise) * UM
    found = spectral_density(error_m, np.arange(len(time_s)), PERIOD_S)
    assert found is not None
    power = np.sum(found.density_m**2) * found.frequency_hz[0]
    assert power == pytest.approx(10.0 * UM**2, rel=0.03)
    assert found.frequency_hz[np.argmax(found.density_m)] == pytest.approx(50.0, abs=0.5)
    f_hz, reference = signal.welch(error_m, 1 / PERIOD_S, window="hann", nperseg=WINDOW, detrend="constant")
    assert found.frequency_hz == pytest.approx(f_hz[1:-1])
    assert found.density_m**2 == pytest.approx(reference[1:-1], rel=1e-6)


def test_the_spectrum_is_that_of_the_longest_stretch_without_a_gap() -> None:
    draw = np.random.default_rng(2)
    error_m = draw.normal(0.0, 1e-6, 8 * WINDOW)
    error_m[WINDOW] = np.nan
    cycle = np.arange(8 * WINDOW)
    cycle[6 * WINDOW :] += 3
    found = spectral_density(error_m, cycle, PERIOD_S)
    whole = slice(WINDOW + 1, 6 * WINDOW)
    alone = spectral_density(error_m[whole], cycle[whole], PERIOD_S)
    assert found is not None
    assert alone is not None
    assert found.density_m == pytest.approx(alone.density_m)
    assert spectral_density(error_m[: WINDOW + 9], cycle[: WINDOW + 9], PERIOD_S) is None


@pytest.mark.parametrize("count", [10, 1000, 1003, 5000])
def test_decimation_keeps_the_peaks(count: int) -> None:
    draw = np.random.default_rng(count)
    y = draw.normal(size=count)
    y[count // 3] = 50.0
    y[count // 2] = -50.0
    y[-count // 10 :] = np.nan
    x, short = thinned(np.arange(count, dtype=np.float64), y, 50)
    assert len(short) <= max(100, min(count, 100))
    assert (np.nanmax(short), np.nanmin(short)) == (50.0, -50.0)
    assert np.isnan(short[-1])
    assert np.all(np.diff(x) > 0.0)
    assert all(a == b or np.isnan(a) for a, b in zip(short, y[x.astype(int)], strict=True))


def test_reversals_are_compared_with_the_requirement(tmp_path: Path) -> None:
    entries = [reversal("x", 0.1 * k, (3.0 + k) * UM, due=k > 2) for k in range(5)]
    run = read_run(write_recording(tmp_path / "r", {"segment": np.zeros(600)}, entries))
    section = reversal_section(run)
    x, y = table(section, "Indicators by axis")
    assert (x["reversals"], x["above J_required %"], x["learning due"]) == ("5", "60", "yes")
    assert (x["J mean µm"], x["J largest µm"], x["J last µm"]) == ("5.00", "7.00", "7.00")
    assert (x["peak error µm"], x["peak contour µm"]) == ("21.00", "14.00")
    assert y["reversals"] == "0"
    (picture,) = [part for part in section.parts if isinstance(part, ReportPicture)]
    assert picture.levels[0].value == pytest.approx(4.0)


def test_the_end_of_a_run_comes_first(tmp_path: Path) -> None:
    columns = {"segment": np.zeros(50)}
    words = []
    for name, header in {
        "good": {},
        "stopped": {"completed": False, "reason": "axis x: following error"},
        "torn": {"finished": False, "completed": False},
    }.items():
        run = read_run(write_recording(tmp_path / name, columns, **header))
        words.append(verdict(run.header)[:2])
        assert report_of(run).verdict == words[-1][0]
    assert words == [("completed", True), ("stopped", False), ("not closed", False)]
