"""One axis in the daemon: reads and changes the axis's record between two compiled cycles."""

from collections.abc import Sequence as Values
from typing import Any

from kernels.records import read, write
from servo_ctrl.axis.axis_parts import CURRENT_ACTUAL_VALUE, MODE_DISPLAY, STATUSWORD
from servo_ctrl.axis.axis_watch import AxisEvent, AxisWatch
from servo_ctrl.axis.cycle_memory import CycleMemory
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.axis_record import Inputs
from servo_ctrl.cyclic.axis_supervision import begin_watch
from servo_ctrl.cyclic.cia402 import DriveState, drive_state
from servo_ctrl.cyclic.drive_phases import UNDER_CONTROL, Phase
from servo_ctrl.cyclic.sequence_state import Route, Sequence, begin, home
from servo_ctrl.motion.profile import Motion

REFERENCE_FIELDS = len(Motion._fields)
"""Number of set points of an axis in a row: the fields of `Motion`, in its order."""


class AxisServo:
    """The axis `name`, with index `place` in `memory`. Positions are metres at the table, from home."""

    def __init__(self, name: str, config: AxisConfig, memory: CycleMemory, place: int) -> None:
        self.name = name
        self.memory = memory
        self.watch = AxisWatch(name, config)
        self.error_code: int | None = None
        """Error code of the drive's last EMCY, until an error reset or the next switch-on."""
        self._place = place
        self._record: Any = memory.record(place)
        self._route = read(self._record["route"], Route)
        self._own_params: AxisParams | None = None
        """Its own parameters during a trial of others."""

    @property
    def params(self) -> AxisParams:
        """The parameters of its control law; during a trial its own ones, not those on trial."""
        return self.memory.params(self._place) if self._own_params is None else self._own_params

    @property
    def on_trial(self) -> bool:
        """Whether other parameters than its own act."""
        return self._own_params is not None

    @property
    def sequence(self) -> Sequence:
        """The state of its drive's sequence."""
        return read(self._record["sequence"], Sequence)

    @sequence.setter
    def sequence(self, sequence: Sequence) -> None:
        write(self._record["sequence"], sequence)

    @property
    def phase(self) -> Phase:
        """The phase of the sequence."""
        return Phase(self._record["sequence"]["phase"])

    @property
    def inputs(self) -> Inputs:
        """The inputs of the last cycle."""
        return read(self._record["inputs"], Inputs)

    @property
    def drive_state(self) -> DriveState:
        """The CiA 402 state in the last statusword."""
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
        """Whether the drive has a homing method."""
        return self._route.homing

    @property
    def homed(self) -> bool:
        """Whether homing was completed."""
        return bool(self._record["homed"])

    @property
    def velocity_m_s(self) -> float:
        """Motor velocity estimated by the control law; NaN while the axis follows no set points."""
        command: Any = self._record["law"]["command"]
        return float(command["motor_velocity_m_s"]) if self._record["engaged"] else float("nan")

    @property
    def ready(self) -> bool:
        """Whether the axis follows set points and has settled."""
        return self.phase is Phase.SERVO

    @property
    def off(self) -> bool:
        """Whether the drive is without power, as far as its frames show."""
        return self.phase in {Phase.OFF, Phase.LOST}

    def switch_on_again(self) -> None:
        """Switch the drive on again from any phase; its home stays valid."""
        self.sequence = begin(self._route, homed=self.homed)
        self.error_code = None
        begin_watch(self._record, 0.0)

    def home(self) -> None:
        """Start homing of the drive; afterwards the axis is taken over at its position."""
        self.sequence = home()
        self.forget_home()

    def forget_home(self) -> None:
        """Mark the axis as not homed."""
        self._record["homed"] = False

    def take_event_tpdo(self, codec: PdoCodec, values: Values[int]) -> None:
        """Take an event-driven TPDO of the drive; its values are valid until the next one."""
        inputs = self._record["inputs"]
        for mapped, value in zip(codec.objects, values, strict=True):
            if mapped.address == STATUSWORD:
                inputs["statusword"] = value
            elif mapped.address == MODE_DISPLAY:
                inputs["mode_shown"] = value
            elif mapped.address == CURRENT_ACTUAL_VALUE:
                inputs["current_held_a"] = value * self._record["wiring"]["ampere_per_permille"]

    def findings(self) -> list[AxisEvent]:
        """Return the events that the last cycle found."""
        return self.watch.findings(self._record)

    def closed_switch(self, inputs: int) -> str:
        """Take the digital inputs (60FDh); return which limit switch closed under our control, else ""."""
        return self.watch.closed_switch(inputs, controlled=self.phase in UNDER_CONTROL)

    def change_params(self, params: AxisParams) -> None:
        """Change the control-law parameters from the next cycle on; the state of the law stays.

        During a trial of others, the change acts after the trial.
        """
        if self._own_params is None:
            self.memory.change_params(self._place, params)
        else:
            self._own_params = params

    def try_params(self, params: AxisParams) -> None:
        """Apply these parameters until `end_trial`, even if the axis's own ones change meanwhile."""
        self._own_params = self.params
        self.memory.change_params(self._place, params)

    def end_trial(self) -> None:
        """Apply the axis's own parameters again."""
        if self._own_params is not None:
            self.memory.change_params(self._place, self._own_params)
            self._own_params = None

    def skip_cycles(self, cycles: int) -> None:
        """Count periods without a SYNC."""
        self._record["periods_without_input"] += cycles

    def allow_power(self, *, allowed: bool) -> None:
        """Set whether a drive without power may be switched on."""
        self._record["power_allowed"] = allowed

    def input_age(self, cycles: int) -> None:
        """Set how many cycles old the next inputs of drive or scale may be because of late frames."""
        self._record["input_age"] = cycles
