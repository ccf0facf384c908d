"""The RPDOs of an axis: values of the control law in the drive's units, in the mapped order."""

from collections.abc import Sequence
from operator import itemgetter
from typing import Any

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
    """Fills the RPDOs of one drive."""

    def __init__(self, rpdos: Sequence[PdoCodec]) -> None:
        self.further: list[bytes] = []
        """Payloads of the RPDOs from 2 on, as they were made last."""
        self._pack, self._mapped = rpdos[0].layout.pack, _values_of(rpdos[0])
        self._others = [(codec.layout.pack, _values_of(codec)) for codec in rpdos[1:]]

    def led(self, taken: Step, counts: Sequence[int]) -> bytes:
        """Make the payload of RPDO 1 while we lead the axis; `counts`: values of `SetPointCounts`."""
        values = (taken.controlword, taken.sent_mode or taken.sequence.mode, 0, *counts)
        if self._others:
            self.further = [pack(*mapped(values)) for pack, mapped in self._others]
        return self._pack(*self._mapped(values))

    def neutral(self, taken: Step, position_counts: int) -> bytes:
        """Make the payload while the drive leads the axis: its own position, and nothing else."""
        return self.led(taken, SetPointCounts(0, 0, 0, position_counts, 0))


def _values_of(rpdo: PdoCodec) -> Any:
    """Picks the values of an RPDO, as a tuple also where it is one."""
    places = [_ORDER.index(mapped.index) for mapped in rpdo.objects]
    return itemgetter(*places) if len(places) > 1 else itemgetter(slice(places[0], places[0] + 1))
