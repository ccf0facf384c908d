"""The status on the local socket is what the models say, and it is what the desk said."""

from __future__ import annotations

import json
import math

from fake_desk import LEARNED, OUTLOOK, REVERSAL, SCREW, FakeDesk

from servo_ctrl.config.desk import DriveStatus, LearningState, ProgramStatus
from servo_ctrl.config.local_messages import Reversal
from servo_ctrl.config.local_status import Status
from servo_ctrl.telemetry.local_socket_status import (
    BusFigures,
    StatusEncoder,
    encoded,
    reversal,
    with_missed,
)

BUS = {
    "load": 0.77,
    "bit_rate": 1_000_000,
    "frames_per_s": 7057.3,
    "cycle_us": {"edges_us": (990.0, 1010.0), "counts": [1, 97, 2]},
    "missed_ticks": 0,
    "missing_inputs": 3,
}
DRIVE = DriveStatus("x", "servo", "operation enabled", 0x1637, None, True, math.nan, True, (-0.1, 0.1))


def told(desk: FakeDesk, encoder: StatusEncoder, missed: int = 0) -> Status:
    emcy = [{"time": "t", "node": "axis.x.drive", "code": 0x8611, "error_register": 33, "text": "late"}]
    events = [{"cycle": 7, "text": 'axis "x"'}]
    nodes = [{"name": "axis.x.drive", "node_id": 1, "nmt_state": "operational", "heartbeat_age_s": None}]
    figures = BusFigures(encoded(BUS), encoded(nodes), encoded(emcy), encoded(events))
    pieces = encoder.pieces(desk.status(), figures)
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return Status.model_validate_json(with_missed(end.value, missed))


def test_everything_the_desk_knows_arrives() -> None:
    desk = FakeDesk()
    desk.learns("y", LearningState.RUNNING, OUTLOOK._replace(best_m=math.nan))
    desk.axis(0, learned=LEARNED, version=3, learned_at="2026-01-01", last=REVERSAL, learning_due=True)
    desk.axis(1, screw=SCREW)
    program = ProgramStatus("part.ngc", 2, "round", 0.25, held=True, loaded=True)
    desk.now = desk.now._replace(stage=8, reason="stopped", drives=(DRIVE,), program=program, cycles=99)
    status = told(desk, StatusEncoder(), 12)
    assert (status.stage, status.reason, status.cycles, status.rows_missed) == ("standby", "stopped", 99, 12)
    assert (status.learning.state, status.learning.axis, status.learning.best_m) == ("running", "y", None)
    assert status.learning.progress == OUTLOOK.strokes_done / OUTLOOK.strokes_total
    first, second = status.axes
    assert first.learned is not None
    assert (first.learned.durations, first.learned.trailing) == (LEARNED.durations, LEARNED.trailing)
    assert first.last is not None
    assert first.last.error_mean_m == REVERSAL.error_mean_m
    assert SCREW.learned is not None
    assert (second.learned, second.screw.points) == (None, SCREW.learned.points)
    assert status.drives[0].model_dump() == {**DRIVE._asdict(), "position_m": None}
    assert status.program.model_dump() == program._asdict()
    assert status.settings.model_dump() == {"required_m": 4e-6, "learner": "fast", "adaptation": False}
    assert (status.bus.cycle_us.counts, status.bus.missing_inputs) == ((1, 97, 2), 3)
    assert (status.emcy[0].code, status.events[0].text, status.nodes[0].node_id) == (0x8611, 'axis "x"', 1)


def test_a_new_version_shows_although_the_old_one_was_encoded() -> None:
    desk, encoder = FakeDesk(), StatusEncoder()
    desk.axis(0, learned=LEARNED)
    told(desk, encoder)
    desk.axis(0, learned=LEARNED._replace(strokes=48))
    desk.axis(1, screw=SCREW)
    status = told(desk, encoder)
    assert status.axes[0].learned is not None
    assert status.axes[0].learned.strokes == 48
    desk.axis(0, learned=None)
    desk.axis(1, screw=SCREW._replace(enabled=False))
    status = told(desk, encoder)
    assert (status.axes[0].learned, status.axes[1].screw.enabled) == (None, False)


def test_a_reversal_carries_its_trace_and_a_gap_in_it_is_null() -> None:
    message = reversal(REVERSAL._replace(contour_peak_m=math.nan), "x", [1e-6, math.nan, -2e-6], 1e-3)
    assert "NaN" not in message.decode()
    found = Reversal.model_validate_json(message)
    assert (found.axis, found.error_m) == ("x", (1e-6, None, -2e-6))
    assert (found.report.cycle, found.report.contour_peak_m) == (REVERSAL.cycle, None)
    assert json.loads(message)["period_s"] == 1e-3
