"""Status of the bus: states of nodes, regularity of the cycle, values of objects."""

import json
import struct
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import EdsVariable
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.cycle.event_log import EventLog
from servo_ctrl.daemon.page import bus_watch
from servo_ctrl.daemon.page.bus_watch import BusWatch
from servo_ctrl.daemon.page.object_values import decoded, encoded
from servo_ctrl.daemon.page.row_tap import RowTap
from servo_ctrl.telemetry.local_socket.rows import RowBuffer

PLANS = plan_machine(load_machine(Path("machines/xy_table")))
BOOLEAN, INTEGER8, UNSIGNED16, REAL32, VISIBLE_STRING, OCTET_STRING, UNSIGNED64 = 1, 2, 6, 8, 9, 0xA, 0x1B


class Watched:
    """A watch with handlers of nodes to which others listen too."""

    def __init__(self) -> None:
        self.received: list[tuple[int, bytes]] = []
        self.buffer = RowBuffer(2)
        self.tap = RowTap(self.buffer, 1e-3, 1.0 / 30.0)
        self.machine: Any = SimpleNamespace(missed_ticks=5, missing_inputs=7, events=EventLog(1000))
        self.watch = BusWatch(PLANS, self.machine, self.tap)
        self.port: Any = SimpleNamespace(frames=0, bits=0, handlers={})
        for plan in PLANS:
            for can_id in (0x700 + plan.node_id, 0x080 + plan.node_id):
                self.port.handlers[can_id] = lambda data, _time, can_id=can_id: self.received.append(
                    (can_id, data)
                )
        self.watch.listen(self.port)

    def hear(self, can_id: int, payload: bytes) -> None:
        self.port.handlers[can_id](bytearray(payload), 0.0)


def test_bus_watch_receives_frames_beside_other_subscribers() -> None:
    watched = Watched()
    node = PLANS[0].node_id
    watched.hear(0x700 + node, b"\x05")
    watched.hear(0x700 + PLANS[1].node_id, b"\x7f")
    watched.hear(0x080 + node, struct.pack("<HB5x", 0x8611, 0x21))
    watched.hear(0x080 + node, b"short")
    watched.hear(0x080 + node, struct.pack("<HB5x", 0x0000, 0x00))
    figures = watched.watch.figures()
    nodes, emcy = json.loads(figures.nodes), json.loads(figures.emcy)
    assert [entry["nmt_state"] for entry in nodes[:3]] == ["operational", "pre_operational", "unknown"]
    assert nodes[0]["heartbeat_age_s"] >= 0.0
    assert nodes[2]["heartbeat_age_s"] is None
    assert [(entry["code"], entry["error_register"], entry["text"]) for entry in emcy] == [
        (0x8611, 0x21, "following error"),
        (0x0000, 0x00, "error reset"),
    ]
    assert len(watched.received) == 5


def test_a_flood_of_emergencies_costs_one_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    lengths: list[int] = []

    def counted(value: object) -> bytes:
        lengths.append(len(as_ever(value)))
        return as_ever(value)

    as_ever = bus_watch.plain_json
    watched = Watched()
    monkeypatch.setattr(bus_watch, "plain_json", counted)
    for register in range(250):
        watched.hear(0x080 + PLANS[0].node_id, struct.pack("<HB5x", 0x8611, register))
    assert (len(lengths), max(lengths) < 2 * min(lengths)) == (250, True)
    emcy = json.loads(watched.watch.figures().emcy)
    assert [entry["error_register"] for entry in emcy] == list(range(150, 250))


def test_events_come_with_their_cycle_the_newest_hundred() -> None:
    watched = Watched()
    for number in range(250):
        watched.machine.events.add(f"event {number}", number)
    events = json.loads(watched.watch.figures().events)
    assert (len(events), events[0], events[-1]["cycle"]) == (
        100,
        events[0] | {"cycle": 150, "text": "event 150"},
        249,
    )
    assert all(datetime.fromisoformat(event["time"]).tzinfo for event in events)


def test_rates_refer_to_sync_time_not_to_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 100.0
    monkeypatch.setattr("servo_ctrl.daemon.page.bus_watch.time.monotonic", lambda: now_s)
    watched = Watched()
    for _ in range(500):
        watched.buffer.take([0.0, 0.0])
    watched.port.frames, watched.port.bits = 3500, 400_000
    now_s += 5.0
    bus = json.loads(watched.watch.figures().bus)
    assert (bus["frames_per_s"], bus["load"]) == (pytest.approx(7000.0), pytest.approx(0.8))


def test_cleared_counters_restart_at_zero() -> None:
    watched = Watched()
    watched.tap.take([0.0, 0.0])
    watched.tap.take([0.0, 0.0])
    assert sum(json.loads(watched.watch.figures().bus)["cycle_us"]["counts"]) == 1
    watched.watch.clear()
    watched.machine.missed_ticks += 2
    bus = json.loads(watched.watch.figures().bus)
    assert (sum(bus["cycle_us"]["counts"]), bus["missed_ticks"], bus["missing_inputs"]) == (0, 2, 0)


def test_cycle_times_are_counted_as_numpy_counts_them(monkeypatch: pytest.MonkeyPatch) -> None:
    lengths_us = np.random.default_rng(3).gamma(2.0, 500.0, 1000)
    moments = iter((1e9 + 1e3 * np.concatenate(([0.0], np.cumsum(lengths_us)))).tolist())
    monkeypatch.setattr("servo_ctrl.daemon.page.row_tap.time.perf_counter_ns", lambda: next(moments))
    tap = RowTap(RowBuffer(1), 1e-3, 1.0)
    for _ in range(1001):
        tap.take([0.0])
    edges = np.concatenate(([-np.inf], tap.edges_us, [np.inf]))
    np.testing.assert_array_equal(tap.counts, np.histogram(lengths_us, edges)[0])


def variable(data_type: int, low: int | None = None, high: int | None = None) -> EdsVariable:
    return EdsVariable("object", 0x2000, 0, data_type, "rw", False, None, low, high)


@pytest.mark.parametrize(
    ("data_type", "value", "data"),
    [
        (INTEGER8, -3, b"\xfd"),
        (UNSIGNED16, 513, b"\x01\x02"),
        (UNSIGNED16, 513.0, b"\x01\x02"),
        (UNSIGNED64, 2**64 - 1, b"\xff" * 8),
        (REAL32, 0.5, struct.pack("<f", 0.5)),
        (BOOLEAN, True, b"\x01"),
        (VISIBLE_STRING, "drive", b"drive"),
        (OCTET_STRING, "01a0ff", b"\x01\xa0\xff"),
    ],
)
def test_values_travel_as_their_type_and_come_back(
    data_type: int, value: float | str | bool, data: bytes
) -> None:
    assert encoded(variable(data_type), value) == data
    assert decoded(variable(data_type), data) == value


@pytest.mark.parametrize(
    ("data_type", "value", "reason"),
    [
        (UNSIGNED16, -1, "does not fit"),
        (UNSIGNED16, 1.5, "whole number"),
        (UNSIGNED16, "7", "enter a number"),
        (UNSIGNED16, 101, "not within"),
        (VISIBLE_STRING, "µ", "ASCII"),
        (VISIBLE_STRING, "", "1 to 1000 bytes"),
        (OCTET_STRING, "xyz", "hexadecimal"),
    ],
)
def test_values_that_do_not_belong_to_a_type_are_refused(data_type: int, value: Any, reason: str) -> None:
    high = 100 if value == 101 else None
    with pytest.raises(ValueError, match=reason):
        encoded(variable(data_type, None, high), value)


def test_an_answer_of_another_length_is_shown_as_it_is() -> None:
    assert decoded(variable(UNSIGNED16), b"\x01\x02\x03") == "010203"
    assert decoded(variable(REAL32), struct.pack("<f", float("nan"))) == "nan"
