"""Waveforms in the daemon: switched, adapted by production, stored and rolled back."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from learning_stand import LearningStand
from waveform_examples import example_waveform

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.daemon.learning.learned_compensation import CompensationError
from servo_ctrl.learned.file_model import LearnedFile
from servo_ctrl.learned.store import StoreError, WaveformStore
from servo_ctrl.learned.waveform_model import LearnedWaveform
from servo_ctrl.learning.level_over_temperature import LevelNode, LevelSchedule
from servo_ctrl.learning.temperature_input import TemperatureInput
from servo_ctrl.learning.types import NO_PULSE, ReversalReport

Stand = Callable[..., LearningStand]


@pytest.fixture
def learned(stand: Stand, tmp_path: Path) -> WaveformStore:
    """A version for x."""
    store = WaveformStore(tmp_path / "learned", stand().config)
    store.add("x", example_waveform(), {})
    return store


def acts(made: LearningStand, axis: str = "x") -> bool:
    return bool(made.servos[axis].params.waveform.enabled)


def reversal(made: LearningStand, lag_m: float) -> None:
    """A reversal of x in production, at which the axis lags for a while."""
    trace_m = lag_m * np.sin(np.linspace(0.0, np.pi, 194)) ** 2
    mean_m = float(np.mean(np.abs(trace_m)))
    report = ReversalReport(1, 1, 0.2, lag_m, lag_m, mean_m, mean_m)
    made.services.learning.waveform_adaptation.take(0, report, trace_m)


def test_a_stored_waveform_acts_from_the_start_and_is_switched_by_command(
    stand: Stand, learned: WaveformStore
) -> None:
    made = stand()
    assert acts(made)
    assert not acts(made, "y")
    status = made.status.axes[0].waveform
    assert (status.enabled, status.version, status.strokes) == (True, 1, 9)
    assert made.handler.execute(CommandRequest(Command.DISABLE_WAVEFORM, "x")).accepted
    assert not acts(made)
    assert made.handler.execute(CommandRequest(Command.ENABLE_WAVEFORM)).accepted
    assert acts(made)
    for compensation, wanted in (("off", False), ("pulse", False), ("waveform", True)):
        if compensation == "pulse":
            with pytest.raises(CompensationError):
                stand(compensation=compensation)
            continue
        if compensation == "waveform":
            with pytest.raises(CompensationError, match="no waveform has been learned for axis y yet"):
                stand(compensation=compensation)
            learned.add("y", example_waveform(7), {})
        assert acts(stand(compensation=compensation)) is wanted


def test_production_changes_it_and_the_change_is_a_version_that_can_be_rolled_back(
    stand: Stand, learned: WaveformStore
) -> None:
    made = stand()
    made.services.learning.adaptation.on = True
    before = made.servos["x"].params.waveform
    reversal(made, 5e-6)
    after = made.servos["x"].params.waveform
    assert after.friction != before.friction or (after.waves != before.waves).any()
    made.services.learning.waveform_adaptation.store()
    stored = learned.active("x")
    assert stored is not None
    assert (stored.version, stored.conditions["changes"]) == (2, 1)
    assert made.machine.notes[-1] == "axis x: waveform changed 1 times, stored as version 2"
    assert made.handler.execute(CommandRequest(Command.ROLL_BACK_WAVEFORM, "x")).accepted
    assert made.servos["x"].params.waveform.friction == before.friction
    assert made.status.axes[0].waveform.version == 1


def test_nothing_changes_while_adaptation_is_off_or_the_waveform_is(
    stand: Stand, learned: WaveformStore
) -> None:
    made = stand()
    before = made.servos["x"].params.waveform
    reversal(made, 5e-6)
    made.services.learning.adaptation.on = True
    assert made.handler.execute(CommandRequest(Command.DISABLE_WAVEFORM, "x")).accepted
    reversal(made, 5e-6)
    assert made.handler.execute(CommandRequest(Command.ENABLE_WAVEFORM, "x")).accepted
    after = made.servos["x"].params.waveform
    assert (after.friction, after.waves.tolist()) == (before.friction, before.waves.tolist())
    assert [entry.version for entry in learned.versions("x")] == [1]


def test_no_waveform_acts_on_strokes_of_the_pulse(stand: Stand, learned: WaveformStore) -> None:
    assert learned.active("x") is not None
    made = stand()
    assert made.handler.execute(CommandRequest(Command.START_LEARNING, "x")).accepted
    assert not acts(made)
    assert made.services.learning.job._learning.stroke.pulse == NO_PULSE  # its first stroke
    made.handler.execute(CommandRequest(Command.ABORT_LEARNING))
    assert acts(made)


def test_a_damaged_waveform_and_one_of_other_gains_are_reported_and_not_used(
    stand: Stand, learned: WaveformStore, tmp_path: Path
) -> None:
    path = tmp_path / "learned" / "x" / "waveform" / "v0001.json"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("3.0", "4.0", 1), encoding="utf-8")
    made = stand()
    assert not acts(made)
    assert "axis x runs without its learned waveform: " in made.machine.notes[0]
    assert "--kind waveform" in made.machine.notes[0]
    with pytest.raises(StoreError):
        learned.active("x")


def test_the_level_follows_the_temperature_while_adaptation_is_on_and_is_stored(
    stand: Stand, learned: WaveformStore
) -> None:
    nodes = (LevelNode(20.0, 1.1, 0.1), LevelNode(40.0, 1.0, 0.1))
    schedule = LevelSchedule(nodes, followed=1.0, evidence=0.05)
    learned.add("x", example_waveform()._replace(schedule=schedule), {})
    made = stand()
    adaptation = made.services.learning.waveform_adaptation
    before = made.servos["x"].params.waveform.friction.level_1_n
    cold = TemperatureInput(20.0, "", 20.0)
    adaptation.warmed("x", cold, 60.0)
    assert made.servos["x"].params.waveform.friction.level_1_n == before  # adaptation is off
    assert made.status.axes[0].temperature_degc == 20.0
    made.services.learning.adaptation.on = True
    adaptation.warmed("x", TemperatureInput(), 60.0)
    assert math.isnan(made.status.axes[0].temperature_degc)
    assert made.servos["x"].params.waveform.friction.level_1_n == before
    adaptation.warmed("x", cold, 60.0)
    assert made.servos["x"].params.waveform.friction.level_1_n == pytest.approx(1.1 * before)
    adaptation.warmed("y", cold, 60.0)  # has no waveform
    made.services.learning.waveform_adaptation.store()
    stored = learned.active("x")
    assert stored is not None
    assert stored.conditions["friction_level"] == pytest.approx(1.1)
    assert [node.level for node in stored.learned.schedule.nodes] == pytest.approx([1.0, 1.0 / 1.1])


def test_a_waveform_with_its_temperatures_is_read_to_the_last_bit_and_one_of_before_without(
    learned: WaveformStore,
) -> None:
    nodes = (LevelNode(20.0, 1.1 / 3.0, 0.1), LevelNode(25.0, 1.0, 10.0))
    scheduled = example_waveform()._replace(schedule=LevelSchedule(nodes, 0.9, 0.1 / 3.0, -0.001))
    assert learned.add("x", scheduled, {}).learned == scheduled
    stored = learned.active("x")
    assert stored is not None
    assert stored.learned == scheduled
    path = learned.directory / "x/waveform/v0001.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["learned"].pop("level_over_temperature") is None
    old = LearnedFile[LearnedWaveform].sealed(document)
    assert old.learned.learned() == example_waveform()
    document["learned"]["level_over_temperature"] = {
        "followed": 1.0,
        "moved": 0.0,
        "evidence": 0.0,
        "nodes": [{"temperature_degc": t, "level": 1.0, "variance": 1.0} for t in (25.0, 20.0)],
    }
    with pytest.raises(ValueError, match="the temperatures must rise"):
        LearnedFile[LearnedWaveform].sealed(document)
