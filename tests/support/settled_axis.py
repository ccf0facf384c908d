"""An axis of the X-Y table, led at rest, and its last row by channel name."""

from servo_ctrl.axis.drive import SETTLING_CYCLES
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.recording.channels import AXIS_CHANNELS

DISABLED, ENABLED, FAULT = 0x0240, 0x0227, 0x0208
HOMED = 0x1400
COUNT_M = 0.010 / 2**20
SCALE_COUNT_M = 1e-7
CSV = {
    'mode = "cst"': 'mode = "csv"',
    '"target_torque", "torque_offset"': '"target_velocity"',
    "acceleration_feedforward_kg = ": "acceleration_feedforward_kg = 0.0 # ",
}
CSP = CSV | {
    'mode = "cst"': 'mode = "csp"',
    '"target_torque", "torque_offset"': '"target_position"',
    "velocity_feedforward = ": "velocity_feedforward = 0.0 # ",
}
ROW = [channel.name for channel in AXIS_CHANNELS]


def settle(servo: AxisServo, counts: int = 0, scale: int = 0) -> None:
    """Lead the axis at rest at these counts until it is ready."""
    for _ in range(2):
        servo.step((DISABLED, counts, 0), (scale,), None)
    for _ in range(SETTLING_CYCLES + 2):
        servo.step((ENABLED, counts, 0), (scale,), None)
    assert servo.ready
    servo.events.clear()


def values(servo: AxisServo) -> dict[str, float]:
    """The last row by channel name."""
    return dict(zip(ROW, servo.row, strict=True))
