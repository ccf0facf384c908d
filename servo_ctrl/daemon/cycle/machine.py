"""All axes of a machine through one cycle: stage, references, events, and the row for the recording.

No clock, no bus, no asyncio: inputs come in, payloads go out. The supervisor and the tests drive it alike.
"""

from collections.abc import Callable, Iterable

from servo_ctrl.axis.drive import Sequence, brake, release
from servo_ctrl.axis.fault_policy import Event, Reaction
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.cycle import Inputs
from servo_ctrl.daemon.cycle.drives import AxisPlace
from servo_ctrl.daemon.cycle.machine_figures import MachineFigures
from servo_ctrl.daemon.cycle.missing_inputs import Tolerance
from servo_ctrl.daemon.cycle.stand_by import Nodes
from servo_ctrl.daemon.set_points.reference import Reference
from servo_ctrl.recording.channels import MachineRow


class Machine(MachineFigures):
    """The axes together.

    `record` takes a row a cycle; `on_ready` is called once the axes are led, `on_rest` when a served
    machine is ready again after a program, or in standby, `on_stop` for every event that stops the
    machine, `on_fault` for the first of them that is no wish.
    """

    def __init__(
        self,
        places: list[AxisPlace],
        node_names: list[str],
        period_s: float,
        *,
        tolerance: Tolerance,
        record: Callable[[list[float]], None],
        on_ready: Callable[[], None],
        on_rest: Callable[[], None],
        on_stop: Callable[[str], None],
        on_fault: Callable[[Event, str], None],
    ) -> None:
        super().__init__(places, len(node_names), period_s, tolerance, on_fault)
        self.served = False
        """Whether the axes stay under control after a program, for the next one."""
        self.stand_by = False
        """Whether a stop ends in standby instead of off."""
        self.nodes: Nodes | None = None
        """Which can be used again, for a machine that stands by."""
        self.completed = False
        """The last program was run to its end."""
        self._node_names = node_names
        self._record = record
        self._on_ready, self._on_rest, self._on_stop = on_ready, on_rest, on_stop
        self._cycle = -1

    def wait_for_the_operator(self) -> None:
        """Begin in standby. A drive that is found with power brakes first."""
        self._lead_all(brake, Stage.DISABLING)

    def enable(self) -> str:
        """From standby switch the drives on, faults reset; why that cannot be, else ""."""
        if self.stage is not Stage.STANDBY:
            return "the machine is not in standby"
        if self.nodes is not None and (problem := self.nodes.objection(self._missing.lost)):
            return problem
        self._drives.begin_again()
        self._incidents.forget()
        self.stage = Stage.STARTING
        return ""

    def home(self, servos: Iterable[AxisServo]) -> None:
        """Let drives look for their homes once more, the other axes stay; the machine must be ready."""
        if self.stage is not Stage.READY:
            return
        self._drives.home(servos, self.set_points_m())
        self._source.let_go()
        self.stage = Stage.STARTING

    def run(self, program: Reference) -> None:
        """Start a program; the machine must be ready."""
        if self.stage is Stage.READY:
            self._source.program = program
            self.completed = False
            self.stage = Stage.RUNNING

    def interrupt(self) -> None:
        """Ramp a program down to rest; the axes stay under control and are ready then."""
        if self.stage is Stage.RUNNING:
            self._source.ramp_down(self._drives.held_m)

    def finish(self) -> None:
        """No further program: the drives are switched off."""
        if self.stage is Stage.READY:
            self._hold()

    def tick(self, cycle: int, elapsed: int, inputs: Inputs) -> list[bytes] | None:
        """One cycle. `elapsed`: SYNC periods since the last one. None when the machine is off."""
        self._cycle = cycle
        if elapsed > 1:
            self._pass_missed(cycle, elapsed - 1)
        if self._missing.any:
            self._missing.recount(inputs)
        self._lead(cycle)
        row = MachineRow(time_s=cycle * self._period_s, cycle=cycle, segment=self._source.segment)
        values: list[float] = [*row]
        payloads = self._drives.step(inputs, self._source.row, values)
        self._record(values)
        for servo, event, text in self._drives.happened():
            self.event(event, text + self.doubt(cycle), servo)
        if self.stage is Stage.RUNNING:
            if self._source.stopping and self._source.at_rest:
                self._rest()
        elif not self._move_on():
            return None
        elif self._missing.lost and self.stage is Stage.STANDBY:
            self._take_back()
        return payloads

    def input_missing(self, node: int) -> bool:
        """Count a node's missing inputs; True once it is given up."""
        self._disturbed_at = self._cycle
        if not self._missing.count(node, self._cycle):
            return False
        self._drives.lose(node)
        self.event(Event.LOST_TPDO, f"{self._node_names[node]}: its cyclic inputs do not come any more")
        return True

    def input_twice(self, node: int) -> None:
        """Somebody else sends inputs of a node too."""
        text = "answers a SYNC twice: two nodes have its id, or somebody sends in its name"
        self.event(Event.DUPLICATE_NODE, f"{self._node_names[node]}: {text}")

    def input_of_other_length(self, node: int, size: int) -> None:
        """Inputs of a node came with so many bytes, which is no mapping of ours."""
        self.event(
            Event.WRONG_PDO, f"{self._node_names[node]}: a TPDO of {size} bytes, which is not its mapping"
        )

    def object_changed(self, node: int, text: str) -> None:
        """Somebody else writes to a node: what boot has set is not sure any more, until the next one."""
        if self.nodes is not None:
            self.nodes.changed[node] = text
        self.event(Event.OBJECT_CHANGED, text)

    def event(self, event: Event, text: str, servo: AxisServo | None = None) -> None:
        """Something happened, maybe to this axis: do what the fault policy says."""
        wanted = self._incidents.take(self.stage, event, text, self._cycle)
        match wanted:
            case Reaction.HOLD:
                self._hold()
            case Reaction.QUICK_STOP:
                self._lead_all(brake, Stage.QUICK_STOPPING)
            case Reaction.CUT_OFF:
                self._drives.cut_off(servo)
                self.stage = Stage.QUICK_STOPPING
            case Reaction.DISABLE:
                self._lead_all(release, Stage.DISABLING)
            case Reaction.NONE:
                return
        self._on_stop(text)

    def note(self, text: str) -> None:
        """Something worth telling that needs no reaction."""
        self.events.add(text, self._cycle)

    def _lead(self, cycle: int) -> None:
        """The next row."""
        source = self._source
        if self.stage is Stage.RUNNING and not source.stopping:
            if source.follow(cycle):
                return
            self.completed = True
            if self.served:
                source.ramp_down(self._drives.held_m)
            else:
                self._hold()
        source.stay()

    def _pass_missed(self, cycle: int, missed: int) -> None:
        """Let missed periods go by. References keep true time; over too long a gap they rest."""
        self._disturbed_at = cycle
        problem = self._missed.take(cycle, missed)
        if problem:
            self.event(Event.LATE_TICK, problem)
            if self.stage is Stage.DISABLING and self._drives.enabled:
                # the ramp was over and the power had not gone yet: with it the axes may have gathered speed
                self._lead_all(brake, Stage.QUICK_STOPPING)
        else:
            for late in range(missed, 0, -1):
                self._lead(cycle - late)
        self._drives.pass_missed(missed)

    def _hold(self) -> None:
        """Come to rest, then power off."""
        self._source.ramp_down(self._drives.held_m)
        self.stage = Stage.STOPPING

    def _rest(self) -> None:
        """A program is over and the axes stand: ready for the next one."""
        self._source.rest()
        self.stage = Stage.READY
        self._on_rest()

    def _take_back(self) -> None:
        """Nodes that were given up and answer again: nothing moves, and they are looked at again."""
        for node in self.nodes.back(self._missing.lost) if self.nodes is not None else ():
            self._missing.lost.remove(node)
            self.note(f"{self._node_names[node]}: its cyclic inputs come again")
            self._drives.take_back(node)

    def _lead_all(self, change: Callable[[Sequence], Sequence], stage: Stage) -> None:
        self._drives.lead(change)
        self.stage = stage

    def _move_on(self) -> bool:
        """Stages that follow from the axes' phases; False when the machine is off."""
        if self.stage is Stage.STARTING and self._drives.ready:
            self.stage = Stage.READY
            self._on_ready()
        if self.stage is Stage.STOPPING and self._source.at_rest:
            if self._drives.moving:  # something else has set an axis in motion
                self._lead_all(brake, Stage.QUICK_STOPPING)
            else:
                self._lead_all(release, Stage.DISABLING)
        if self.stage is Stage.QUICK_STOPPING and self._drives.braked:
            self.stage = Stage.DISABLING
        if self.stage is Stage.DISABLING and self._drives.off:
            self._end_stop()
        return self.stage is not Stage.OFF

    def _end_stop(self) -> None:
        """All drives are without power."""
        if self._incidents.ending or not self.stand_by:
            self.stage = Stage.OFF
            return
        self.stage = Stage.STANDBY
        self._source.let_go()
        self._on_rest()
