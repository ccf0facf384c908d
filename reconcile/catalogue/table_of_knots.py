"""Converts between tables of a plant and smooth terms: both are linear between evenly spaced knots."""

from collections.abc import Mapping
from types import ModuleType
from typing import NamedTuple

import numpy as np

from hil_sim.physics.friction import force_over_speed, friction_over_speed, friction_table
from hil_sim.physics.load import change_along_travel, drift_over_time, force_table
from kernels.arrays import Array
from kernels.quantities import section_of
from reconcile.catalogue.conversion import ModelEffect, ModelTerm, PlantValues

WITH_MEAN = 1.0
"""Fourth shape parameter of a smooth term with a mean, as a plant's table."""


def place_in_knots(values: Array, low: float, high: float, count: int) -> Array:
    """Places (n,) of values among evenly spaced knots, 0 to `count` - 1; beyond them, that of the nearest."""
    place: Array = np.clip((values - low) / max(high - low, 1e-300), 0.0, 1.0) * (count - 1)
    return place


class TableOfKnots(NamedTuple):
    """The table of a plant that equals a smooth term over one coordinate."""

    physics: ModuleType
    unit: str
    """Unit of the coordinate, at the end of the names of the first and the last point."""
    heights: str
    sign: float = 1.0
    """-1 of a force on the table: the motor needs the opposite."""

    @property
    def section(self) -> str:
        """The effect's name."""
        return section_of(self.physics)

    def to_plant(self, p: Mapping[str, float]) -> PlantValues:
        """Return the table with the knots and heights of a smooth term's parameters."""
        places = [value for key, value in p.items() if key.startswith("at_")]
        heights = [self.sign * value for key, value in p.items() if key.startswith("height_")]
        return {
            f"first_{self.unit}": places[0],
            f"last_{self.unit}": places[-1],
            "points": float(len(places)),
            self.heights: heights,
        }

    def from_plant(self, of: ModelEffect, name: str) -> ModelTerm:
        """Return the smooth term of this name with the table's points as knots."""
        first, last = (getattr(of.params, f"{end}_{self.unit}") for end in ("first", "last"))
        count = int(of.params.points)
        heights = np.array(getattr(of.params, self.heights)[:count]) * self.sign
        rises = np.diff(heights, prepend=0.0)
        return ModelTerm(name, (first, last, float(count), WITH_MEAN), tuple(rises.tolist()))


TABLES = {
    "position": TableOfKnots(force_table, "m", "force_n", sign=-1.0),
    "position_by_direction": TableOfKnots(friction_table, "m", "level_n"),
    "velocity": TableOfKnots(force_over_speed, "m_s", "force_n"),
    "speed_by_direction": TableOfKnots(friction_over_speed, "m_s", "level_n"),
    "position_of_the_damping": TableOfKnots(change_along_travel, "m", "damping_n_s_m"),
    "position_of_the_mass": TableOfKnots(change_along_travel, "m", "mass_kg"),
    "run_time": TableOfKnots(drift_over_time, "s", "force_n", sign=-1.0),
    "run_time_by_direction": TableOfKnots(drift_over_time, "s", "level_n"),
    "run_time_of_the_damping": TableOfKnots(drift_over_time, "s", "damping_n_s_m"),
    "run_time_of_the_mass": TableOfKnots(drift_over_time, "s", "mass_kg"),
}
"""Tables by the coordinate of the smooth term."""


def tables_of(section: str) -> dict[str, TableOfKnots]:
    """Return the tables of one section of a plant file, by coordinate."""
    return {name: table for name, table in TABLES.items() if table.section == section}
