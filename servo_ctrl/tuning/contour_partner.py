"""The axis that contour control couples to the tuned one, and Ms of both.

The tuned axis has its measured plant. Of the other one the machine file tells the gains and the mass: its
plant is that mass, rigid, with the one period until a set point acts. An observer of either axis may be
switched at any time, so Ms is the largest with and without it.
"""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from servo_ctrl.config.contour import couplings, possible_params
from servo_ctrl.config.kernel_params import with_observer
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.contour_control import Params
from servo_ctrl.control.contour_margin import CoupledLoop, contour_law, pair_sensitivity_peak, rigid_loop
from servo_ctrl.control.loop_margins import Response
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.tuning.loop import Plant, coupled_loop_of


class PairMargin(NamedTuple):
    """The partner and the coupling on the grid of a plant, (n,) each."""

    plant: Plant
    """Of the tuned axis."""
    observers: tuple[bool, ...]
    """States that the observer of the tuned axis may have."""
    partners: tuple[CoupledLoop, ...]
    law: Response

    def sensitivity_peak(self, params: AxisParams) -> float:
        """Return Ms of both axes with these gains, which alone are stable; infinite where both are not."""
        tuned = [coupled_loop_of(with_observer(params, enabled=on), self.plant) for on in self.observers]
        if not all(_stays_stable(tuned[0], other) for other in tuned[1:]):
            return math.inf
        pairs = product(tuned, self.partners)
        return max(pair_sensitivity_peak(pair, self.law) for pair in pairs)

    def of_partner(self) -> float:
        """Return the partner's own Ms along and beside the path, which no gain of the tuned axis lowers."""
        loops = [one.loop + share * one.per_gain for one in self.partners for share in (0.0, self.law)]
        return max(float(np.max(1.0 / np.abs(1.0 + loop))) for loop in loops)


class ContourPartner(NamedTuple):
    """An axis that is coupled to the tuned one."""

    name: str
    laws: tuple[AxisParams, ...]
    """With and without its observer."""
    contour: Params
    observers: tuple[bool, ...]
    """States that the observer of the tuned axis may have, off first."""

    def on(self, plant: Plant) -> PairMargin:
        """Return what the tuned axis with this plant meets."""
        hz = plant.frequency_hz
        loops = [rigid_loop(law, law.feedforward.acceleration_kg, hz) for law in self.laws]
        return PairMargin(plant, self.observers, tuple(loops), contour_law(self.contour, hz))


def partner_of(machine: MachineConfig, axis: str) -> ContourPartner | None:
    """Return the axis that contour control couples to this one; None where it is not coupled."""
    names = list(machine.axes)
    for coupling in couplings(machine):
        pair = names[coupling.first], names[coupling.second]
        if axis in pair:
            other = pair[1 - pair.index(axis)]
            observers = (False, True)[: len(possible_params(machine, axis))]
            return ContourPartner(other, tuple(possible_params(machine, other)), coupling.law, observers)
    return None


def _stays_stable(alone: CoupledLoop, observed: CoupledLoop) -> bool:
    """Whether the observer leaves a stable loop stable: the quotient of the two does not go round 0."""
    around = (1.0 + observed.loop) / (1.0 + alone.loop) * (alone.per_gain / observed.per_gain)
    return bool(abs(np.unwrap(np.angle(around))[-1]) <= 0.5 * math.pi)
