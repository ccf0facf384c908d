"""The drives of all axes: passes commands to their CiA 402 sequences and their events to the machine."""

from collections.abc import Callable, Collection, Iterable, Sequence
from typing import NamedTuple

from kernels.arrays import Array
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.commands.machine_status import ContourStatus
from servo_ctrl.cyclic import sequence_state
from servo_ctrl.cyclic.cia402 import DriveState
from servo_ctrl.cyclic.drive_phases import Phase
from servo_ctrl.cyclic.sequence import COASTS_M_S
from servo_ctrl.cyclic.sequence_state import brake, lose, release
from servo_ctrl.daemon.cycle.cycle import Inputs
from servo_ctrl.daemon.set_points.reference import Row

BRAKED = frozenset({Phase.DISABLING, Phase.OFF, Phase.LOST})
BRAKING = BRAKED | {Phase.QUICK_STOPPING}

Transition = Callable[[sequence_state.Sequence], sequence_state.Sequence]


class AxisNodes(NamedTuple):
    """An axis and the indices of its nodes among the inputs of a cycle."""

    servo: AxisServo
    drive: int
    scale: int | None
    stop_acceleration_m_s2: float
    further_tpdos: tuple[int, ...] = ()
    """Inputs that are further TPDOs of the drive, sent after every SYNC."""


class Drives:
    """The drives of the axes at `places`."""

    def __init__(self, places: Sequence[AxisNodes]) -> None:
        self._places = tuple(places)
        self._servos = [place.servo for place in places]
        self._memory = self._servos[0].memory
        self._events_pending = False
        """Whether `take_events` has not yet collected the events of the last cycle."""
        self._inputs_were_old = False
        """Whether inputs of the last cycle may have been old."""
        self.input_ages: Callable[[], Sequence[int]] = list
        """Returns by axis how many cycles old its last inputs may be; empty when all are new."""

    @property
    def hold_positions_m(self) -> list[float]:
        """Positions at which the controller took the axes over."""
        return [servo.hold_m for servo in self._servos]

    @property
    def contour(self) -> ContourStatus:
        """Contour control and its error in the last cycle."""
        coupling = self._memory.coupled()
        if coupling is None:
            return ContourStatus()
        axes, error_m = coupling
        return ContourStatus(tuple(self._servos[axis].name for axis in axes), error_m)

    @property
    def ready(self) -> bool:
        """Whether all axes follow our set points."""
        return all(servo.ready for servo in self._servos)

    @property
    def braked(self) -> bool:
        """Whether no axis brakes any more."""
        return all(servo.phase in BRAKED for servo in self._servos)

    @property
    def enabled(self) -> bool:
        """Whether the last statusword of any drive says "operation enabled"."""
        return any(servo.drive_state is DriveState.OPERATION_ENABLED for servo in self._servos)

    @property
    def moving(self) -> bool:
        """Whether any axis moves so fast that it would coast after power off."""
        return any(abs(servo.velocity_m_s) > COASTS_M_S for servo in self._servos)

    @property
    def at_a_switch(self) -> str:
        """Which axis stands at a limit switch, and what to do; "" if none does."""
        return next((text for servo in self._servos if (text := servo.watch.at_a_switch)), "")

    @property
    def off(self) -> bool:
        """Whether all drives are without power, as far as their frames show."""
        return all(servo.off for servo in self._servos)

    def step(
        self, inputs: Inputs, set_points: Row | None, time_s: float, cycle: int, segment: int
    ) -> list[bytes]:
        """Advance all axes by one cycle and return the RPDO payloads; `row` then returns the recorded row.

        `set_points`: row of this cycle; None = every axis holds the position at which it was taken over.
        """
        ages = self.input_ages()
        if ages or self._inputs_were_old:
            for servo, age in zip(self._servos, ages or [0] * len(self._servos), strict=True):
                servo.input_age(age)
            self._inputs_were_old = bool(ages)
        self._events_pending = self._memory.step(inputs, set_points, time_s, cycle, segment)
        return self._memory.payloads()

    def row(self) -> list[float]:
        """Return the recorded row of the last cycle."""
        values: list[float] = self._memory.row.tolist()
        return values

    @property
    def row_memory(self) -> Array:
        """The memory of the recorded row, which each cycle overwrites."""
        return self._memory.row

    def take_events(self) -> list[tuple[AxisServo, Event, str]]:
        """Return the events of the last cycle, once."""
        if not self._events_pending:
            return []
        self._events_pending = False
        return [(servo, event, text) for servo in self._servos for event, text in servo.findings()]

    def skip_cycles(self, cycles: int) -> None:
        """Advance all axes over periods that had no SYNC."""
        for servo in self._servos:
            servo.skip_cycles(cycles)

    def cut_off(self, servo: AxisServo | None) -> None:
        """Switch this drive's power off at once while the others brake; all of them for None."""
        for own in self._servos:
            if servo in {None, own} and own.phase not in BRAKED:
                own.sequence = release(own.sequence)
            elif own.phase not in BRAKING:
                own.sequence = brake(own.sequence)

    def change_sequences(self, change: Transition) -> None:
        """Apply `change` to the sequences of all drives that respond."""
        for servo in self._servos:
            if servo.phase is not Phase.LOST:
                servo.sequence = change(servo.sequence)

    def switch_on_again(self) -> None:
        """Switch all drives on again."""
        for servo in self._servos:
            servo.switch_on_again()

    def home(self, servos: Iterable[AxisServo], at_m: Sequence[float]) -> None:
        """Start homing of these axes; the others hold the positions `at_m`."""
        for servo, hold_m in zip(self._servos, at_m, strict=True):
            servo.hold_m = hold_m
        for servo in servos:
            servo.home()

    def forget_homes(self, nodes: Collection[int]) -> list[tuple[str, bool]]:
        """Forget the homes of the drives among these nodes; return each axis and whether it homes again."""
        affected = []
        for place in self._places:
            if place.drive in nodes:
                place.servo.forget_home()
                affected.append((place.servo.name, place.servo.homes))
        return affected

    def lose(self, node: int) -> None:
        """Give up a node that no longer responds; nodes other than drives are ignored."""
        self._change(node, lose)

    def accept_again(self, node: int) -> None:
        """Accept a node that responds again; a drive that still moves brakes, then gives up its power."""
        self._change(node, brake)

    def _change(self, node: int, change: Transition) -> None:
        for place in self._places:
            if place.drive == node:
                place.servo.sequence = change(place.servo.sequence)
