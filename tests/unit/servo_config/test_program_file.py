"""Program files: refusals with their text; the programs of the project pass."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.errors import ConfigError
from servo_ctrl.learning.performance import reversals, window_samples

Write = Callable[[str], Path]

MACHINES = Path(__file__).parents[3] / "machines"
EMPS_DATA = MACHINES.parent.parent / "shared" / "data" / "emps"
MOVE = '[[step]]\nkind = "move"\nlabel = "go"\nto_mm = { x = 10.0 }\nfeed_mm_min = 1000.0\n'
CIRCLE = '[[step]]\nkind = "circle"\nlabel = "F 500"\nradius_mm = 25.0\nfeed_mm_min = 500.0\n'
SINE = '[[step]]\nkind = "sine"\naxis = "y"\namplitude_mm = 5.0\nfrequency_hz = 1.0\n'
SHAPE = (
    '[[step]]\nkind = "s_shape"\naxis = "y"\ndistance_mm = 30\nvelocity_mm_s = 10\nacceleration_mm_s2 = 10\n'
)
DWELL = '[[step]]\nkind = "dwell"\nseconds = 0.1\n'
SAMPLES = '[[step]]\nkind = "samples"\nfile = "ref.npz"\nposition = { x = "x" }\n'


def refusal(path: Path, machine: MachineConfig) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        check_program(load_program(path, machine), machine)
    return caught.value


@pytest.mark.parametrize(
    "path", sorted((MACHINES / "xy_table" / "programs").glob("*.toml")), ids=lambda p: p.stem
)
def test_the_programs_of_the_table_are_within_its_limits(path: Path, table: MachineConfig) -> None:
    steps = check_program(load_program(path, table), table)
    assert sum(len(s.position_m) for s in program_segments(steps, table, [0.0, 0.0])) < 60_000


@pytest.mark.parametrize(
    ("text", "key", "reason"),
    [
        ("", "step", "is missing"),
        ("step = []", "step", "at least 1 item"),
        ("steps = 1\n" + DWELL, "steps", "unknown key"),
        (MOVE + "speed = 1", 'step[1] "go".speed', "unknown key"),
        (DWELL + MOVE.replace("1000.0", '"fast"'), 'step[2] "go".feed_mm_min', "must be a number"),
        (MOVE.replace("x =", "u ="), 'step[1] "go".to_mm', 'no axis "u", only x, y'),
        (MOVE.replace("{ x = 10.0 }", "{}"), 'step[1] "go".to_mm', "at least 1 item"),
        (DWELL + '[[step]]\nkind = "jump"', 'step[2] "jump"', "kind 'jump' is not one of 'move'"),
        ("[[step]]\nseconds = 1", 'step[1] ""', "kind is missing"),
        (DWELL.replace("0.1", "-0.1"), 'step[1] "dwell".seconds', "greater than 0"),
        (DWELL.replace("0.1", "nan"), 'step[1] "dwell".seconds', ""),
        (CIRCLE.replace("25.0", "0"), 'step[1] "F 500".radius_mm', "greater than 0"),
        (CIRCLE + 'axes = ["x", "x"]', 'step[1] "F 500".axes', 'two axes, not "x" twice'),
        (CIRCLE + 'direction = "left"', 'step[1] "F 500".direction', "'ccw' or 'cw'"),
        (CIRCLE + "turns = 0.01\nramp_s = 9", 'step[1] "F 500".ramp_s', "two ramps of 9 s take 0.4775 turns"),
        (SINE + "reverse_acceleration_mm_s2 = 1", 'step[1] "sine".frequency_hz', "either it or reverse_acc"),
        (SINE.replace("frequency_hz = 1.0", ""), 'step[1] "sine".frequency_hz', "either it or reverse_acc"),
        (SHAPE.replace("= 30", "= 0"), 'step[1] "s_shape".distance_mm', "must not be 0"),
        (SHAPE + "repeats = 1.5", 'step[1] "s_shape".repeats', "integer"),
        (SAMPLES + 'input = "a"', 'step[1] "samples".file', "either it or input"),
        (
            SAMPLES.replace("file", "input"),
            'step[1] "samples".input',
            'no file was given for input "ref.npz"',
        ),
        (SAMPLES + "force_offset_gain = { x = 2 }", 'step[1] "samples".force_offset_gain.x', "there is no"),
    ],
)
def test_an_error_names_its_key(write: Write, table: MachineConfig, text: str, key: str, reason: str) -> None:
    path = write(text)
    error = refusal(path, table)
    assert error.key == key
    assert reason in error.reason
    assert str(error).startswith(f"{path}: {key}: ")
    assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            DWELL + MOVE.replace("10.0", "100.5"),
            'step[2] "go": axis x: position 100.5 mm is beyond the limit 100 mm',
        ),
        (
            MOVE.replace("1000.0", "13000").replace("10.0", "90.0"),
            'step[1] "go": axis x: velocity 216.667 mm/s is beyond the limit 200 mm/s',
        ),
        (CIRCLE.replace("500.0", "30000") + "turns = 3", 'step[1] "F 500": axis '),
        (
            SHAPE.replace("acceleration_mm_s2 = 10", "acceleration_mm_s2 = 100"),
            'step[1] "s_shape": axis y: jerk 100000 mm/s^3 is beyond the limit 50000 mm/s^3',
        ),
        (MOVE + 'profile = "trapezoidal"\nacceleration_mm_s2 = 500', 'step[1] "go": axis x: jerk '),
    ],
)
def test_motion_beyond_a_limit_is_refused(
    write: Write, table: MachineConfig, text: str, message: str
) -> None:
    path = write(text)
    assert str(refusal(path, table)).startswith(f"{path}: {message}")


def test_the_start_position_matters(write: Write, table: MachineConfig) -> None:
    program = load_program(write(CIRCLE), table)
    check_program(program, table)  # from 0 the circle reaches x = -50 mm
    with pytest.raises(ConfigError, match=r"axis x: position -11\d.* mm is beyond the limit -100 mm"):
        check_program(program, table, [-0.065, 0.0])


def test_a_long_dwell_is_checked_at_once(write: Write, table: MachineConfig) -> None:
    check_program(load_program(write(DWELL.replace("0.1", "86400")), table), table)


def test_a_trapezoid_takes_what_acceleration_the_jerk_limit_leaves(
    write: Write, table: MachineConfig
) -> None:
    short = MOVE.replace("10.0", "0.5") + 'profile = "trapezoidal"\n'  # a triangle: twice the jump at its top
    steps = check_program(load_program(write(short), table), table)
    (segment,) = program_segments(steps, table, [0.0, 0.0])
    assert np.abs(segment.acceleration_m_s2).max() == pytest.approx(0.5 * 50.0 * 1e-3)


def test_circles_contain_one_settled_turn_with_every_window_at_constant_speed(table: MachineConfig) -> None:
    program = load_program(MACHINES / "xy_table" / "programs" / "circles.toml", table)
    window = window_samples(table.monitoring.window_s, table.period_s)
    feeds = []
    for segment in program_segments(check_program(program, table), table, [0.0, 0.0]):
        if segment.kind != "circle":
            continue
        start, stop = segment.steady
        turned = np.unwrap(np.arctan2(*segment.position_m[start:stop, ::-1].T))
        settle = 0.2 * np.hypot(*segment.velocity_m_s[start]) / 0.025
        assert turned[-1] - turned[0] > 2 * np.pi + settle
        for axis in range(2):
            found = reversals(segment.position_m[start:stop, axis])
            assert (found + window <= stop - start).sum() >= 2
        feeds.append(np.hypot(*segment.velocity_m_s[start]) * 60e3)
    assert feeds == pytest.approx([500, 1000, 2000, 3000])


@pytest.fixture
def recorded(tmp_path: Path) -> dict[str, np.ndarray]:
    time = np.arange(50) * 1e-3
    return {"time_s": time, "x": 1e-3 * np.sin(3 * time) ** 2, "f": np.full(50, 2.0)}


@pytest.mark.parametrize("form", ["npz", "csv", "parquet", "recording"])
def test_samples_come_from_any_of_the_formats(
    write: Write, table: MachineConfig, tmp_path: Path, recorded: dict[str, np.ndarray], form: str
) -> None:
    name = "ref" if form == "recording" else f"ref.{form}"
    if form == "npz":
        np.savez(tmp_path / name, **recorded)
    elif form == "csv":
        rows = np.column_stack(list(recorded.values()))
        np.savetxt(tmp_path / name, rows, delimiter=",", header=",".join(recorded), comments="", fmt="%.17g")
    elif form == "parquet":
        pq.write_table(pa.table(recorded), tmp_path / name)
    else:
        (tmp_path / name).mkdir()
        pq.write_table(
            pa.table({k: v[:20] for k, v in recorded.items()}), tmp_path / name / "part-00000.parquet"
        )
        pq.write_table(
            pa.table({k: v[20:] for k, v in recorded.items()}), tmp_path / name / "part-00001.parquet"
        )
    text = SAMPLES.replace("ref.npz", name) + 'force_offset = { x = "f" }\nforce_offset_gain = { x = 10 }\n'
    steps = check_program(load_program(write(text), table), table)
    (segment,) = program_segments(steps, table, [0.0, 0.03])
    np.testing.assert_array_equal(segment.position_m[:, 0], recorded["x"])
    np.testing.assert_array_equal(segment.position_m[:, 1], 0.03)
    np.testing.assert_array_equal(segment.force_offset_n, np.tile([20.0, 0.0], (50, 1)))


@pytest.mark.parametrize(
    ("change", "key", "reason"),
    [
        ({"x": None}, "x", "there is no such column"),
        ({"x": np.full(50, np.nan)}, "x", "is not finite in row 1"),
        ({"x": np.zeros(49)}, "x", "is not a column of 50 numbers"),
        ({"x": np.zeros((50, 2))}, "x", "is not a column"),
        ({"x": np.array(["a"] * 50)}, "", "cannot be read"),
        ({"time_s": np.arange(50) * 2e-3}, "time_s", "step of 0.002 s behind row 1 is not the SYNC period"),
    ],
)
def test_samples_that_cannot_be_used_are_named(
    write: Write,
    table: MachineConfig,
    tmp_path: Path,
    recorded: dict[str, np.ndarray],
    change: dict[str, np.ndarray | None],
    key: str,
    reason: str,
) -> None:
    columns = {**recorded, **change}
    np.savez(tmp_path / "ref.npz", **{k: v for k, v in columns.items() if v is not None})
    error = refusal(write(SAMPLES), table)
    assert (error.file, error.key) == (str(tmp_path.resolve() / "ref.npz"), key)
    assert reason in error.reason


@pytest.mark.parametrize(("name", "reason"), [("ref.npz", "no such file"), ("ref.txt", "is none of .npz")])
def test_missing_or_unknown_sample_files_are_named(
    write: Write, table: MachineConfig, tmp_path: Path, name: str, reason: str
) -> None:
    (tmp_path / "ref.txt").touch()
    error = refusal(write(SAMPLES.replace("ref.npz", name)), table)
    assert error.file.endswith(name)
    assert reason in error.reason


def test_a_force_offset_needs_its_object(write: Write, machines: Path, tmp_path: Path) -> None:
    text = (machines / "xy_table" / "controller.toml").read_text(encoding="utf-8")
    path = tmp_path / "controller.toml"
    path.write_text(text.replace(', "torque_offset"', "", 1), encoding="utf-8")
    machine = load_machine(path)
    error = refusal(write(SAMPLES + 'force_offset = { x = "f" }'), machine)
    assert error.key == 'step[1] "samples".force_offset.x'
    assert '"torque_offset" in axis.x.drive.rpdo1' in error.reason


@pytest.mark.skipif(not EMPS_DATA.exists(), reason="../shared/data/emps is absent")
@pytest.mark.parametrize(("record", "top_n"), [("emps_train", 0.0), ("emps_test_pulses", 5 * 35.1507)])
def test_the_emps_recordings_are_a_program(machines: Path, record: str, top_n: float) -> None:
    machine = load_machine(machines / "emps")
    inputs = {"recording": EMPS_DATA / f"{record}.npz"}
    program = load_program(machines / "emps" / "programs" / "reference.toml", machine, inputs)
    (segment,) = program_segments(check_program(program, machine), machine, [0.0])
    assert segment.position_m.shape == (24841, 1)
    assert segment.force_offset_n.max() == pytest.approx(top_n)
