"""Advances all axes of a machine by one cycle: stage, set points, events, and the row for the recording.

It turns inputs into payloads without clock, bus or asyncio, so that supervisor and tests call it alike.
"""

from collections.abc import Callable, Iterable

from servo_ctrl.axis.fault_policy import REQUESTS, Event, Reaction
from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.commands.stage import Stage
from servo_ctrl.cyclic.sequence_state import Sequence, brake, release
from servo_ctrl.daemon.cycle.cycle import Inputs
from servo_ctrl.daemon.cycle.machine_state import MachineState
from servo_ctrl.daemon.set_points.reference import Reference


class MachineController(MachineState):
    """Controls all axes. It is made before the nodes boot; the caller sets its callbacks before `begin`."""

    def begin(self, *, in_standby: bool = False) -> None:
        """Switch the booted drives on, or enter standby; a drive that already has power brakes first."""
        self.stage = Stage.STARTING
        if in_standby:
            self._change_all(brake, Stage.DISABLING)

    def enable(self) -> str:
        """Reset faults and switch the drives on from standby; return why that is impossible, else "".

        Nodes that have lost their configuration boot first. A stop requested meanwhile leaves the power off.
        """
        if self.stage is not Stage.STANDBY:
            return "the machine is not in standby"
        if self.bus_off:
            return self.bus_off
        if self.setting_up:
            return f"{self._node_names[self._boot.nodes[0]]}: is being configured again; wait for its end"
        if self.nodes is not None:
            if problem := self.nodes.objection(self._missing.lost):
                return problem
            if unconfigured := self.nodes.to_boot(self._missing.lost):
                names = ", ".join(self._node_names[node] for node in unconfigured)
                self.note(f"{names}: booted and configured again before the drives get power")
                self._boot.begin(unconfigured)
                self._unhomed = [node for node in unconfigured if not self.nodes.keeps_position(node)]
                self.nodes.begin_boot(unconfigured)
                return ""
        self._switch_on()
        return ""

    def booted(self, problem: str = "") -> None:
        """Note that the nodes have booted again; `problem` says why they have not."""
        if self.nodes is None or not self.setting_up:
            return
        if problem := problem or self.nodes.booted(self._boot.nodes):
            self.nodes.not_booted(self._boot.nodes)
            self._boot.end()
            self.note(f"not enabled: {problem}")
            self.on_rest()
        else:
            self._boot.started = True

    def home(self, servos: Iterable[AxisServo]) -> None:
        """Start homing of these drives while the other axes hold; do nothing unless the machine is ready."""
        if self.stage is Stage.READY:
            self._drives.home(servos, self.set_points_m())
            self._source.reset()
            self.stage = Stage.STARTING

    def run(self, program: Reference) -> None:
        """Start a program; do nothing unless the machine is ready."""
        if self.stage is Stage.READY:
            self._source.begin(program, self._drives.hold_positions_m)
            self.completed, self.stage = False, Stage.RUNNING

    def interrupt(self) -> None:
        """Ramp the running program down to rest; the axes stay under control, the machine becomes ready."""
        if self.stage is Stage.RUNNING:
            self._source.ramp_down(self._drives.hold_positions_m)

    def finish(self) -> None:
        """Come to rest and switch the drives off, because no further program follows."""
        if self.stage is Stage.READY:
            self._stop_in_order()

    def tick(self, cycle: int, elapsed: int, inputs: Inputs) -> list[bytes] | None:
        """Run one cycle, `elapsed` SYNC periods after the last. Return RPDO payloads, None when off."""
        self._cycle = cycle
        if elapsed > 1:
            self._skip_missed_periods(cycle, elapsed - 1)
        if self._missing.any:
            self._missing.recount(inputs)
        self._take_set_points(cycle)
        source = self._source
        payloads = self._drives.step(inputs, source.row, cycle * self._period_s, cycle, source.segment)
        self.keep_row(self._drives.row_memory)
        self.record(self._drives.row())
        for servo, event, text in self._drives.take_events():
            self.event(event, text + self.disturbance_remark(cycle), servo)
        if self.stage is Stage.RUNNING:
            if source.stopping and source.at_rest:
                self._become_ready()
        elif not self._advance_stage():
            return None
        elif self.stage is Stage.STANDBY:
            if self._missing.lost:
                self._accept_nodes()
            elif self._boot.started:
                self._end_setting_up()
        return payloads

    def input_missing(self, node: int) -> bool:
        """Count a node's missing inputs; return whether the node is given up."""
        self._disturbed_at = self._cycle
        if not self._missing.count(node, self._cycle):
            return False
        self._drives.lose(node)
        if self.nodes is not None:
            self.nodes.give_up(node)
        self.event(Event.LOST_TPDO, f"{self._node_names[node]}: its TPDOs are no longer received")
        return True

    def duplicate_input(self, node: int) -> None:
        """Stop, because another participant sends inputs of a node too."""
        text = "answers a SYNC twice: two nodes share its node id, or another participant sends its TPDOs"
        self.event(Event.DUPLICATE_NODE, f"{self._node_names[node]}: {text}")

    def wrong_input_length(self, node: int, size: int) -> None:
        """Stop, because a TPDO of a node has a `size` in bytes that contradicts its mapping."""
        text = f"a TPDO of {size} bytes, which contradicts its mapping"
        self.event(Event.WRONG_PDO, f"{self._node_names[node]}: {text}")

    def object_changed(self, node: int, text: str) -> None:
        """Stop, because another participant wrote to a node: its objects are uncertain until it boots."""
        if self.nodes is not None:
            self.nodes.changed[node] = text
        self.event(Event.OBJECT_CHANGED, text)

    def event(self, event: Event, text: str, servo: AxisServo | None = None) -> None:
        """Log an event, of axis `servo` if given, and carry out the reaction of the fault policy."""
        failed_before = self.failed
        if event in REQUESTS and self._boot.cancel_power():
            self.note("configured again, and left without power")
        reaction = self._incidents.handle(self.stage, event, text, self._cycle)
        if self.failed and not failed_before:
            self.on_fault(event, text)
        match reaction:
            case Reaction.HOLD:
                self._stop_in_order()
            case Reaction.QUICK_STOP:
                self._change_all(brake, Stage.QUICK_STOPPING)
            case Reaction.CUT_OFF:
                self._drives.cut_off(servo)
                self.stage = Stage.QUICK_STOPPING
            case Reaction.DISABLE:
                self._change_all(release, Stage.DISABLING)
            case Reaction.NONE:
                return
        self.on_stop(text)

    def _take_set_points(self, cycle: int) -> None:
        """Take the next row of set points."""
        source = self._source
        if self.stage is Stage.RUNNING and not source.stopping:
            if source.follow(cycle):
                return
            self.completed = True
            if self.served:
                source.ramp_down(self._drives.hold_positions_m)
            else:
                self._stop_in_order()
        source.hold_or_ramp()

    def _skip_missed_periods(self, cycle: int, missed: int) -> None:
        """Advance over missed periods: set points keep true time in a short gap and stop in a long one."""
        self._disturbed_at = cycle
        if problem := self._missed.count(cycle, missed):
            self.event(Event.LATE_TICK, problem)
            if self.stage is Stage.DISABLING and self._drives.enabled:
                # the ramp had ended but the power was still on: the axes may have accelerated since
                self._change_all(brake, Stage.QUICK_STOPPING)
        else:
            for late in range(missed, 0, -1):
                self._take_set_points(cycle - late)
        self._drives.skip_cycles(missed)

    def _stop_in_order(self) -> None:
        """Come to rest, then switch the power off."""
        self._source.ramp_down(self._drives.hold_positions_m)
        self.stage = Stage.STOPPING

    def _become_ready(self) -> None:
        """Become ready for the next program after the last one has ended and the axes stand."""
        self._source.end_ramp()
        self.stage = Stage.READY
        self.on_rest()

    def _accept_nodes(self) -> None:
        """Accept nodes that were given up and respond again; in standby nothing moves."""
        for node in self.nodes.returned(self._missing.lost) if self.nodes is not None else ():
            self._missing.lost.remove(node)
            self.note(f"{self._node_names[node]}: its TPDOs are received again")
            self._drives.accept_again(node)

    def _end_setting_up(self) -> None:
        """Give the drives power once the nodes are configured and their inputs arrive."""
        if self.nodes is not None:
            self.nodes.mark_operational(self._boot.nodes)
        for name, homes in self._drives.forget_homes(self._unhomed):
            what = "it homes again" if homes else "it has no homing: compare its position with the machine"
            self.note(f"axis {name}: its drive was configured again and has lost its reference; {what}")
        if self._boot.end():
            self._switch_on()
        else:
            self.on_rest()

    def _switch_on(self) -> None:
        failed = self.failed
        self._drives.switch_on_again()
        self._incidents.clear()
        self.stage = Stage.STARTING
        self.on_enable(failed)

    def _change_all(self, change: Callable[[Sequence], Sequence], stage: Stage) -> None:
        self._drives.change_sequences(change)
        self.stage = stage

    def _advance_stage(self) -> bool:
        """Enter the stage that follows from the axes' phases; return False when the machine is off."""
        if self.stage is Stage.STARTING and self._drives.ready:
            self.stage = Stage.READY
            self.on_ready()
        if self.stage is Stage.STOPPING and self._source.at_rest:
            if self._drives.moving:  # something else has set an axis in motion
                self._change_all(brake, Stage.QUICK_STOPPING)
            else:
                self._change_all(release, Stage.DISABLING)
        if self.stage is Stage.QUICK_STOPPING and self._drives.braked:
            self.stage = Stage.DISABLING
        if self.stage is Stage.DISABLING and self._drives.off:
            self._end_stop()
        return self.stage is not Stage.OFF

    def _end_stop(self) -> None:
        """End the run or stand by, once all drives are without power."""
        if self._incidents.ending or not self.stand_by:
            self.stage = Stage.OFF
        else:
            self.stage = Stage.STANDBY
            self._source.reset()
            self.on_rest()
