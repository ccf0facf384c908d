"""The daemon commissions the templates of real drive families, simulated with their peculiarities.

No hardware: what each family does is in machines/templates/README.md, with its source.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from consecutive_runs import ConsecutiveRuns, Script

from hil_sim.config import load_plant
from hil_sim.config.model import Personality
from servo_ctrl.canopen.errors import BootError
from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.recording.reader import load_recording
from tests.campaigns.campaign.machine import CampaignMachine

TEMPLATES = Path(__file__).parents[2] / "machines" / "templates"
FAMILIES = sorted(file.parent.name for file in TEMPLATES.glob("*/controller.toml"))
PROGRAM = """
[[step]]
kind = "move"
label = "out"
to_mm = { x = 2.0 }
feed_mm_min = 1200.0
"""


def runs_of(family: str, folder: Path, machine: MachineConfig | None = None, **ways: Any) -> ConsecutiveRuns:
    """Return a stand of this family; `machine`: another controller file, `ways`: other peculiarities."""
    controller = load_machine(TEMPLATES / family) if machine is None else machine
    plant = load_plant(TEMPLATES / family)
    axis = plant.axes["x"]
    personality = axis.drive.personality
    assert personality is not None
    changed = axis.drive.model_copy(update={"personality": personality.model_copy(update=ways)})
    plant = plant.model_copy(update={"axes": {"x": axis.model_copy(update={"drive": changed})}})
    file = folder / "program.toml"
    file.write_text(PROGRAM, encoding="utf-8")
    program = load_program(file, controller)
    return ConsecutiveRuns(CampaignMachine(controller, plant, program, folder / "none"), folder, "lockstep")


def run(runs: ConsecutiveRuns, folder: Path) -> Any:
    """Run a move; return its recording."""

    def script() -> Script:
        yield from runs.ready_with_program()
        runs.ask(Command.START_PROGRAM)
        yield runs.at(Stage.READY)
        yield 300

    try:
        report = runs.run(script, recording=folder / "recording")
    finally:
        runs.close()
    assert report.reason == "stopped by SIGTERM"
    assert report.events == ("stopped by SIGTERM",)
    assert [span.label for span in report.spans] == ["out"]
    return load_recording(folder / "recording").columns


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_is_commissioned_homed_and_moved(family: str, tmp_path: Path) -> None:
    columns = run(runs_of(family, tmp_path), tmp_path)
    led = ~np.isnan(columns["x.position_command_m"])
    error_m = np.abs(columns["x.position_command_m"] - columns["x.motor_position_m"])[led]
    assert np.ptp(columns["x.position_command_m"][led]) == pytest.approx(2e-3, rel=1e-6)
    assert error_m.max() < 2e-4
    assert error_m[-1] < 1e-5


def test_inputs_are_spread_over_two_tpdos_of_a_cycle(tmp_path: Path) -> None:
    """Other identifiers, and statusword and mode in another PDO than position and current: same motion."""
    source = (TEMPLATES / "maxon_epos4" / "controller.toml").read_text(encoding="utf-8")
    text = source.replace("../../../eds", str(TEMPLATES.parents[1] / "eds")).replace(
        "../eds", str(TEMPLATES / "eds")
    )
    text = text.replace('"statusword", "position_actual_value"', '"position_actual_value"')
    text += """
[axis.x.drive.pdo.tpdo1]
cob_id = 0x1A1

[axis.x.drive.pdo.tpdo2]
objects = ["statusword", "modes_of_operation_display"]
cob_id = 0x2A1
"""
    (tmp_path / "controller.toml").write_text(text, encoding="utf-8")
    spread = run(runs_of("maxon_epos4", tmp_path, load_machine(tmp_path)), tmp_path)
    other = tmp_path / "other"
    other.mkdir()
    usual = run(runs_of("maxon_epos4", other), other)
    led = ~np.isnan(usual["x.position_command_m"])
    assert np.array_equal(spread["x.motor_position_m"][led], usual["x.motor_position_m"][led])
    assert np.array_equal(spread["x.motor_current_a"][led], usual["x.motor_current_a"][led])


@pytest.mark.parametrize(
    ("family", "setting", "wrong", "complaint"),
    [
        ("maxon_epos4", "velocity_unit", "counts/s", "60A9h = 00B44700h, the machine file says 00B50300h"),
        ("maxon_epos4", "acceleration_unit", "0.001 rpm/s", "60AAh = 00C00300h"),
        ("nanotec_pd4c", "velocity_unit", "rpm", "60A9h = 00B50300h, the machine file says 00B44700h"),
    ],
)
def test_a_family_in_other_units_than_the_file_states_is_refused(
    family: str, setting: str, wrong: str, complaint: str, tmp_path: Path
) -> None:
    machine = load_machine(TEMPLATES / family)
    axis = machine.axes["x"]
    drive = axis.drive.model_copy(update={setting: wrong})
    other = machine.model_copy(update={"axes": {"x": axis.model_copy(update={"drive": drive})}})
    with pytest.raises(BootError, match=complaint):
        run(runs_of(family, tmp_path, other), tmp_path)


@pytest.mark.parametrize(
    ("family", "setting", "usual"),
    [("jvl_mis", "homing_bits", "10 and 12"), ("engel_hbi", "mode_switch", "enabled")],
)
def test_without_its_key_a_family_does_not_become_ready(
    family: str, setting: str, usual: str, tmp_path: Path
) -> None:
    """The drive does not become ready, for minutes of homing or seconds in another mode."""
    machine = load_machine(TEMPLATES / family)
    axis = machine.axes["x"]
    drive = axis.drive.model_copy(update={setting: usual})
    other = machine.model_copy(update={"axes": {"x": axis.model_copy(update={"drive": drive})}})
    with pytest.raises(AssertionError, match="did not come true: <Stage"):
        run(runs_of(family, tmp_path, other), tmp_path)


def test_the_ways_of_every_family_differ_from_the_bench_and_have_a_source() -> None:
    page = (TEMPLATES / "README.md").read_text(encoding="utf-8")
    for family in FAMILIES:
        ways = load_plant(TEMPLATES / family).axes["x"].drive.personality
        assert ways is not None
        assert ways != Personality(inside_eds=ways.inside_eds)
        section = page.split(f"## `{family}`")[1].split("\n## ")[0]
        assert "Source: " in section
    assert "No drive of these families has been connected yet" in page
