"""For every test: long files begin first, no task is left behind, no property fails for having taken long."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from forked_workers import pytest_addoption, pytest_runtestloop
from hypothesis import HealthCheck, settings

__all__ = ["pytest_addoption", "pytest_runtestloop"]  # hooks of pytest

settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

ROOT = Path(__file__).parents[1]
LONGEST_FIRST = (
    "tests/hil/test_experiments.py",
    "tests/hil/test_learning_lockstep.py",
    "tests/hil/test_friction_experiments.py",
    "tests/browser/test_operator.py",
    "tests/security/test_wheel.py",
    "tests/hil/test_serve_lockstep.py",
    "tests/unit/reconcile/diagnosis/",
    "tests/unit/reconcile/watch/",
    "tests/hil/",
    "tests/campaigns/",
    "tests/unit/reconcile/",
)
"""Files and folders by the time that they take (docs/development.md).

What is not here takes a few seconds a file. It comes at the end, where a long file would keep one processor
waiting for the other.
"""
WAITING, BETWEEN = "tests/browser/", 4
"""The pages' tests wait half of their time: one such file after so many others, which compute meanwhile."""


SLOW_UNITS = """
command_lines/ reconcile/design/ reconcile/diagnosis/ reconcile/examples/ reconcile/fleet/ reconcile/report/
reconcile/replay/ reconcile/watch/ reconcile/identification/test_two_mass
reconcile/identification/test_drift_of_friction reconcile/selection/test_unnamed_selection
servo_canopen/test_remote_controller servo_cli/test_bad_input servo_cli/test_check_and_export
servo_cli/test_part_programs servo_config/test_gcode_text servo_config/test_part_program_blocks
servo_daemon/test_compensation servo_daemon/test_feed_hold servo_daemon/test_learning_job
servo_daemon/test_screw_learning servo_hmi/test_diagnosis_whole servo_learning/test_fast
servo_learning/test_schedule servo_report/ studies/ kernels/test_kernel_caches local_can/test_hub
hil_sim_drive/test_state_machine hil_sim_drive/test_polarity hil_sim_drive/test_homing_methods
hil_sim_runner/test_bench_against_any_frame servo_telemetry/test_mqtt_broker_trouble
servo_telemetry/test_mqtt_link servo_daemon/test_page_process eds/test_eds_against_profile_tables
local_can/test_localcan_bus servo_canopen/test_sdo_server
"""
SLOW = tuple(f"tests/unit/{beginning}" for beginning in SLOW_UNITS.split())
"""Unit tests of many seconds: whole diagnoses, whole commands, studies, long properties; marked `slow`."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files in the order in which workers take them."""
    paths = {item: item.path.relative_to(ROOT).as_posix() for item in items}
    last = len(LONGEST_FIRST)

    def rank(path: str) -> int:
        return next((i for i in range(last) if path.startswith(LONGEST_FIRST[i])), last)

    files = sorted(dict.fromkeys(paths.values()), key=rank)
    places = {path: float(place) for place, path in enumerate(f for f in files if not waits(f))}
    places |= {path: (n + 0.5) * BETWEEN for n, path in enumerate(filter(waits, files))}
    items.sort(key=lambda item: places[paths[item]])
    for item in items:
        if paths[item].startswith(SLOW):
            item.add_marker(pytest.mark.slow)


def waits(path: str) -> bool:
    """Whether a file's tests mostly wait."""
    return path.startswith(WAITING)


@pytest_asyncio.fixture
async def leaked_tasks() -> AsyncIterator[None]:
    """Fails when tasks of the test outlive it."""
    yield
    left = [task for task in asyncio.all_tasks() if task is not asyncio.current_task() and not task.done()]
    assert not left, f"leaked tasks: {left}"


@pytest.fixture(autouse=True)
def guarded(request: pytest.FixtureRequest) -> None:
    """Puts `leaked_tasks` around every async test."""
    if request.node.get_closest_marker("asyncio") is not None:
        request.getfixturevalue("leaked_tasks")
