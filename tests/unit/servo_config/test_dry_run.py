"""The dry run against closed forms: extents, lengths, speeds; and violations by line."""

import math
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.dry_run import DryRun, dry_run
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.errors import ConfigError

MM = 1e-3


@pytest.fixture(scope="module")
def xy() -> MachineConfig:
    return load_machine(Path(__file__).parents[3] / "machines" / "xy_table")


def run_dry(xy: MachineConfig, folder: Path, text: str, name: str = "part.ngc") -> DryRun:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    program = load_program(path, xy)
    steps = check_program(program, xy)
    return dry_run(steps, xy)


def test_a_circle_has_its_extents_its_length_and_its_feed(xy: MachineConfig, tmp_path: Path) -> None:
    found = run_dry(xy, tmp_path, "G0 X15 Y0\nG3 I-5 F600\nM2")
    np.testing.assert_allclose(found.lowest_m, [0.0, -5 * MM], atol=1e-6)
    np.testing.assert_allclose(found.highest_m, [15 * MM, 5 * MM], atol=1e-6)
    assert found.length_m == pytest.approx((15.0 + 10.0 * math.pi) * MM, rel=1e-3)
    (circle,) = found.lines
    assert (circle.line, circle.feed_m_s) == (2, pytest.approx(10 * MM))
    assert circle.top_m_s == pytest.approx(10 * MM, rel=1e-6)
    assert circle.mean_m_s < circle.top_m_s
    assert 0.9 < found.reached < 1.0
    assert found.slow_lines == []
    assert found.duration_s > math.pi  # 10 pi mm at 10 mm/s, and the approach


def test_the_highest_of_each_axis_are_those_of_the_samples(xy: MachineConfig, tmp_path: Path) -> None:
    text = "G0 X5 Y-3\nG4 P0.1\nG1 X20 Y9 F2000\nG2 X26 Y9 R3\nM2"
    found = run_dry(xy, tmp_path, text)
    steps = check_program(load_program(tmp_path / "part.ngc", xy), xy)
    parts = list(program_segments(steps, xy, [0.0, 0.0]))
    assert found.duration_s == pytest.approx(sum(len(part.position_m) for part in parts) * xy.period_s)
    velocity = np.concatenate([part.velocity_m_s for part in parts])
    acceleration = np.concatenate([np.zeros((1, 2)), *(part.acceleration_m_s2 for part in parts)])
    np.testing.assert_array_equal(found.speed_m_s, np.abs(velocity).max(axis=0))
    np.testing.assert_array_equal(found.acceleration_m_s2, np.abs(acceleration).max(axis=0))
    np.testing.assert_allclose(
        found.jerk_m_s3, np.abs(np.diff(acceleration, axis=0)).max(axis=0) / xy.period_s
    )
    assert found.path_speed_m_s == pytest.approx(np.linalg.norm(velocity, axis=1).max())
    assert found.plot_rapid[1]
    assert not found.plot_rapid[-1]


def test_a_line_too_short_to_reach_its_feed_is_named(xy: MachineConfig, tmp_path: Path) -> None:
    found = run_dry(xy, tmp_path, "G61\nG0 X0 Y0\nG1 X20 F600\nX20.2 F6000\nX40 F600\nM2")
    (slow,) = found.slow_lines
    assert (slow.line, slow.feed_m_s) == (4, pytest.approx(0.1))
    assert found.slowest == slow
    # from rest to rest within 0.2 mm under the jerk limit J: v = (J d^2 / 4)^(1/3) at the most
    assert slow.top_m_s <= (50.0 * (0.2 * MM) ** 2 / 4.0) ** (1.0 / 3.0) * 1.001


def test_a_program_of_steps_is_run_dry_as_well(xy: MachineConfig, tmp_path: Path) -> None:
    text = '[[step]]\nkind = "move"\nto_mm = { x = 10.0 }\nfeed_mm_min = 600.0\n'
    found = run_dry(xy, tmp_path, text, "program.toml")
    assert found.length_m == pytest.approx(10 * MM, rel=1e-6)
    assert (found.lines, found.slowest) == ((), None)


@pytest.mark.parametrize(
    ("text", "line", "value"),
    [
        ("G61 G0 X0 Y0\nG1 X50 F3000\nX120\nX0\nM2", 3, "position 120 mm"),
        ("G0 X0 Y0\nG4 P1\n\n\nG1 Y-101 F3000\nM2", 5, "position -101 mm"),
        ("G0 X200 Y0\nM2", 1, "position 200 mm"),
        ("G0 X95 Y0\nG1 Y1 F600\nG2 X95 Y-1 R-8 F600\nM2", 3, "position 110.93"),
    ],
)
def test_a_violated_limit_names_the_line(
    xy: MachineConfig, tmp_path: Path, text: str, line: int, value: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        run_dry(xy, tmp_path, text)
    assert caught.value.file.endswith("part.ngc")
    assert caught.value.key == f"line {line}"
    assert value in caught.value.reason
    assert "is beyond the limit" in caught.value.reason
