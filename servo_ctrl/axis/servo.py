"""One axis in the daemon: what Python asks of its record and changes in it, between two compiled cycles."""

from collections.abc import Sequence as Several
from typing import Any

from kernels.records import read, write
from servo_ctrl.axis.axis_parts import CURRENT_ACTUAL_VALUE, MODE_DISPLAY, STATUSWORD
from servo_ctrl.axis.axis_watch import AxisWatch, Found
from servo_ctrl.axis.cycle_memory import CycleMemory
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.axis_record import Inputs
from servo_ctrl.cyclic.axis_step import begin_watch
from servo_ctrl.cyclic.cia402 import DriveState, drive_state
from servo_ctrl.cyclic.sequence import UNDER_CONTROL, Phase, Route, Sequence, begin, home
from servo_ctrl.motion.profile import Motion

REFERENCE_FIELDS = len(Motion._fields)
"""Set points of an axis in a reference row: the fields of `Motion`, in its order."""


class AxisServo:
    """The axis called `name`, at this place of the memory. Positions in metres at the table, from home."""

    def __init__(self, name: str, config: AxisConfig, memory: CycleMemory, place: int) -> None:
        self.name = name
        self.memory = memory
        self.watch = AxisWatch(name, config)
        self.error_code: int | None = None
        """Of the last emergency message of its drive, until that reports a reset or is switched on."""
        self._place = place
        self._record: Any = memory.record(place)
        self._route = read(self._record["route"], Route)

    @property
    def params(self) -> AxisParams:
        """What its law is made of."""
        return self.memory.params(self._place)

    @property
    def sequence(self) -> Sequence:
        """Where its drive is in its sequence."""
        return read(self._record["sequence"], Sequence)

    @sequence.setter
    def sequence(self, sequence: Sequence) -> None:
        write(self._record["sequence"], sequence)

    @property
    def phase(self) -> Phase:
        """Of the sequence."""
        return Phase(self._record["sequence"]["phase"])

    @property
    def inputs(self) -> Inputs:
        """Of the last cycle."""
        return read(self._record["inputs"], Inputs)

    @property
    def drive_state(self) -> DriveState:
        """Of the power stage, as it came last."""
        return drive_state(int(self._record["inputs"]["statusword"]))

    @property
    def hold_m(self) -> float:
        """Position at which the axis was taken over; its set point until a program runs."""
        return float(self._record["hold_m"])

    @hold_m.setter
    def hold_m(self, position_m: float) -> None:
        self._record["hold_m"] = position_m

    @property
    def homes(self) -> bool:
        """Whether its drive has a homing method."""
        return self._route.homing

    @property
    def homed(self) -> bool:
        """Its homing has come to its end."""
        return bool(self._record["homed"])

    @property
    def velocity_m_s(self) -> float:
        """Of the motor, as the loop estimates it; NaN where we do not lead the axis."""
        command: Any = self._record["law"]["command"]
        return float(command["motor_velocity_m_s"]) if self._record["engaged"] else float("nan")

    @property
    def ready(self) -> bool:
        """The loop leads the axis and it has settled."""
        return self.phase is Phase.SERVO

    @property
    def off(self) -> bool:
        """The drive is without power, as far as anyone can know."""
        return self.phase in {Phase.OFF, Phase.LOST}

    def begin_again(self) -> None:
        """Switch the drive on once more, whatever has happened to it; its home stays where it is."""
        self.sequence = begin(self._route, homed=self.homed)
        self.error_code = None
        begin_watch(self._record, 0.0)

    def home(self) -> None:
        """Let the drive look for its home once more; then the axis is taken over where it is."""
        self.sequence = home()
        self.forget_home()

    def forget_home(self) -> None:
        """Take the axis for one that is not homed."""
        self._record["homed"] = False

    def take_event(self, codec: PdoCodec, values: Several[int]) -> None:
        """Take a TPDO of the drive that comes at a change: its values hold until the next one."""
        inputs = self._record["inputs"]
        for mapped, value in zip(codec.objects, values, strict=True):
            if mapped.address == STATUSWORD:
                inputs["statusword"] = value
            elif mapped.address == MODE_DISPLAY:
                inputs["mode_shown"] = value
            elif mapped.address == CURRENT_ACTUAL_VALUE:
                inputs["current_held_a"] = value * self._record["wiring"]["ampere_per_permille"]

    def findings(self) -> list[Found]:
        """Say what the last cycle has found."""
        return self.watch.findings(self._record)

    def closed_switch(self, inputs: int) -> str:
        """Take the digital inputs (60FDh); return which limit switch has closed while we lead, or ""."""
        return self.watch.closed_switch(inputs, led=self.phase in UNDER_CONTROL)

    def change_params(self, params: AxisParams) -> None:
        """Let another compensation act from the next cycle on; the loop goes on where it is."""
        self.memory.change_params(self._place, params)

    def pass_missed(self, cycles: int) -> None:
        """Let periods go by that had no SYNC."""
        self._record["periods_without"] += cycles

    def allow_power(self, *, allowed: bool) -> None:
        """Say whether the drive, where it is without power, may get it."""
        self._record["power_allowed"] = allowed

    def input_age(self, cycles: int) -> None:
        """Say how many cycles old the next inputs of drive or scale may be, as many came late."""
        self._record["input_age"] = cycles
