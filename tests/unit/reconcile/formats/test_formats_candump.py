"""Logs of the bus, written by python-can, decoded with the EDS files and the mappings of the boot."""

import math
import struct
from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest
from axis_motion import COUNT_M, SCALE_COUNT_M, Axis, clean
from can.io.canutils import CanutilsLogWriter

from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.formats.mapping import parse_mapping
from reconcile.formats.nominal_axis import BusNodes
from reconcile.recording.recording import AxisRecording, load_recordings

EDS = Path(__file__).parents[4] / "eds"
DRIVE, SCALE = 5, 17
RATED_A, RATED_NM = 1.5, 0.64
NODES = BusNodes(DRIVE, EDS / "servo_drive.eds", RATED_NM, RATED_A, SCALE, EDS / "linear_scale.eds")
MODEL = {"x": Axis(bus=NODES)}
CLEAN = clean(1.0)
SCALE_M = CLEAN.scale_m if CLEAN.scale_m is not None else np.zeros(0)
MOTOR = np.rint(CLEAN.motor_m / COUNT_M).astype(int)
POSITION = np.rint(SCALE_M / SCALE_COUNT_M).astype(int)
CURRENT = np.rint(CLEAN.force_n / 270.0 / RATED_A * 1e3).astype(int)
EPOCH_S = 1_700_000_000.0
ENABLED = 0x0027
TPDO = (0x60410010, 0x60640020, 0x60780010)


def download(node: int, index: int, subindex: int, value: int, size: int) -> tuple[int, bytes]:
    specifier = {1: 0x2F, 2: 0x2B, 4: 0x23}[size]
    return 0x600 + node, struct.pack("<BHBI", specifier, index, subindex, value)


def boot() -> Iterator[tuple[int, bytes]]:
    """TPDO 1 of the drive gets another identifier and mapping; RPDO 1 carries the target torque."""
    yield download(DRIVE, 0x1800, 1, 0x80000000 | 0x1A5, 4)
    yield download(DRIVE, 0x1A00, 0, 0, 1)
    for i, entry in enumerate(TPDO):
        yield download(DRIVE, 0x1A00, i + 1, entry, 4)
    yield download(DRIVE, 0x1A00, 0, len(TPDO), 1)
    yield download(DRIVE, 0x1800, 1, 0x1A5, 4)
    yield download(DRIVE, 0x1600, 0, 2, 1)
    yield download(DRIVE, 0x1600, 1, 0x60400010, 4)
    yield download(DRIVE, 0x1600, 2, 0x60710010, 4)
    yield download(SCALE, 0x1A00, 0, 1, 1)
    yield download(SCALE, 0x1A00, 1, 0x60040020, 4)


def cycle(k: int, *, offset: int = 0) -> Iterator[tuple[int, bytes]]:
    yield 0x80, b""
    position = (int(MOTOR[k]) + offset + 2**31) % 2**32 - 2**31  # as a counter of 32 bits
    yield 0x1A5, struct.pack("<Hih", ENABLED, position, CURRENT[k])
    yield 0x180 + SCALE, struct.pack("<i", POSITION[k])
    yield 0x200 + DRIVE, struct.pack("<Hh", 0x0F, 2 * CURRENT[k])


def written(
    path: Path, *, booted: bool = True, lost: range = range(0), late_s: Array | None = None, offset: int = 0
) -> Path:
    with CanutilsLogWriter(path) as log:

        def add(stamp_s: float, frame: tuple[int, bytes]) -> None:
            log.on_message_received(
                can.Message(
                    timestamp=EPOCH_S + stamp_s,
                    arbitration_id=frame[0],
                    data=frame[1],
                    is_extended_id=False,
                    channel="can0",
                )
            )

        for frame in boot() if booted else ():
            add(0.0, frame)
        for k in range(len(MOTOR)):
            stamp_s = 1.0 + k * 1e-3 + (0.0 if late_s is None else float(late_s[k]))
            for frame in cycle(k, offset=offset):
                if k not in lost or frame[0] != 0x1A5:
                    add(stamp_s, frame)
    return path


def load(path: Path, *mapping: str) -> list[AxisRecording]:
    return load_recordings([path], MODEL, parse_mapping(mapping))


def check(recording: AxisRecording) -> None:
    assert recording.scale_m is not None
    np.testing.assert_allclose(recording.motor_m, CLEAN.motor_m, atol=1e-12)
    np.testing.assert_allclose(recording.scale_m, SCALE_M, atol=1e-12)
    np.testing.assert_allclose(recording.force_n, CURRENT * RATED_A * 1e-3 * 270.0, atol=1e-9)


def test_a_log_with_the_boot_in_it_is_decoded_by_the_mapping_that_the_boot_wrote(tmp_path: Path) -> None:
    (recording,) = load(written(tmp_path / "boot.log"))
    check(recording)
    assert recording.period_s == pytest.approx(1e-3, rel=1e-6)
    assert recording.force_command_n is not None
    per_mille_n = RATED_NM * 1e-3 * 2.0 * math.pi / 0.01
    np.testing.assert_allclose(recording.force_command_n, 2 * CURRENT * per_mille_n, atol=1e-9)


def test_frames_of_can_fd_in_a_classic_log_are_skipped_and_counted(tmp_path: Path) -> None:
    path = written(tmp_path / "mixed.log")
    lines = path.read_text(encoding="utf-8").splitlines()
    for at in (300, 600, 900):  # one on an identifier of ours, with a payload that would fit
        lines.insert(at, lines[at].split(" can0 ")[0] + " can0 1A5##1FFFFFFFFFFFFFFFF")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    (recording,) = load(path)
    check(recording)
    (found,) = recording.findings
    assert (found.check, found.severity) == ("skipped", "note")
    assert "3 frames of CAN FD are skipped" in found.message


def test_a_counter_that_wraps_goes_on(tmp_path: Path) -> None:
    (recording,) = load(written(tmp_path / "wrap.log", offset=2**31))
    np.testing.assert_allclose(
        recording.motor_m - recording.motor_m[0], CLEAN.motor_m - CLEAN.motor_m[0], atol=1e-9
    )


def test_a_log_without_the_boot_is_decoded_by_identifier_byte_and_type(tmp_path: Path) -> None:
    path = written(tmp_path / "late.log", booted=False)
    (recording,) = load(
        path, "x.position=0x1A5@2:i32,x.current=0x1A5@6:i16,x.scale=0x191@0:i32", "x.statusword=0x1A5@0:u16"
    )
    check(recording)


def test_lost_frames_are_interpolated_and_reported(tmp_path: Path) -> None:
    (recording,) = load(written(tmp_path / "lost.log", lost=range(500, 503)))
    np.testing.assert_allclose(recording.motor_m, CLEAN.motor_m, atol=1e-7)
    assert [(f.check, f.size) for f in recording.findings] == [("hole", 3.0)]


def test_late_time_stamps_make_no_gaps(tmp_path: Path) -> None:
    late_s = np.abs(np.random.default_rng(2).normal(0.0, 1e-4, len(MOTOR)))
    late_s[300] = 2.4e-3  # a hiccup of the logger: three stamps in one go
    late_s[301:303] = [1.5e-3, 0.6e-3]
    (recording,) = load(written(tmp_path / "jitter.log", late_s=late_s))
    check(recording)
    assert [(f.check, "taken to be even" in f.message) for f in recording.findings] == [("jitter", True)]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("  can0  181   [2]  27 00\n", r"line 1: is not a line of `candump -L`"),
        ("(1.000000) can0 185#2700\n", r"has no SYNC"),
        ("(1.0) can0 080#\n(1.1) can1 080#\n", r"several buses: can0, can1"),
        ("(1.0) can0 080#\n(1.1) can0 080#\n", r"no position of an axis.*0x181@2:i32"),
    ],
)
def test_a_log_without_usable_frames_is_refused(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "bad.log").write_text(text)
    with pytest.raises(ReconcileError, match=reason):
        load(tmp_path / "bad.log")


def test_frames_that_do_not_fit_the_mapping_are_refused(tmp_path: Path) -> None:
    lines = [f"({k}.0) can0 080#\n({k}.1) can0 185#27000000\n" for k in range(5)]
    (tmp_path / "bad.log").write_text("".join(lines))
    with pytest.raises(ReconcileError, match=r"PDO 185h: most frames are not of the 2 bytes"):
        load(tmp_path / "bad.log")


@pytest.mark.parametrize(("count", "size"), [(65, 1), (0xFFFFFFFF, 4)])
def test_a_mapping_of_more_objects_than_there_can_be_is_refused(
    tmp_path: Path, count: int, size: int
) -> None:
    path = written(tmp_path / "much.log")
    can_id, data = download(DRIVE, 0x1A00, 0, count, size)
    path.write_text(path.read_text() + f"({EPOCH_S + 9.0:.6f}) can0 {can_id:03X}#{data.hex()}\n")
    with pytest.raises(ReconcileError, match=f"PDO 1A5h.*maps {count} objects"):
        load(path)


def test_a_multiplexed_pdo_is_ignored(tmp_path: Path) -> None:
    path = written(tmp_path / "multiplexed.log")
    can_id, data = download(SCALE, 0x1A01, 0, 0xFF, 1)
    path.write_text(f"({EPOCH_S - 1.0:.6f}) can0 {can_id:03X}#{data.hex()}\n" + path.read_text())
    (recording,) = load(path)
    check(recording)


def test_lines_that_are_none_and_frames_that_no_pdo_is_are_skipped(tmp_path: Path) -> None:
    path = written(tmp_path / "damaged.log")
    lines = ("# by hand", "(1.0) can0 #", "(nan) can0 1A5#00", "(1.0) can0 000001A5#00", "(1.0) can0 1A5#R")
    foreign = "".join(f"{line}\n" for line in (*lines, "(1.0) can0 1A5##000"))
    path.write_text(foreign + path.read_text() + "(1700000", encoding="utf-8")
    check(load(path)[0])
