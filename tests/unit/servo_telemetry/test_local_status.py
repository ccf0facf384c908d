"""The status on the local socket fits its models and equals that of the command handler."""

import json
import math

from fake_command_handler import LEARNED, OUTLOOK, REVERSAL, SCREW, FakeCommandHandler

from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.local_messages import Reversal, message_json, plain_json, server_message
from servo_ctrl.commands.machine_status import DriveStatus, MachineStatus, ProgramStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.telemetry.local_socket.status import BusFigures, StatusEncoder, with_missed

BUS = {
    "load": 0.77,
    "bit_rate": 1_000_000,
    "frames_per_s": 7057.3,
    "cycle_us": {"edges_us": (990.0, 1010.0), "counts": [1, 97, 2]},
    "missed_ticks": 0,
    "missing_inputs": 3,
}
DRIVE = DriveStatus("x", "servo", "operation enabled", 0x1637, None, True, math.nan, True, (-0.1, 0.1))


def decoded_status(handler: FakeCommandHandler, encoder: StatusEncoder, missed: int = 0) -> MachineStatus:
    emcy = [{"time": "t", "node": "axis.x.drive", "code": 0x8611, "error_register": 33, "text": "late"}]
    events = [{"cycle": 7, "text": 'axis "x"'}]
    nodes = [{"name": "axis.x.drive", "node_id": 1, "nmt_state": "operational", "heartbeat_age_s": None}]
    figures = BusFigures(plain_json(BUS), plain_json(nodes), plain_json(emcy), plain_json(events))
    pieces = encoder.pieces(handler.status(), figures)
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            status = server_message(with_missed(end.value, missed))
            assert isinstance(status, MachineStatus)
            return status


def test_every_status_field_arrives() -> None:
    handler = FakeCommandHandler()
    handler.set_learning("y", LearningState.RUNNING, OUTLOOK._replace(best_m=math.nan))
    handler.set_axis(0, learned=LEARNED, version=3, learned_at="2026-01-01", last=REVERSAL, learning_due=True)
    handler.set_axis(1, screw=SCREW)
    program = ProgramStatus("part.ngc", 2, "round", 0.25, held=True, loaded=True)
    handler.now = handler.now._replace(
        stage=Stage.STANDBY, reason="stopped", drives=(DRIVE,), program=program, cycles=99
    )
    status = decoded_status(handler, StatusEncoder(), 12)
    assert (status.stage, status.reason, status.cycles, status.rows_missed) == (
        Stage.STANDBY,
        "stopped",
        99,
        12,
    )
    assert (status.learning.state, status.learning.axis) == (LearningState.RUNNING, "y")
    assert math.isnan(status.learning.best_m)
    assert status.learning.progress == OUTLOOK.strokes_done / OUTLOOK.strokes_total
    first, second = status.axes
    assert first.learned is not None
    assert (first.learned.durations, first.learned.trailing) == (LEARNED.durations, LEARNED.trailing)
    assert first.last is not None
    assert first.last.error_mean_m == REVERSAL.error_mean_m
    assert (second.learned, second.screw.points) == (None, SCREW.points)
    assert (status.drives, status.program, status.settings) == ((DRIVE,), program, handler.now.settings)
    assert (status.bus.cycle_us.counts, status.bus.missing_inputs) == ((1, 97, 2), 3)
    assert (status.emcy[0].code, status.events[0].text, status.nodes[0].node_id) == (0x8611, 'axis "x"', 1)


def test_a_new_version_shows_although_the_old_one_was_plain_json() -> None:
    handler, encoder = FakeCommandHandler(), StatusEncoder()
    handler.set_axis(0, learned=LEARNED)
    decoded_status(handler, encoder)
    handler.set_axis(0, learned=LEARNED._replace(strokes=48))
    handler.set_axis(1, screw=SCREW)
    status = decoded_status(handler, encoder)
    assert status.axes[0].learned is not None
    assert status.axes[0].learned.strokes == 48
    handler.set_axis(0, learned=None)
    handler.set_axis(1, screw=SCREW._replace(enabled=False))
    status = decoded_status(handler, encoder)
    assert (status.axes[0].learned, status.axes[1].screw.enabled) == (None, False)


def test_a_reversal_carries_its_trace_and_a_gap_in_it_is_null() -> None:
    reversal = Reversal("x", REVERSAL._replace(contour_peak_m=math.nan), 1e-3, (1e-6, math.nan, -2e-6))
    message = message_json("reversal", reversal)
    assert "NaN" not in message.decode()
    assert server_message(message) == reversal
    assert json.loads(message)["report"]["contour_peak_m"] is None
    assert json.loads(message)["period_s"] == 1e-3
