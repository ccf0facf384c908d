"""The RPDO of an axis: values of the control law in the drive's units, in the mapped order."""

from collections.abc import Sequence
from operator import itemgetter

from servo_ctrl.axis.drive import Step
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.control.set_point_counts import SetPointCounts

CONTROLWORD, MODE = 0x6040, 0x6060
TARGET_TORQUE, TORQUE_OFFSET = 0x6071, 0x60B2
TARGET_POSITION, POSITION_OFFSET = 0x607A, 0x60B0
TARGET_VELOCITY, VELOCITY_OFFSET = 0x60FF, 0x60B1
_ORDER = (
    CONTROLWORD,
    MODE,
    POSITION_OFFSET,
    TARGET_TORQUE,
    TORQUE_OFFSET,
    TARGET_VELOCITY,
    TARGET_POSITION,
    VELOCITY_OFFSET,
)
"""Of the values that there may be: behind the first three, those of `SetPointCounts`."""


class SetPoints:
    """Fills the RPDO of one drive."""

    def __init__(self, rpdo: PdoCodec) -> None:
        self._pack = rpdo.layout.pack
        self._mapped = itemgetter(*(_ORDER.index(mapped.index) for mapped in rpdo.objects))

    def led(self, taken: Step, counts: Sequence[int]) -> bytes:
        """Make the payload while we lead the axis; `counts`: values of `SetPointCounts`."""
        return self._pack(*self._mapped((taken.controlword, taken.sequence.mode, 0, *counts)))

    def neutral(self, taken: Step, position_counts: int) -> bytes:
        """Make the payload while the drive leads the axis: its own position, and nothing else."""
        return self.led(taken, SetPointCounts(0, 0, 0, position_counts, 0))
