"""The machine of the campaign: the X-Y table with short travel and fast heartbeats, read once."""

from __future__ import annotations

import contextlib
import shutil
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import canopen

from hil_sim.config import load_plant
from servo_ctrl.canopen import node as own_node
from servo_ctrl.canopen import plan
from servo_ctrl.canopen.stack import load_eds
from servo_ctrl.config.load import load_machine, load_program
from tests.campaigns.campaign.learning import store_earlier
from tests.campaigns.campaign.patches import patched

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hil_sim.config import PlantConfig
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig

REPOSITORY = Path(__file__).parents[3]
LIMIT_MM, SWITCH_MM = 12.0, 15.0
CONTROLLER = {
    "position_mm = [-100.0, 100.0]": f"position_mm = [-{LIMIT_MM}, {LIMIT_MM}]",
    "heartbeat_ms = 100": "heartbeat_ms = 20",
    "radius_mm = 50.0": "radius_mm = 2.0\ntrailing = false",
    "accelerations_mm_s2 = [2.0, 8.0, 30.0, 120.0]": "accelerations_mm_s2 = [400.0, 500.0, 600.0, 700.0]",
    "jerk_mm_s3 = 50000.0": "jerk_mm_s3 = 500000.0",
    "input_timeout_ms = 2000": "input_timeout_ms = 100",
    "following_error_mm = 1.0": "following_error_mm = 1.0\nsaturation_ms = 60.0",
}
PLANT = {
    "negative_mm = -110.0": f"negative_mm = -{SWITCH_MM}",
    "positive_mm = 110.0": f"positive_mm = {SWITCH_MM}",
    "../../eds": str(REPOSITORY / "eds"),
}
PROGRAM = """
[[step]]
kind = "move"
label = "out"
to_mm = { x = 4.0, y = -3.0 }
feed_mm_min = 6000.0

[[step]]
kind = "circle"
label = "round"
radius_mm = 4.0
feed_mm_min = 4000.0
turns = 2.0
"""


class CampaignMachine(NamedTuple):
    """The files of the machine, as daemon and simulator read them."""

    controller: MachineConfig
    plant: PlantConfig
    program: ProgramConfig
    learned: Path
    """Directory with the results of an earlier learning run."""


def make_machine(folder: Path) -> CampaignMachine:
    """Write the files into `folder` and read them as each side does."""
    source, eds = REPOSITORY / "machines" / "xy_table", folder / "eds"
    shutil.copytree(REPOSITORY / "eds", eds, dirs_exist_ok=True)
    for file, changes in (("controller.toml", CONTROLLER | {"../../eds": str(eds)}), ("plant.toml", PLANT)):
        text = (source / file).read_text(encoding="utf-8")
        for old, new in changes.items():
            assert old in text, old
            text = text.replace(old, new)
        (folder / file).write_text(text, encoding="utf-8")
    (folder / "program.toml").write_text(PROGRAM, encoding="utf-8")
    controller = load_machine(folder)
    program = load_program(folder / "program.toml", controller)
    store_earlier(controller, folder / "learned")
    return CampaignMachine(controller, load_plant(folder), program, folder / "learned")


_LOAD_EDS, _IMPORT_OD = cache(load_eds), cache(canopen.import_od)


def clear_eds_cache() -> None:
    """Clear the cache, so that a changed EDS is read again."""
    _LOAD_EDS.cache_clear()
    _IMPORT_OD.cache_clear()


@contextlib.contextmanager
def parsed_files_cached() -> Iterator[None]:
    """Parse every EDS only once: neither side changes the parsed objects."""
    with patched(
        (plan, "load_eds", _LOAD_EDS), (own_node, "load_eds", _LOAD_EDS), (canopen, "import_od", _IMPORT_OD)
    ):
        yield
