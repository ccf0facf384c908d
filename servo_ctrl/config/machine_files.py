"""Writes the two files of a new machine from the data sheets of its axes.

The controller reads `controller.toml`; `hil-sim` simulates the machine from `plant.toml`, with guessed
friction. Both have comments, because the user edits them.
"""

from collections.abc import Sequence
from typing import NamedTuple

from servo_ctrl.config.machine_sheet import AxisSheet

VELOCITY_BANDWIDTH_1_S, INTEGRAL_1_S2, POSITION_GAIN_1_S = 210.0, 7500.0, 38.7
"""Gains of the X-Y table of Feng et al. 2015 by moving mass: kv = 210 m, ki = 7500 m, kp = 38.7 1/s."""
JERK_PER_ACCELERATION_1_S = 25.0
"""Jerk limit as a multiple of the acceleration limit: the acceleration rises in 40 ms; chosen."""
LEARNING_RADIUS_MM, LEARNING_MM_S2 = 50.0, (2.0, 8.0, 30.0, 120.0)
"""Amplitude and reverse accelerations of the learning strokes: the defaults of `LearningConfig`."""
SWITCH_MARGIN_SHARE = 0.05
"""Distance of the simulated limit switches beyond the travel, as a share of it; chosen."""


class EdsNames(NamedTuple):
    """Names of the EDS files in eds/ beside the machine file."""

    drive: str = "servo_drive.eds"
    scale: str = "linear_scale.eds"


def controller_text(name: str, axes: Sequence[AxisSheet], eds: EdsNames) -> str:
    """Return the text of controller.toml, whose EDS files are in eds/ beside it."""
    return "\n".join(
        [_CONTROLLER.format(name=name), *(_axis_of_controller(axis, eds) for axis in axes), _learning(axes)]
    )


def plant_text(name: str, axes: Sequence[AxisSheet], eds: EdsNames) -> str:
    """Return the text of plant.toml, which only the simulator reads."""
    return "\n".join([_PLANT.format(name=name), *(_axis_of_plant(axis, eds) for axis in axes)])


def _axis_of_controller(axis: AxisSheet, eds: EdsNames) -> str:
    mass_kg = axis.moving_mass_kg
    low_mm, high_mm = axis.travel_mm
    values = axis._asdict() | {
        "drive_eds": eds.drive,
        "mass": f"{mass_kg:.1f}",
        "low": low_mm,
        "high": high_mm,
        "jerk": f"{JERK_PER_ACCELERATION_1_S * axis.acceleration_mm_s2:.1f}",
        "feedback": "scale" if axis.scale else "motor",
        "kp": POSITION_GAIN_1_S,
        "kv": f"{VELOCITY_BANDWIDTH_1_S * mass_kg:.0f}.0",
        "ki": f"{INTEGRAL_1_S2 * mass_kg:.0f}.0",
        "scale_section": _SCALE_OF_CONTROLLER.format(scale_eds=eds.scale, **axis._asdict())
        if axis.scale
        else "",
    }
    return _AXIS_OF_CONTROLLER.format(**values)


def _axis_of_plant(axis: AxisSheet, eds: EdsNames) -> str:
    low_mm, high_mm = axis.travel_mm
    margin_mm = SWITCH_MARGIN_SHARE * (high_mm - low_mm)
    mass_kg = axis.moving_mass_kg
    values = axis._asdict() | {
        "drive_eds": eds.drive,
        "peak": f"{axis.peak_current_a:.2f}",
        "negative": f"{low_mm - margin_mm:.1f}",
        "positive": f"{high_mm + margin_mm:.1f}",
        "kp": POSITION_GAIN_1_S,
        "kv": f"{VELOCITY_BANDWIDTH_1_S * mass_kg:.0f}.0",
        "ki": f"{INTEGRAL_1_S2 * mass_kg:.0f}.0",
        "scale_section": _SCALE_OF_PLANT.format(scale_eds=eds.scale, **axis._asdict()) if axis.scale else "",
    }
    return _AXIS_OF_PLANT.format(**values)


def _learning(axes: Sequence[AxisSheet]) -> str:
    """Return the sections [monitoring] and [learning], with strokes within travels and limits."""
    nearest_end_mm = min(min(-axis.travel_mm[0], axis.travel_mm[1]) for axis in axes)
    radius_mm = min(LEARNING_RADIUS_MM, 0.5 * nearest_end_mm)
    if radius_mm <= 0.0:  # home is at an end of the travel, so strokes around it do not fit
        return _NO_LEARNING
    allowed = [
        a
        for a in LEARNING_MM_S2
        if all(a <= axis.acceleration_mm_s2 and a * radius_mm <= axis.velocity_mm_s**2 for axis in axes)
    ]
    return _LEARNING.format(radius=f"{radius_mm:.1f}", accelerations=allowed or [axes[0].acceleration_mm_s2])


_CONTROLLER = """\
# What the controller knows about the machine. Every key: docs/machines.md.
[machine]
name = "{name}"

[bus]
sync_period_us = 1000            # one SYNC a millisecond
input_timeout_ms = 2000          # in lockstep: longest wait for the inputs

[controller]
node_id = 127
eds = "eds/servo_ctrl.eds"
heartbeat_ms = 100
"""
_AXIS_OF_CONTROLLER = """\
[axis.{name}]
mode = "cst"                     # the controller closes the loops; drives follow a torque
homing_method = 37               # home is where the axis stands; a switch or mark: 1 to 35 (CiA 402)

[axis.{name}.drive]
node_id = {drive}
eds = "eds/{drive_eds}"
rpdo1 = ["controlword", "modes_of_operation", "target_torque", "torque_offset"]
tpdo1 = ["statusword", "position_actual_value", "current_actual_value"]
rpdo_transmission_type = 1
tpdo_transmission_type = 1
limit_switch_syncs = 10          # period of the limit switch TPDO: longest delay of a switch
counts_per_rev = {counts_per_rev}
rated_torque_mnm = {rated_torque_mnm}
rated_current_ma = {rated_current_ma}
torque_constant_nm_a = {torque_constant_nm_a}
{scale_section}
[axis.{name}.transmission]
lead_mm = {lead_mm}

[axis.{name}.limits]
position_mm = [{low}, {high}]
velocity_mm_s = {velocity_mm_s}
acceleration_mm_s2 = {acceleration_mm_s2}
jerk_mm_s3 = {jerk}
force_n = {force_n}
following_error_mm = 1.0         # beyond it the machine stops

[axis.{name}.control]
feedback = "{feedback}"
kp_1_s = {kp}                    # position loop
kv_n_s_m = {kv}                  # velocity loop: 210 1/s times the moving mass of {mass} kg
ki_n_m = {ki}
velocity_feedforward = 1.0
acceleration_feedforward_kg = {mass}
velocity_window_samples = 1
velocity_filter_ms = 0.0

[axis.{name}.friction_compensation]
rise_ms = 20.0
acceleration_allowed_mm_s2 = 100.0

[axis.{name}.disturbance_observer]
enabled = false
bandwidth_hz = 7.5
mass_kg = {mass}
"""
_SCALE_OF_CONTROLLER = """
[axis.{name}.scale]
node_id = {scale}
eds = "eds/{scale_eds}"
tpdo1 = ["position_value"]
resolution_um = 0.1
"""
_LEARNING = """\
[monitoring]
window_s = 0.194                 # J is the mean absolute error over this time after a reversal
required_um = 4.0                # learning is due above this J

[learning]
learner = "fast"
radius_mm = {radius}             # the strokes stay within this distance of home
accelerations_mm_s2 = {accelerations}
"""
_NO_LEARNING = """\
[monitoring]
window_s = 0.194                 # J is the mean absolute error over this time after a reversal
# no [learning]: home lies at an end of a travel, so that strokes about it do not fit
"""
_PLANT = """\
# The machine as hil-sim simulates it; the controller never reads this file. Every key: docs/plant.md.
# Friction and stiffness are guesses: record the real machine and let `reconcile diagnose` correct them.
[plant]
name = "{name}"
substep_us = 50.0
"""
_AXIS_OF_PLANT = """\
[axis.{name}.drive]
node_id = {drive}
eds = "eds/{drive_eds}"
{scale_section}
[axis.{name}.motor]
rated_torque_mnm = {rated_torque_mnm}
rated_current_ma = {rated_current_ma}
torque_constant_nm_a = {torque_constant_nm_a}
inertia_kg_cm2 = {inertia_kg_cm2}  # rotor, coupling and screw

[axis.{name}.amplifier]
current_bandwidth_hz = 1000.0
voltage_limit_v = 325.0
peak_current_a = {peak}          # what the force limit takes, with a reserve
position_gain_1_s = {kp}
velocity_gain_n_s_m = {kv}
velocity_integral_n_m = {ki}
velocity_feedforward = 1.0
velocity_filter_hz = 1000.0

[axis.{name}.transmission]
lead_mm = {lead_mm}

[axis.{name}.drive_compliance]
stiffness_n_um = 120.0           # a guess
damping_n_s_m = 3000.0

[axis.{name}.table]
mass_kg = {mass_kg}

[axis.{name}.encoder]
counts_per_rev = {counts_per_rev}
index_mm = 1.3

[axis.{name}.limit_switches]
negative_mm = {negative}
positive_mm = {positive}

[axis.{name}.viscous_friction]
viscous_n_s_m = 40.0             # a guess

[axis.{name}.coulomb_friction]
coulomb_n = 8.0                  # a guess
"""
_SCALE_OF_PLANT = """
[axis.{name}.scale]
node_id = {scale}
eds = "eds/{scale_eds}"
resolution_um = 0.1
reference_mark_mm = 0.0
"""
