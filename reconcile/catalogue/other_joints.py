"""The other joints of a robot, by number, as the shape parameters of a term that follows one of them."""

from collections.abc import Sequence

import numpy as np

from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, PlantValues
from reconcile.catalogue.gravity import LEAST_RANGE_RAD, range_rad
from reconcile.catalogue.kinds import RegressionData


def moved_joints(datasets: Sequence[RegressionData]) -> list[float]:
    """Numbers of the joints that every recording has and that turn far in one; none beside a linear axis."""
    if not datasets or range_rad(datasets) == 0.0:
        return []
    names = [sorted(data.others) for data in datasets]
    if any(own != names[0] for own in names):
        return []
    return [
        float(number)
        for number, name in enumerate(names[0])
        if max(float(np.ptp(data.others[name].position_m)) for data in datasets) >= LEAST_RANGE_RAD
    ]


def name_of_joint(data: RegressionData, number: float) -> str:
    """Name of a joint by its number."""
    return sorted(data.others)[int(number)]


def with_name_of_joint(found: IdentifiedTerms, _notes: list[str]) -> PlantValues:
    """Parameters of a plant's effect: those of the term, with the other joint by its name."""
    values = found.terms[0]
    return {**values, "other": name_of_joint(found.datasets[0], values["other"])}


def number_of_joint(of: ModelEffect) -> float | None:
    """Number of the joint that an effect of a plant follows; None where it was not recorded."""
    names = sorted(of.datasets[0].others)
    return float(names.index(of.other)) if of.other in names else None
