"""The RPDO of an axis: values of the control law in the drive's units, in the mapped order."""

from servo_ctrl.axis.drive import Step
from servo_ctrl.canopen.cia402 import Mode
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.canopen.scaling import DriveScaling, to_integer
from servo_ctrl.control.types import AxisCommand

I16_MAX = 0x7FFF
I32_MAX = 0x7FFFFFFF
CONTROLWORD, MODE = 0x6040, 0x6060
TARGET_TORQUE, TORQUE_OFFSET = 0x6071, 0x60B2
TARGET_POSITION, POSITION_OFFSET = 0x607A, 0x60B0
TARGET_VELOCITY, VELOCITY_OFFSET = 0x60FF, 0x60B1


class SetPoints:
    """Fills the RPDO of one drive."""

    def __init__(self, rpdo: PdoCodec, unit: DriveScaling, mode: Mode) -> None:
        self._pack = rpdo.layout.pack
        self._objects = tuple(mapped.index for mapped in rpdo.objects)
        self._scales = tuple((index, *_unit_and_bound(index, unit)) for index in self._objects)
        self._takes_velocity_offset = mode is Mode.CYCLIC_SYNC_POSITION

    def led(self, taken: Step, command: AxisCommand, velocity_offset_m_s: float) -> bytes:
        """Make the payload while we lead the axis."""
        wanted = {
            CONTROLWORD: taken.controlword,
            MODE: taken.sequence.mode,
            TARGET_TORQUE: command.force_n,
            TORQUE_OFFSET: command.force_offset_n,
            TARGET_POSITION: command.position_m + command.correction_m,
            POSITION_OFFSET: 0.0,
            TARGET_VELOCITY: command.velocity_m_s,
            VELOCITY_OFFSET: velocity_offset_m_s if self._takes_velocity_offset else 0.0,
        }
        return self._pack(
            *(to_integer(wanted[index], unit, -bound, bound) for index, unit, bound in self._scales)
        )

    def neutral(self, taken: Step, position_counts: int) -> bytes:
        """Make the payload while the drive leads the axis: its own position, and nothing else."""
        given = {CONTROLWORD: taken.controlword, MODE: taken.sequence.mode, TARGET_POSITION: position_counts}
        return self._pack(*(given.get(index, 0) for index in self._objects))


def _unit_and_bound(index: int, unit: DriveScaling) -> tuple[float, int]:
    """Return the unit of one count of a mapped object, and the largest number that it holds."""
    return {
        CONTROLWORD: (1.0, 0xFFFF),
        MODE: (1.0, 0x7F),
        TARGET_TORQUE: (unit.newton_per_permille, I16_MAX),
        TORQUE_OFFSET: (unit.newton_per_permille, I16_MAX),
        TARGET_POSITION: (unit.metre_per_count, I32_MAX),
        POSITION_OFFSET: (unit.metre_per_count, I32_MAX),
        TARGET_VELOCITY: (unit.metre_per_count, I32_MAX),
        VELOCITY_OFFSET: (unit.metre_per_count, I32_MAX),
    }[index]
