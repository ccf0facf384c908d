"""Reads the plant of a machine for the twin, with the error types of servo_ctrl."""

from pathlib import Path

import hil_sim.config
from hil_sim.config import PlantConfig
from servo_ctrl.errors import ConfigError


def load_plant(path: Path) -> PlantConfig:
    """Read a plant file, or the plant.toml of a directory.

    Raises ConfigError of servo_ctrl: the file cannot be read, or a key is unknown, missing or out of bounds.
    """
    try:
        return hil_sim.config.load_plant(path)
    except hil_sim.config.ConfigError as error:
        raise ConfigError(error.file, error.key, error.reason) from None
