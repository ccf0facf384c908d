"""A temperature that the controller reads from the amplifier, and the waveform that follows it."""

import asyncio
from typing import Any

import pytest
from program_steps import dwell
from waveform_examples import example_waveform

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.run import temperatures
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.learned.store import WaveformStore
from servo_ctrl.learning.level_over_temperature import FOLLOW_MIN, LevelNode, LevelSchedule

SOURCE = """
[axis.x.temperature]
node_id = 1
address = "{address}"
k_per_count = 0.1
offset_degc = {offset_degc}
"""
PROBE = "\n[axis.x.temperature_probe]\nsurroundings_degc = 20.0\n"
COLD = LevelSchedule((LevelNode(20.0, 1.15, 0.1), LevelNode(40.0, 1.0, 0.1)), followed=1.0, evidence=0.05)
"""Friction is 15 % more at 20 degC than where the waveform was left."""


async def rested(
    bench: Any,
    monkeypatch: pytest.MonkeyPatch,
    *,
    address: str = "0x2012:00",
    offset_degc: float = 0.0,
    probe: str = PROBE,
) -> tuple[RunReport, MachineConfig]:
    """Stand still for ten seconds with a stored waveform, adaptation on."""
    monkeypatch.setattr(temperatures, "READING_S", 0.02)
    before = "[axis.x.learned_waveform]"
    source = SOURCE.format(address=address, offset_degc=offset_degc)
    machine_dir = bench.machine({before: source + before, "[learning]": "[learning]\nadaptation = true"})
    with (machine_dir / "plant.toml").open("a", encoding="utf-8") as plant:
        plant.write(probe)
    machine = load_machine(machine_dir)
    stored = example_waveform()._replace(schedule=COLD)
    WaveformStore(machine_dir / "learned", machine).add("x", stored, {})
    path = machine_dir / "rest.toml"
    path.write_text(dwell(10.0), encoding="utf-8")
    bench.simulate(machine_dir)
    async with asyncio.timeout(60.0):
        report = await run_machine(machine, load_program(path, machine), bench.bus_spec, "lockstep")
    assert (report.completed, report.reason) == (True, "")
    return report, machine


async def test_a_cold_axis_has_its_friction_before_the_first_reversal(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    report, machine = await rested(bench, monkeypatch)
    assert not [text for text in report.events if "temperature" in text]
    stored = WaveformStore(machine.source.parent / "learned", machine).active("x")
    assert stored is not None
    assert stored.version == 2
    assert stored.conditions["friction_level"] == pytest.approx(1.15, rel=FOLLOW_MIN)
    ratio = stored.learned.friction[0] / example_waveform().friction[0]
    assert ratio == pytest.approx(stored.conditions["friction_level"])
    schedule = stored.learned.schedule  # relative to what is stored
    assert schedule.followed == pytest.approx(1.0)
    assert schedule.nodes[0].level == pytest.approx(1.0, rel=FOLLOW_MIN)


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"probe": ""}, "reading 2012h:00 was refused"),
        ({"offset_degc": 500.0}, "520 degC is not within -40 to 150"),
        ({"address": "0x2013:00"}, "servo_drive.eds has no object 2013h:00"),
        ({"address": "0x1008:00"}, "is no number"),
    ],
)
async def test_bad_answers_are_reported_once_and_nothing_moves(
    bench: Any, monkeypatch: pytest.MonkeyPatch, settings: dict[str, Any], reason: str
) -> None:
    report, machine = await rested(bench, monkeypatch, **settings)
    [text] = [text for text in report.events if "no temperature" in text]
    assert text.startswith("axis x: no temperature: ")
    assert reason in text
    stored = WaveformStore(machine.source.parent / "learned", machine).active("x")
    assert stored is not None
    assert stored.version == 1
