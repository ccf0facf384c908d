"""Converts `[contour_control]` to the coupling of the cycle, and refuses one without a margin."""

import math
from itertools import product

from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.freeze import axis_params, with_observer
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.control.compensation.disturbance_observer import DisturbanceObserverSettings
from servo_ctrl.control.compensation.fuzzy_pd import FuzzyPdSettings
from servo_ctrl.control.contour_control import Params
from servo_ctrl.control.contour_margin import coupled_sensitivity_peak
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.contour_coupling import Coupling
from servo_ctrl.units import MM

MOST_SENSITIVITY = 2.0
"""Largest Ms of the coupled axes on their rigid masses: gain margin 2, phase margin 29 degrees (Astrom and
Hagglund, Advanced PID Control, section 4.6)."""


def couplings(machine: MachineConfig) -> tuple[Coupling, ...]:
    """Return the coupled axes of a machine; none where contour control is off."""
    wanted = machine.contour_control
    if wanted is None or not wanted.enabled:
        return ()
    first, second = (list(machine.axes).index(name) for name in wanted.axes)
    return (Coupling(first, second, _params(wanted, machine.period_s)),)


def contour_objection(machine: MachineConfig) -> str:
    """Return why contour control cannot act on this machine, with the key; "" if it can or is off."""
    wanted = machine.contour_control
    if wanted is None or not wanted.enabled:
        return ""
    names = wanted.axes
    if names[0] == names[1] or not set(names) <= set(machine.axes):
        return f"axes: two of {', '.join(machine.axes)} are wanted, not {names[0]} and {names[1]}"
    for name in names:
        if lacking := _lacking(name, machine.axes[name]):
            return lacking
    peak = sensitivity_peak_of(machine, wanted)
    if peak <= MOST_SENSITIVITY:
        return ""
    gain, most = f"{wanted.kp_1_s:g}", f"{MOST_SENSITIVITY:g}"
    if peak == math.inf:
        return f"kp_1_s: with {gain} 1/s the two axes are unstable on their masses"
    return f"kp_1_s: with {gain} 1/s Ms of the two axes is {peak:.2f} on their masses, above {most}"


def _lacking(name: str, axis: AxisConfig) -> str:
    """Return why the loops of an axis have no margin that could be computed, else ""."""
    if axis.mode != "cst":
        return f"axes: axis {name} is in {axis.mode}, only in cst both of its loops are closed here"
    if axis.acts(FuzzyPdSettings):
        return f"axes: axis {name} has fuzzy_pd, whose gain is not one number"
    if axis.control.acceleration_feedforward_kg == 0.0:
        return f"axes: axis {name} needs its mass, control.acceleration_feedforward_kg"
    return ""


def sensitivity_peak_of(machine: MachineConfig, wanted: ContourControl) -> float:
    """Return Ms of the coupled axes of a machine on the masses of their acceleration feedforward.

    An observer that the file has may be switched at any time: the largest Ms with it and without it.
    """
    contour = _params(wanted, machine.period_s)
    first, second = (_laws(machine, name) for name in wanted.axes)
    return max(
        coupled_sensitivity_peak(contour, x, y, x.feedforward.acceleration_kg, y.feedforward.acceleration_kg)
        for x, y in product(first, second)
    )


def _laws(machine: MachineConfig, name: str) -> list[AxisParams]:
    """Return the laws that an axis may have while it is coupled."""
    own = axis_params(machine, name)
    if machine.axes[name].section(DisturbanceObserverSettings) is None:
        return [own]
    return [with_observer(own, enabled=on) for on in (False, True)]


def _params(wanted: ContourControl, period_s: float) -> Params:
    return Params(
        kp_1_s=float(wanted.kp_1_s),
        ki_1_s2=float(wanted.ki_1_s2),
        limit_m_s=float(wanted.limit_mm_s) * MM,
        full_speed_m_s=float(wanted.full_speed_mm_s) * MM,
        period_s=float(period_s),
    )
