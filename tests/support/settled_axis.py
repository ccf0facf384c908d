"""One axis of the X-Y table, stepped alone by the compiled cycle: settling, and the last row by name."""

from collections.abc import Callable, Sequence

from servo_ctrl.axis.axis_parts import axis_parts
from servo_ctrl.axis.axis_watch import AxisEvent
from servo_ctrl.axis.cycle_memory import CycleMemory
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.cyclic.sequence import SETTLING_CYCLES
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


class SteppedAxis(AxisServo):
    """Axis x of a machine alone: its drive is node 0, its scale node 1."""

    def __init__(self, machine: MachineConfig, drive: NodePlan, scale: NodePlan) -> None:
        axis = machine.axes["x"]
        rpdos = [pdo.codec for pdo in drive.rpdos]
        inputs = {0: drive.tpdo.codec}, (1, scale.tpdo.codec)
        parts = axis_parts(axis, axis_params(machine, "x"), rpdos, *inputs)
        super().__init__("x", axis, CycleMemory([parts], [rpdos], 2), 0)
        self.events: list[AxisEvent] = []
        self.power_allowed: Callable[[], bool] = lambda: True
        self._pack = drive.tpdo.codec.pack, scale.tpdo.codec.pack

    @property
    def row(self) -> list[float]:
        """Channels of the last step."""
        return self.memory.row[3:].tolist()

    def step(
        self, drive: Sequence[int] | None, scale: Sequence[int] | None, reference: list[float] | None
    ) -> bytes:
        """Advance by one cycle; return the payload of the RPDO. `drive`, `scale`: values of their TPDOs."""
        self.allow_power(allowed=self.power_allowed())
        given = zip(self._pack, (drive, scale), strict=True)
        inputs = [None if values is None else pack(*values) for pack, values in given]
        if self.memory.step(inputs, reference, 0.0, 0, -1):
            self.events += self.findings()
        return self.memory.payloads()[0]


def settle(servo: SteppedAxis, counts: int = 0, scale: int = 0) -> None:
    """Run the axis at standstill at these counts until it is ready."""
    for _ in range(2):
        servo.step((DISABLED, counts, 0), (scale,), None)
    for _ in range(SETTLING_CYCLES + 2):
        servo.step((ENABLED, counts, 0), (scale,), None)
    assert servo.ready
    servo.events.clear()


def values(servo: SteppedAxis) -> dict[str, float]:
    """Return the last row by channel name."""
    return dict(zip(ROW, servo.row, strict=True))
