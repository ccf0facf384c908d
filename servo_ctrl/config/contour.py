"""Converts `[contour_control]` to the coupling of the cycle, and refuses gains without a stability margin.

A gain that was accepted on a plant that nobody has measured is used, and noted.
"""

import math
from collections.abc import Sequence
from itertools import product

from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.kernel_params import axis_params, with_observer
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.config.plant_of_axis import frequencies_hz, plant_of_axis, unused_structures
from servo_ctrl.control.compensation.disturbance_observer import DisturbanceObserverSettings
from servo_ctrl.control.compensation.fuzzy_pd import FuzzyPdSettings
from servo_ctrl.control.contour_control import Params
from servo_ctrl.control.contour_margin import coupled_sensitivity_peak
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.contour_coupling import Coupling
from servo_ctrl.units import MM

SENSITIVITY_PEAK_MAX = 2.0
"""Largest Ms of the coupled axes on their plants: gain margin 2, phase margin 29 degrees (Astrom and
Hagglund, Advanced PID Control, section 4.6)."""


def couplings(machine: MachineConfig) -> tuple[Coupling, ...]:
    """Return the couplings of a machine; none where contour control is off."""
    section = machine.contour_control
    if section is None or not section.enabled:
        return ()
    first, second = (list(machine.axes).index(name) for name in section.axes)
    return (Coupling(first, second, _contour_params(section, machine.period_s)),)


def contour_objection(machine: MachineConfig) -> str:
    """Return why contour control cannot act on this machine, with the key; "" if it can or is off."""
    section = machine.contour_control
    if section is None or not section.enabled:
        return ""
    names = section.axes
    if names[0] == names[1] or not set(names) <= set(machine.axes):
        return f"axes: expected two of {', '.join(machine.axes)}, not {names[0]} and {names[1]}"
    for name in names:
        if objection := _margin_objection(name, machine.axes[name]):
            return objection
    peak = sensitivity_peak_of(machine, section)
    if round(peak, 2) <= SENSITIVITY_PEAK_MAX:  # as the message would show it
        return ""
    gain, limit, plants = f"{section.kp_1_s:g}", f"{SENSITIVITY_PEAK_MAX:g}", _plants_of(machine, names)
    if peak == math.inf:
        return f"kp_1_s: with {gain} 1/s the two axes are unstable on {plants}"
    return f"kp_1_s: with {gain} 1/s Ms of the two axes is {peak:.2f}, above {limit}, on {plants}"


def contour_note(machine: MachineConfig) -> str:
    """Return that an accepted gain has a margin on rigid masses only, and what to do; "" where it has not."""
    section = machine.contour_control
    if section is None or not section.enabled or not (rigid := _not_measured(machine, section.axes)):
        return ""
    return (
        f"contour_control: kp_1_s was accepted on {_plants_of(machine, section.axes)}; "
        f"the margin lacks resonances and delay of {', '.join(rigid)}: "
        "servo-ctrl tune --axis NAME --apply measures them"
    )


def _not_measured(machine: MachineConfig, names: Sequence[str]) -> list[str]:
    return [name for name in names if machine.axes[name].measured_plant is None]


def _plants_of(machine: MachineConfig, names: Sequence[str]) -> str:
    """Return what a margin was computed on, and the known structures that are not in it."""
    rigid = _not_measured(machine, names)
    if not rigid:
        return "their measured plants"
    plants = "their masses"
    if len(rigid) < len(names):
        (measured,) = set(names) - set(rigid)
        plants = f"the measured plant of {measured} and the mass of {rigid[0]}"
    unused = [text for name in names for text in unused_structures(machine, name)]
    if not unused:
        return plants
    return f"{plants}, without the structure at {' and '.join(unused)}, which is not measured"


def _margin_objection(name: str, axis: AxisConfig) -> str:
    """Return why no margin can be computed for the loops of an axis, else ""."""
    if axis.mode != "cst":
        return f"axes: axis {name} is in {axis.mode}, only in cst both of its loops are closed here"
    if axis.acts(FuzzyPdSettings):
        return f"axes: axis {name} has fuzzy_pd, whose gain is not one number"
    if axis.measured_plant is None and axis.control.acceleration_feedforward_kg == 0.0:
        return f"axes: axis {name} needs its mass, control.acceleration_feedforward_kg"
    return ""


def sensitivity_peak_of(machine: MachineConfig, section: ContourControl) -> float:
    """Return Ms of the coupled axes of a machine on their plants (`plant_of_axis`).

    The operator may switch an observer at any time, so this is the largest Ms with and without it.
    """
    contour = _contour_params(section, machine.period_s)
    frequency_hz = frequencies_hz(machine, section.axes)
    plants = [plant_of_axis(machine, name, frequency_hz) for name in section.axes]
    first, second = (possible_params(machine, name) for name in section.axes)
    return max(coupled_sensitivity_peak(contour, x, y, *plants) for x, y in product(first, second))


def possible_params(machine: MachineConfig, name: str) -> list[AxisParams]:
    """Return the parameter sets that an axis may have while it is coupled."""
    params = axis_params(machine, name)
    if machine.axes[name].section(DisturbanceObserverSettings) is None:
        return [params]
    return [with_observer(params, enabled=on) for on in (False, True)]


def _contour_params(section: ContourControl, period_s: float) -> Params:
    return Params(
        kp_1_s=float(section.kp_1_s),
        ki_1_s2=float(section.ki_1_s2),
        limit_m_s=float(section.limit_mm_s) * MM,
        full_speed_m_s=float(section.full_speed_mm_s) * MM,
        period_s=float(period_s),
    )
