"""Each worked example of docs/development.md is applied to a copy of the tree, and runs there."""

from pathlib import Path

import pytest
from scratch_copy import run_tests, scratch_copy

EXAMPLES = Path(__file__).parent / "worked_examples"
TOUCHED = {
    "new_compensation": {
        "docs/machines.md",
        "servo_ctrl/control/compensation/load_compensation.py",
        "servo_ctrl/control/tick.py",
    },
    "new_effect": {
        "docs/plant.md",
        "hil_sim/physics/friction/eddy_current_brake.py",
        "reconcile/catalogue/eddy_current_brake.py",
    },
    "new_drive_object": {"servo_ctrl/canopen/settings.py"},
    "new_fault_event": {"docs/fault_policy.md", "hil_sim/faults/demagnetised_motor.py"},
    "new_status_field": {
        "servo_ctrl/commands/axis_status.py",
        "servo_ctrl/daemon/handlers/command_handler.py",
    },
}


@pytest.mark.parametrize("name", sorted(TOUCHED))
def test_an_example_touches_the_files_it_states_and_works(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "tree"
    assert set(scratch_copy(EXAMPLES / name, folder)) == TOUCHED[name]
    run_tests(EXAMPLES / name, folder)
