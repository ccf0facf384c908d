"""All drives of a machine together: what their sequences are told, and what they ask of the machine."""

from collections.abc import Callable, Collection, Iterable, Sequence
from typing import NamedTuple

from servo_ctrl.axis import drive
from servo_ctrl.axis.drive import COASTS_M_S, Phase, brake, lose, release
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.servo import REFERENCE_FIELDS, AxisServo
from servo_ctrl.canopen.cia402 import DriveState
from servo_ctrl.daemon.cycle.cycle import Inputs
from servo_ctrl.daemon.set_points.reference import Row

BRAKED = frozenset({Phase.DISABLING, Phase.OFF, Phase.LOST})
BRAKING = BRAKED | {Phase.QUICK_STOPPING}


class AxisPlace(NamedTuple):
    """An axis and where its nodes are among the inputs."""

    servo: AxisServo
    drive: int
    scale: int | None
    stop_acceleration_m_s2: float
    further: tuple[int, ...] = ()
    """Other TPDOs of the drive that come with every SYNC."""


class Drives:
    """The drives of the axes at `places`."""

    def __init__(self, places: Sequence[AxisPlace]) -> None:
        self._places = tuple(places)
        self._servos = [place.servo for place in places]

    @property
    def hold_positions_m(self) -> list[float]:
        """Where the axes were taken over."""
        return [servo.hold_m for servo in self._servos]

    @property
    def ready(self) -> bool:
        """Our loops lead all axes."""
        return all(servo.ready for servo in self._servos)

    @property
    def braked(self) -> bool:
        """None brakes any more."""
        return all(servo.sequence.phase in BRAKED for servo in self._servos)

    @property
    def enabled(self) -> bool:
        """One was in operation by its last statusword."""
        return any(servo.inputs.drive_state is DriveState.OPERATION_ENABLED for servo in self._servos)

    @property
    def moving(self) -> bool:
        """One that we lead would coast, if its power went now."""
        return any(abs(servo.row.motor_velocity_m_s) > COASTS_M_S for servo in self._servos)

    @property
    def at_a_switch(self) -> str:
        """Which axis stands at a limit switch, and what to do; "" where none does."""
        return next((text for servo in self._servos if (text := servo.watch.at_a_switch)), "")

    @property
    def off(self) -> bool:
        """All are without power, as far as anyone can know."""
        return all(servo.off for servo in self._servos)

    def step(self, inputs: Inputs, row: Row | None, record: list[float]) -> list[bytes]:
        """Advance all axes by one cycle: payloads of the RPDOs; their recorded values go behind `record`.

        `row`: where they are led, None = each stays where it was taken over.
        """
        payloads: list[bytes] = []
        first = 0
        for servo, own, scale, _stop, further in self._places:
            led = None if row is None else row[first : first + REFERENCE_FIELDS]
            taken = inputs[own]
            for place in further:
                taken = _joined(taken, inputs[place])
            payloads.append(servo.step(taken, None if scale is None else inputs[scale], led))
            payloads += servo.further_payloads
            record += servo.row
            first += REFERENCE_FIELDS
        return payloads

    def take_events(self) -> list[tuple[AxisServo, Event, str]]:
        """Take the events that the axes found since the last call."""
        found = []
        for servo in self._servos:
            if servo.events:
                found += [(servo, event, text) for event, text in servo.events]
                servo.events = []
        return found

    def pass_missed(self, cycles: int) -> None:
        """Let periods go by that had no SYNC."""
        for servo in self._servos:
            servo.pass_missed(cycles)

    def cut_off(self, servo: AxisServo | None) -> None:
        """Power off for this one at once, while the others brake; for all of them where none is named."""
        for own in self._servos:
            if servo in {None, own} and own.sequence.phase not in BRAKED:
                own.sequence = release(own.sequence)
            elif own.sequence.phase not in BRAKING:
                own.sequence = brake(own.sequence)

    def lead(self, change: Callable[[drive.Sequence], drive.Sequence]) -> None:
        """Change the sequences of all drives that are not lost."""
        for servo in self._servos:
            if servo.sequence.phase is not Phase.LOST:
                servo.sequence = change(servo.sequence)

    def begin_again(self) -> None:
        """Switch all of them on once more."""
        for servo in self._servos:
            servo.begin_again()

    def home(self, servos: Iterable[AxisServo], at_m: Sequence[float]) -> None:
        """Let these look for their homes; the other axes stay at `at_m`."""
        for servo, hold_m in zip(self._servos, at_m, strict=True):
            servo.hold_m = hold_m
        for servo in servos:
            servo.home()

    def forget_homes(self, nodes: Collection[int]) -> list[tuple[str, bool]]:
        """Forget the homes of the drives among these nodes; their axes, and whether they home again."""
        forgotten = []
        for place in self._places:
            if place.drive in nodes:
                place.servo.homed = False
                forgotten.append((place.servo.name, place.servo.route.homing))
        return forgotten

    def lose(self, node: int) -> None:
        """Give up a node that does not respond any more; it may be a drive."""
        self._change(node, lose)

    def take_back(self, node: int) -> None:
        """Take back a node that responds again; a drive stays without power."""
        self._change(node, release)

    def _change(self, node: int, change: Callable[[drive.Sequence], drive.Sequence]) -> None:
        for place in self._places:
            if place.drive == node:
                place.servo.sequence = change(place.servo.sequence)


def _joined(first: tuple[int, ...] | None, further: tuple[int, ...] | None) -> tuple[int, ...] | None:
    """Values of two TPDOs in a row; None where one did not come."""
    return None if first is None or further is None else first + further
