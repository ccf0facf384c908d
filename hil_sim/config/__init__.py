"""The simulator's machine file: `load_plant` reads it, `build_plant` builds the plant's records.

Only the schema, its checks and the generated tables of docs/plant.md may enter.
"""

from hil_sim.config.build import Plant, build_plant
from hil_sim.config.load import ConfigError, load_plant
from hil_sim.config.model import AxisPlant, PlantConfig, TemperatureProbe

__all__ = [
    "AxisPlant",
    "ConfigError",
    "Plant",
    "PlantConfig",
    "TemperatureProbe",
    "build_plant",
    "load_plant",
]
