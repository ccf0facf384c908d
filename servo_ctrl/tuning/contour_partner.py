"""The axis that contour control couples to the tuned one, and Ms of both.

The tuned axis has its measured plant, the other one that of the machine file (`config.plant_of_axis`): what
an earlier tuning measured, or its mass, rigid. An observer of either axis may be switched at any time, so Ms
is the largest with and without it.
"""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from servo_ctrl.config.contour import couplings, possible_params
from servo_ctrl.config.kernel_params import with_observer
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.plant_of_axis import measured_model, plant_of_axis
from servo_ctrl.control.axis_loop import CoupledLoop, Plant, Response, coupled_loop_of
from servo_ctrl.control.contour_control import Params
from servo_ctrl.control.contour_margin import (
    contour_integrators,
    contour_law,
    pair_sensitivity_peak,
    stays_stable,
)
from servo_ctrl.control.modal_model import ModalModel
from servo_ctrl.control.tick import AxisParams


class PairMargin(NamedTuple):
    """The partner and the coupling on the grid of a plant, (n,) each."""

    plant: Plant
    """Of the tuned axis."""
    observers: tuple[bool, ...]
    """States that the observer of the tuned axis may have."""
    partners: tuple[CoupledLoop, ...]
    law: Response
    integrators: int
    """Of the law."""

    def sensitivity_peak(self, params: AxisParams) -> float:
        """Return Ms of both axes with these gains, which alone are stable; infinite where both are not."""
        tuned = [coupled_loop_of(with_observer(params, enabled=on), self.plant) for on in self.observers]
        if not all(stays_stable(tuned[0], other) for other in tuned[1:]):
            return math.inf
        pairs = product(tuned, self.partners)
        return max(pair_sensitivity_peak(pair, self.law, self.integrators) for pair in pairs)

    def of_partner(self) -> float:
        """Return the partner's own Ms along and beside the path, which no gain of the tuned axis lowers."""
        loops = [one.loop + share * one.per_gain for one in self.partners for share in (0.0, self.law)]
        return max(float(np.max(1.0 / np.abs(1.0 + loop))) for loop in loops)


class ContourPartner(NamedTuple):
    """An axis that is coupled to the tuned one."""

    machine: MachineConfig
    name: str
    laws: tuple[AxisParams, ...]
    """With and without its observer."""
    contour: Params
    observers: tuple[bool, ...]
    """States that the observer of the tuned axis may have, off first."""

    @property
    def measured(self) -> tuple[ModalModel, ...]:
        """Its plant as an earlier tuning has measured it; empty where the machine file lacks it."""
        model = measured_model(self.machine, self.name)
        return () if model is None else (model,)

    def on(self, plant: Plant) -> PairMargin:
        """Return what the tuned axis with this plant meets, whose grid resolves the modes of `measured`."""
        hz, integrators = plant.frequency_hz, contour_integrators(self.contour)
        own = plant_of_axis(self.machine, self.name, hz)
        loops = tuple(coupled_loop_of(law, own) for law in self.laws)
        return PairMargin(plant, self.observers, loops, contour_law(self.contour, hz), integrators)


def partner_of(machine: MachineConfig, axis: str) -> ContourPartner | None:
    """Return the axis that contour control couples to this one; None where it is not coupled."""
    names = list(machine.axes)
    for coupling in couplings(machine):
        pair = names[coupling.first], names[coupling.second]
        if axis in pair:
            other = pair[1 - pair.index(axis)]
            observers = (False, True)[: len(possible_params(machine, axis))]
            return ContourPartner(
                machine, other, tuple(possible_params(machine, other)), coupling.law, observers
            )
    return None
