"""Read the plant of a machine for the twin, with the errors of the controller's side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import hil_sim.config
from servo_ctrl.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path

    from hil_sim.config import PlantConfig


def load_plant(path: Path) -> PlantConfig:
    """Read a plant file, or the plant.toml of a directory. Raises servo_ctrl's ConfigError."""
    try:
        return hil_sim.config.load_plant(path)
    except hil_sim.config.ConfigError as error:
        raise ConfigError(error.file, error.key, error.reason) from None
