"""What the MQTT topics carry, quantity by quantity."""

import json
from datetime import UTC, datetime, timedelta

from fake_command_handler import LEARNED, REVERSAL, FakeCommandHandler, without_best

from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.telemetry.mqtt.payloads import (
    ack_payload,
    due_payload,
    learned_payload,
    reversal_payload,
    state_payload,
)
from servo_ctrl.telemetry.mqtt.topics import Topics


def test_the_published_state_before_learning() -> None:
    payload = json.loads(state_payload(FakeCommandHandler(("x",)).status(), 0))
    assert payload.pop("time")
    assert payload == {
        "cycle": 0,
        "missed_ticks": 0,
        "stage": "ready",
        "reason": "",
        "learning": {"state": "idle", "axis": None, "reason": ""},
        "axis": {
            "x": {
                "compensation": True,
                "observer": False,
                "learning_due": False,
                "compensation_suspended": False,
                "reversals": 0,
                "error_mean_um": None,
                "version": 0,
                "learned_at": None,
                "screw": {"enabled": False, "version": 0, "learned_at": None},
                "waveform": {"enabled": False, "version": 0, "learned_at": None},
            }
        },
        "settings": {
            "required_um": 4.0,
            "learner": "fast",
            "adaptation": False,
            "feed_override_percent": 100.0,
            "rapid_override_percent": 100.0,
            "single_block": False,
            "optional_stop": False,
            "step_um": 100.0,
            "work_offset": "G54",
        },
        "contour": {"coupled": None, "error_um": None},
        "reversals_dropped": 0,
    }


def test_the_published_state_during_learning() -> None:
    handler = FakeCommandHandler()
    handler.set_learning("y", LearningState.PAUSING, without_best(), "")
    handler.change("learner", "paper")
    payload = json.loads(state_payload(handler.status(), 7))
    assert payload["learning"] == {
        "state": "pausing",
        "axis": "y",
        "reason": "",
        "stage": "coarse",
        "strokes_done": 12,
        "strokes_total": 48,
        "progress": 0.25,
        "remaining_s": 1500.6,
        "acceleration_mm_s2": 8.0,
        "best_um": None,
    }
    assert payload["settings"]["learner"] == "paper"
    assert payload["reversals_dropped"] == 7


def test_the_learned_functions_point_by_point() -> None:
    handler = FakeCommandHandler()
    handler.set_axis(0, version=2, learned_at="2026-11-20T09:00:00+00:00", learned=LEARNED)
    payload = json.loads(learned_payload(99, handler.status().axes[0]))
    assert (payload["cycle"], payload["version"], payload["learned_at"]) == (
        99,
        2,
        "2026-11-20T09:00:00+00:00",
    )
    functions = payload["functions"]
    assert functions["before_um"] == 9.5
    assert functions["after_um"] == 1.6
    assert functions["spread_mm_s2"] == 4.0
    assert functions["amplitudes"] == [
        {"acceleration_mm_s2": 2.0, "amplitude_mm_s": 0.31},
        {"acceleration_mm_s2": 120.0, "amplitude_mm_s": 1.9},
    ]
    assert [point["duration_ms"] for point in functions["durations"]] == [150.0, 80.0, 45.0, 25.0]
    assert functions["trailing"] == [
        {"acceleration_mm_s2": 2.0, "start_ms": 40.0, "duration_ms": 30.0, "amplitude_mm_s": -0.1}
    ]


def test_a_reversal_has_the_time_at_which_it_was_noted() -> None:
    noted = datetime(2026, 11, 21, 10, 30, 0, 250_000, tzinfo=UTC)
    payload = json.loads(reversal_payload(REVERSAL, noted))
    assert payload["time"] == "2026-11-21T10:30:00.250+00:00"
    assert payload["cycle"] == 70_000
    assert payload["error_mean_um"] == 2.4


def test_a_non_finite_number_is_null() -> None:
    payload = json.loads(reversal_payload(REVERSAL._replace(contour_peak_m=float("nan")), datetime.now(UTC)))
    assert payload["contour_peak_um"] is None


def test_the_time_is_utc_and_now() -> None:
    payload = datetime.fromisoformat(json.loads(due_payload(1, due=True))["time"])
    assert payload.utcoffset() == timedelta(0)
    assert abs(datetime.now(UTC) - payload) < timedelta(minutes=1)


def test_an_answer_repeats_no_character_that_could_break_a_line() -> None:
    payload = ack_payload(5, "\ud800\n", "malformed", "käse\n")
    assert payload.isascii()
    assert b"\n" not in payload
    assert json.loads(payload)["id"] == "\ud800\n"


def test_a_machine_name_cannot_change_the_topic_level() -> None:
    topics = Topics("plant/hall 3", "X-Y #1/+ table\n")
    assert topics.state == "plant/hall 3/X-Y__1___table_/state"
    assert topics.reversal("x") == "plant/hall 3/X-Y__1___table_/axis/x/reversal"


def test_a_temperature_is_published_where_there_is_one() -> None:
    status = FakeCommandHandler(("x",)).status()
    assert "temperature_degc" not in json.loads(state_payload(status, 0))["axis"]["x"]
    warm = status._replace(axes=(status.axes[0]._replace(temperature_degc=23.44),))
    assert json.loads(state_payload(warm, 0))["axis"]["x"]["temperature_degc"] == 23.4
