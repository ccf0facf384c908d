"""Commands over SDO reach the command handler of a controller, and its status is read back unchanged."""

import math

import pytest
from controller_node_bench import NODE_ID, OWN_EDS, ControllerNodeBench
from fake_command_handler import LEARNED, OUTLOOK, REVERSAL, SCREW, without_best
from hypothesis import given, settings
from hypothesis import strategies as st

from servo_ctrl.canopen import remote_controller
from servo_ctrl.canopen.errors import SdoError
from servo_ctrl.canopen.remote_controller import RemoteController
from servo_ctrl.canopen.stack import Network, load_eds
from servo_ctrl.commands.command import Command, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.machine_status import ContourStatus
from servo_ctrl.commands.stage import Stage


class Wire:
    """A remote controller and the node that it talks to, joined frame by frame."""

    def __init__(self) -> None:
        self.bench = ControllerNodeBench()
        self.network = Network(self.bench.put)
        self.bench.client.subscribe(0x580 + NODE_ID, self.network.notify)
        self.remote = RemoteController(self.network, NODE_ID, load_eds(OWN_EDS, NODE_ID), ("x", "y"))
        self.bench.node.boot_up()


@pytest.fixture
def wire() -> Wire:
    return Wire()


def test_commands_reach_the_command_handler(wire: Wire) -> None:
    asked = [CommandRequest(command, axis) for command in Command for axis in ("", "y")]
    assert [wire.remote.execute(request) for request in asked] == [CommandResult()] * len(asked)
    assert wire.bench.handler.requests == asked


def test_settings_arrive_bit_for_bit(wire: Wire) -> None:
    changes = [("required_m", 3.5e-6), ("learner", "paper"), ("adaptation", True)]
    for setting, value in changes:
        assert wire.remote.change(setting, value).accepted
    assert wire.bench.handler.changes == changes


def test_a_command_and_its_axis_are_one_transfer_that_no_other_client_gets_between(wire: Wire) -> None:
    wire.bench.ask("2f 0121 00 01000000")  # another client has selected x
    assert wire.remote.execute(CommandRequest(Command.ROLL_BACK, "y")).accepted
    assert wire.bench.handler.requests == [CommandRequest(Command.ROLL_BACK, "y")]
    assert wire.bench.ask("40 0121 00 00000000") == ["4f01210001000000"]


def test_answers_to_another_client_are_ignored(wire: Wire) -> None:
    wire.bench.handler.verdict = CommandResult(Refusal.WRONG_STATE, "the machine moves")
    others = ("6002210100000000", "8002210130000906", "4f00200003000000")

    def send(can_id: int, payload: bytes) -> None:
        for answer in others:
            wire.network.notify(0x580 + NODE_ID, bytearray.fromhex(answer), 0.0)
        wire.bench.put(can_id, payload)

    wire.network._send = send
    verdict = wire.remote.execute(CommandRequest(Command.START_LEARNING, "y"))
    assert (verdict.refusal, verdict.reason) == (Refusal.WRONG_STATE, "the machine moves")


@pytest.mark.parametrize("refusal", [Refusal.OUT_OF_RANGE, Refusal.WRONG_STATE, Refusal.STORAGE])
def test_refusals_return_the_reason_as_text(wire: Wire, refusal: Refusal) -> None:
    wire.bench.handler.verdict = CommandResult(refusal, "axis y: the machine moves")
    verdict = wire.remote.execute(CommandRequest(Command.START_LEARNING, "y"))
    assert verdict.reason == "axis y: the machine moves"
    assert verdict.refusal in {refusal, Refusal.OUT_OF_RANGE}


@pytest.mark.parametrize(
    ("setting", "value", "reason"),
    [
        ("required_m", 0.02, "0x06090031"),
        ("required_m", 0.0, "0x06090032"),
        ("required_m", 1e3, "does not fit"),
        ("required_m", -1.0, "does not fit"),
    ],
)
def test_values_out_of_range_are_refused(wire: Wire, setting: str, value: float, reason: str) -> None:
    verdict = wire.remote.change(setting, value)
    assert verdict.refusal is Refusal.OUT_OF_RANGE
    assert reason in verdict.reason
    assert wire.bench.handler.changes == []


def test_the_status_is_read_unchanged(wire: Wire) -> None:
    handler = wire.bench.handler
    handler.set_learning("y", LearningState.RUNNING)
    handler.set_axis(0, learning_due=True, reversals=17, last=REVERSAL, observer_enabled=True)
    handler.set_axis(1, version=3, learned_at="2026-11-21T10:00:00+00:00", learned=LEARNED, screw=SCREW)
    handler.now = handler.now._replace(stage=Stage.RUNNING, cycles=123_456, missed_ticks=7)
    axes = (
        handler.now.axes[0],
        handler.now.axes[1]._replace(learned=LEARNED._replace(machine_time_s=3600.0)),
    )
    expected = handler.now._replace(learning=handler.now.learning._replace(remaining_s=1501.0), axes=axes)
    assert wire.remote.status() == expected


def test_the_status_before_learning_is_read_unchanged(wire: Wire) -> None:
    assert wire.remote.status() == wire.bench.handler.now


def test_a_missing_best_value_is_nan(wire: Wire) -> None:
    wire.bench.handler.set_learning("x", LearningState.RUNNING, without_best())
    learning = wire.remote.learning()
    assert learning.planned
    assert math.isnan(learning.best_m)


def test_a_controller_that_does_not_answer_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote_controller, "RESPONSE_TIMEOUT_S", 0.05)
    wire = Wire()
    wire.bench.put(0x000, bytes((2, NODE_ID)))  # stopped
    with pytest.raises(SdoError, match="was not answered"):
        wire.remote.learning()


def test_a_node_of_another_kind_is_an_error(wire: Wire) -> None:
    wire.bench.node._server._dictionary.readers[0x2110] = lambda _sub: b"\x01\x02\x03"
    with pytest.raises(SdoError, match="2110h:01 has 3 bytes"):
        wire.remote.learning()


@settings(deadline=None, max_examples=40)
@given(
    value=st.floats(), count=st.integers(min_value=0, max_value=1 << 40), state=st.sampled_from(LearningState)
)
def test_every_status_can_be_read(value: float, count: int, state: LearningState) -> None:
    wire = Wire()
    handler = wire.bench.handler
    outlook = OUTLOOK._replace(strokes_done=count, remaining_s=value, best_m=value, acceleration_m_s2=value)
    handler.set_learning("y", state, outlook, reason="\u00b5" * 300)
    report = REVERSAL._replace(cycle=count, error_mean_m=value, contour_peak_m=value)
    learned = LEARNED._replace(strokes=count, before_m=value, trailing=((value,) * 4,), amplitudes=())
    handler.set_axis(0, last=report, reversals=count, learned=learned, version=count)
    handler.now = handler.now._replace(cycles=count, missed_ticks=count)
    wire.bench.node.operational(running=True)
    assert wire.bench.cycles(1) == [1]
    status = wire.remote.status()
    assert status.learning.state is state
    assert status.axes[0].learned is not None
    assert status.axes[0].learned.amplitudes == ()
    last = status.axes[0].last
    assert last is not None
    if 0.0 <= value < 4.0:  # more than 4.29 m do not fit
        assert last.error_mean_m == pytest.approx(value, abs=0.5001e-9)
    if math.isnan(value):
        assert math.isnan(last.error_mean_m)


@pytest.mark.parametrize(
    ("error_m", "number"),
    [(-3.5e-6, -3500), (2e-9, 2), (math.nan, -(2**31)), (-9.0, -(2**31) + 1), (9.0, 2**31 - 1)],
)
def test_the_contour_error_keeps_its_sign_and_says_when_there_is_none(
    wire: Wire, error_m: float, number: int
) -> None:
    handler = wire.bench.handler
    handler.now = handler.now._replace(contour=ContourStatus(("x", "y"), error_m))
    assert wire.bench.remote.sdo[0x2005].raw == number
    assert wire.bench.remote.sdo[0x2006].raw == "x, y"
    read_m = wire.remote.status().contour.error_m
    assert read_m == pytest.approx(number * 1e-9, abs=1e-15) or (math.isnan(read_m) and math.isnan(error_m))
