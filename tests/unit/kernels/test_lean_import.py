"""A library is imported without an optional package, which can be imported afterwards all the same."""

import subprocess
import sys

import pytest

OPTIONAL = "asammdf"


@pytest.mark.parametrize(
    "module", ["hil_sim.runner.process", "servo_ctrl.io.can_port", "servo_ctrl.canopen.stack"]
)
def test_processes_on_the_bus_load_no_reader_of_measurement_files(module: str) -> None:
    code = (
        f"import importlib.util, sys, {module}; "
        f"assert 'can' in sys.modules; assert not {{'{OPTIONAL}', 'pandas'}} & set(sys.modules); "
        f"assert importlib.util.find_spec('{OPTIONAL}')"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("module", ["hil_sim.runner.process", "servo_ctrl.daemon.run.supervisor"])
def test_simulator_and_controller_start_without_scipy(module: str) -> None:
    """Loading it would take each start 0.3 s more."""
    code = f"import sys, {module}; assert 'numba' in sys.modules; assert 'scipy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
