"""From the machine file to learning the screw: settings in SI, and the motion of a travel."""

from pathlib import Path

import numpy as np
import pytest
from screw_stand import SECTION, stage_file

from servo_ctrl.config.learning import screw_settings, screw_steps
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import program_segments
from servo_ctrl.errors import ConfigError
from servo_ctrl.learning.screw_travel import ScrewSettings, nodes_m, travel_s


def stage(directory: Path, *changes: tuple[str, str]) -> MachineConfig:
    return load_machine(stage_file(directory, *changes))


def test_settings_are_those_of_the_file_in_si(tmp_path: Path) -> None:
    found = screw_settings(stage(tmp_path), "x")
    # sixteen nodes a turn of the screw
    expected = ScrewSettings(-0.006, 0.006, 0.0003125, 2, 0.02, 0.05, 1e-4)
    assert found == pytest.approx(expected)
    own = screw_settings(stage(tmp_path, ("travels = 2", "travels = 9\nstep_mm = 0.5")), "x")
    assert (own.travels, own.step_m, len(nodes_m(own))) == (9, 0.0005, 25)


def test_travel_goes_from_end_to_end_and_back_for_the_given_time(tmp_path: Path) -> None:
    machine = stage(tmp_path)
    steps = screw_steps(machine, "x", [-0.006])
    segments = list(program_segments(steps, machine, [-0.006]))
    command_m = np.concatenate([segment.position_m[:, 0] for segment in segments])
    assert (command_m.min(), command_m.max(), command_m[-1]) == (-0.006, 0.006, -0.006)
    # no rest but at the ends
    assert (np.diff(command_m) == 0.0).sum() <= 3 * 50
    # the last rest belongs to the way down
    duration_s = len(command_m) * machine.period_s
    assert duration_s == pytest.approx(travel_s(screw_settings(machine, "x")) + 0.05, abs=0.01)


def test_approach_to_the_lower_end_comes_first(tmp_path: Path) -> None:
    machine = stage(tmp_path)
    first = screw_steps(machine, "x", [0.001])[0]
    assert first.label == "to the lower end"
    assert len(screw_steps(machine, "x", [0.001])) == len(screw_steps(machine, "x", [-0.006])) + 1


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ([(SECTION, "")], r"axis\.x\.screw_compensation: the section is missing"),
        (
            [("travels = 2", "travels = 2\nstep_mm = 0.002")],
            "6000 nodes over limits.position_mm are more than 5000",
        ),
        ([("limit_um = 100.0", "limit_um = 6000.0")], "leave too short a travel"),
    ],
)
def test_screw_that_cannot_be_learned_is_refused(
    tmp_path: Path, changes: list[tuple[str, str]], reason: str
) -> None:
    with pytest.raises(ConfigError, match=reason):
        screw_settings(stage(tmp_path, *changes), "x")
