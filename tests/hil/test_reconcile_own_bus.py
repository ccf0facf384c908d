"""Closed loop over the bus: concealed physics recorded, diagnosed, written as a model, recorded again.

Two axes, each with an effect that controller and nominal model lack: one shows in the force, one in the
deviation between motor and scale. test_concealed_effects.py has all effects, in the batch twin. The noise
floor is the difference between recordings of the same plant that start fractions of an encoder count apart.
"""

import asyncio
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from concealed_effects import (
    CONCEALED,
    REPEATS_MM,
    Columns,
    Difference,
    channels,
    columns_of,
    difference,
    disagreements,
    noise_floor,
    twin_recording,
)
from concealed_machine import motions, write_machine

from reconcile.diagnosis.diagnose import diagnose
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from servo_ctrl.recording.reader import load_recording

EFFECTS = {name: CONCEALED[name] for name in ("backlash", "presliding_hysteresis")}
"""Effects with states: simulations first differ in their bits where a contact opens or a bristle reverses."""


class ClosedLoop(NamedTuple):
    """Recordings and verdict; columns by name, each axis named after its effect."""

    concealed: Columns
    repeats: list[Columns]
    """Return another recording of the concealed plant."""
    nominal: Columns
    repaired: Columns
    verdict: dict[str, Any]

    def difference(self, axis: str, other: Columns) -> Difference:
        """Return the difference between another recording and that of the concealed plant."""
        return difference(channels(self.concealed, axis), channels(other, axis))


def recorded(machine_dir: Path, plant: Path, out: Path) -> Columns:
    """Record the machine's program, run by the daemon on a simulator of this plant."""
    machine = load_machine(machine_dir)
    program = load_program(machine_dir / "program.toml", machine)

    async def run() -> None:
        async with asyncio.timeout(300.0), simulated_machine(plant, "lockstep") as bus:
            report = await run_machine(machine, program, bus, "lockstep", out, compensation="off")
        assert report.completed, report.reason

    asyncio.run(run())
    return load_recording(out).columns


@pytest.fixture(scope="module")
def closed_loop(tmp_path_factory: pytest.TempPathFactory) -> ClosedLoop:
    """Record, diagnose, simulate the written model, record."""
    folder = tmp_path_factory.mktemp("closed_loop")
    sections = {name: effect.sections for name, effect in EFFECTS.items()}
    positions_m = motions(len(sections))
    machine = write_machine(folder / "machine", sections, positions_m)
    nominal = write_machine(folder / "nominal", dict.fromkeys(sections, ""), positions_m)
    concealed = recorded(machine, machine / "plant.toml", folder / "concealed")
    repeats = [
        write_machine(folder / f"from {start_mm}", sections, positions_m, start_mm) for start_mm in REPEATS_MM
    ]
    found = diagnose([folder / "concealed"], nominal / "plant.toml", folder / "diagnosis", with_next=False)
    return ClosedLoop(
        concealed,
        [columns_of(twin_recording(machine, again, folder / "again.parquet")) for again in repeats],
        columns_of(twin_recording(machine, nominal, folder / "nominal.parquet")),
        recorded(machine, found.model_file, folder / "repaired"),
        found.verdict,
    )


def test_batch_twin_equals_the_recording_of_the_bus(closed_loop: ClosedLoop, tmp_path: Path) -> None:
    """The twin may replace the bus for the noise floor and for the nominal model."""
    sections = {name: effect.sections for name, effect in EFFECTS.items()}
    machine = write_machine(tmp_path / "machine", sections, motions(len(sections)))
    twin = columns_of(twin_recording(machine, machine, tmp_path / "twin.parquet"))
    for axis in EFFECTS:
        assert closed_loop.difference(axis, twin) == (0.0, 0.0)


@pytest.mark.parametrize("effect", EFFECTS)
def test_each_concealed_effect_is_named_alone_with_its_parameters(
    closed_loop: ClosedLoop, effect: str
) -> None:
    found = {f["effect"]: f for f in closed_loop.verdict["findings"] if f["axis"] == effect}
    assert set(found) - CONCEALED[effect].besides == {effect}
    for name, (truth, tolerance) in CONCEALED[effect].parameters.items():
        assert found[effect]["parameters"][name]["value"] == pytest.approx(truth, rel=tolerance), name


@pytest.mark.parametrize("effect", EFFECTS)
def test_written_model_reproduces_the_concealed_plant(closed_loop: ClosedLoop, effect: str) -> None:
    floor = noise_floor(
        channels(closed_loop.concealed, effect), [channels(again, effect) for again in closed_loop.repeats]
    )
    nominal, repaired = (
        closed_loop.difference(effect, closed_loop.nominal),
        closed_loop.difference(effect, closed_loop.repaired),
    )
    assert disagreements(floor, nominal, repaired) == []
