"""What an axis sends in its RPDO: the values of the control law in the drive's units, in the mapped order."""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.canopen.cia402 import Mode
from servo_ctrl.canopen.scaling import to_integer

if TYPE_CHECKING:
    from servo_ctrl.axis.drive import Step
    from servo_ctrl.canopen.pdo import PdoCodec
    from servo_ctrl.canopen.scaling import DriveScaling
    from servo_ctrl.control.types import AxisCommand

I16_MAX = 0x7FFF
I32_MAX = 0x7FFFFFFF
_POSITION, _VELOCITY, _FORCE, _FORCE_OFFSET, _CORRECTION = 0, 1, 2, 3, 8  # places in AxisCommand
_CONTROLWORD, _MODE, _VELOCITY_OFFSET, _NOTHING = -1, -2, -3, -4


class SetPoints:
    """Fills the RPDO of one drive."""

    def __init__(self, rpdo: PdoCodec, unit: DriveScaling, mode: Mode) -> None:
        self._pack = rpdo.layout.pack
        self._slots = tuple(_slot(mapped.index, unit) for mapped in rpdo.objects)
        self._takes_velocity_offset = mode is Mode.CYCLIC_SYNC_POSITION

    def led(self, taken: Step, command: AxisCommand, velocity_offset_m_s: float) -> bytes:
        """While we lead the axis."""
        values = []
        for source, unit, limit in self._slots:
            if source == _CONTROLWORD:
                values.append(taken.controlword)
            elif source == _MODE:
                values.append(taken.sequence.mode)
            elif source == _POSITION:
                values.append(to_integer(command[_POSITION] + command[_CORRECTION], unit, -limit, limit))
            elif source >= 0:
                values.append(to_integer(command[source], unit, -limit, limit))
            elif source == _VELOCITY_OFFSET and self._takes_velocity_offset:
                values.append(to_integer(velocity_offset_m_s, unit, -limit, limit))
            else:
                values.append(0)
        return self._pack(*values)

    def neutral(self, taken: Step, position_counts: int) -> bytes:
        """While the drive leads the axis: where it is, and nothing else."""
        given = {_CONTROLWORD: taken.controlword, _MODE: taken.sequence.mode, _POSITION: position_counts}
        return self._pack(*(given.get(source, 0) for source, _, _ in self._slots))


def _slot(index: int, unit: DriveScaling) -> tuple[int, float, int]:
    """Where the value of a mapped object comes from (a field of AxisCommand), its unit and its bound."""
    return {
        0x6040: (_CONTROLWORD, 1.0, 0),
        0x6060: (_MODE, 1.0, 0),
        0x6071: (_FORCE, unit.newton_per_permille, I16_MAX),
        0x60B2: (_FORCE_OFFSET, unit.newton_per_permille, I16_MAX),
        0x607A: (_POSITION, unit.metre_per_count, I32_MAX),
        0x60FF: (_VELOCITY, unit.metre_per_count, I32_MAX),
        0x60B1: (_VELOCITY_OFFSET, unit.metre_per_count, I32_MAX),
        0x60B0: (_NOTHING, 1.0, 0),
    }[index]
