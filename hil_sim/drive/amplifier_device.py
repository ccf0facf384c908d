"""One CiA 402 drive on the bus: the state machine, its option codes and faults, wired to the motion.

The runner calls `command_axis` before and `read_axis` after every advance of the plant; the slave calls
`process` when process objects have changed.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from hil_sim.config import AxisPlant, Plant
from hil_sim.drive import cia402_device as cia402
from hil_sim.drive import stopping
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.cia402_device import Command, Event, State, Transition
from hil_sim.drive.drive_dictionary import guard, hardware_values
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.modes import BIT_13
from hil_sim.drive.motion import Motion
from hil_sim.drive.stopping import Ramp
from hil_sim.node import emcy
from hil_sim.node.nmt import Clock
from hil_sim.node.slave import Slave

CONNECTION_ERROR = 0x8100  # communication, generic: the master stopped or reset a node in motion


class Drive:
    """Amplifier with motor encoder of axis `index` of the plant. Raises what `Slave` raises."""

    profile = 402

    def __init__(
        self,
        config: AxisPlant,
        plant: Plant,
        index: int,
        clock: Clock,
        send: Callable[[int, bytes], None],
        state_directory: Path | None,
    ) -> None:
        self.objects = DriveObjects()
        self.port = AxisPort(config, plant, index)
        self.motion = Motion(self.objects, self.port)
        self.state = State.NOT_READY_TO_SWITCH_ON
        self._config = config
        self._clear_commands()
        drive = config.drive
        self.slave = Slave(
            node_id=drive.node_id,
            eds=drive.eds,
            objects=self.objects,
            device=self,
            clock=clock,
            send=send,
            state_directory=state_directory,
        )
        guard(self.slave.dictionary, self)

    def _clear_commands(self) -> None:
        self._controlword = 0
        self._state_at_controlword: State | None = None  # when it was last executed
        self._ramp_target: State | None = None  # where a ramp of 605Bh or 605Ch leads
        self._torque_limits = (0, 0)  # 6072h and 6073h, as the port has them

    # --- services for the slave ----------------------------------------------------------------------

    def factory_settings(self) -> None:
        """Set the rating plate, the encoder, and the torque limits of the amplifier."""
        for (index, subindex), value in hardware_values(self._config).items():
            self.slave.dictionary.put(index, subindex, value)

    def reset(self) -> None:
        """Power up: not homed, power stage off; the self-test passes at once."""
        self.port.origin = 0
        self.port.take_polarity(self.objects.polarity)
        self.motion.reset()
        self._clear_commands()
        self._limit_torque()
        self.port.read(self.objects)
        self.objects.digital_inputs = 0
        self.state = State.NOT_READY_TO_SWITCH_ON
        self._automatic_transition(Event.SELF_TEST_PASSED)
        self.motion.read_switches()
        self._show()

    def is_idle(self) -> bool:
        """Whether the motor has no power: parameters may be stored then."""
        return not self.motion.powered

    def connection_lost(self, code: int) -> None:
        """React as the abort connection option code 6007h says."""
        powered = self.motion.powered
        option = self.objects.abort_connection_option_code
        if option == 1 and (code or powered):
            self.fault(code or CONNECTION_ERROR, emcy.COMMUNICATION)
        elif option == 2 and powered:
            self._enter(State.SWITCH_ON_DISABLED)
        elif option == 3 and self.state is State.OPERATION_ENABLED:
            self._quick_stop()
        self._show()

    def process(self) -> None:
        """Act on a new controlword, mode or torque limit; the tick reads the set points."""
        objects = self.objects
        if objects.modes_of_operation != objects.modes_of_operation_display:
            self.motion.select_mode(objects.modes_of_operation)
        if (objects.max_torque, objects.max_current) != self._torque_limits:
            self._limit_torque()
        controlword = objects.controlword
        if controlword != self._controlword or self._state_at_controlword is not self.state:
            previous, self._controlword = self._controlword, controlword
            self._execute(controlword, previous)
            self._state_at_controlword = self.state
            self._show()

    def _limit_torque(self) -> None:
        self._torque_limits = (self.objects.max_torque, self.objects.max_current)
        self.port.limit_torque(*self._torque_limits)

    # --- the tick ---------------------------------------------------------------------------------

    def command_axis(self, dt_s: float, share: float) -> None:
        """Command the axis for the next `dt_s`, which is a `share` of the communication cycle."""
        self.motion.tick(dt_s, share)

    def read_axis(self, dt_s: float) -> None:
        """Read the axis back and supervise it."""
        motion = self.motion
        self.port.read(self.objects)
        if self.port.switches() != self.objects.digital_inputs:
            motion.read_switches()
        if motion.powered and motion.check(dt_s):
            self.fault(emcy.FOLLOWING_ERROR, emcy.PROFILE)
        self._show()
        motion.limits.active = False

    def _show(self) -> None:
        """Compose the statusword."""
        motion = self.motion
        word = self.state | cia402.VOLTAGE_ENABLED | cia402.REMOTE
        if self.state is State.OPERATION_ENABLED or self.state is State.QUICK_STOP_ACTIVE:
            word |= motion.status()
        elif self.objects.error_code == emcy.FOLLOWING_ERROR:
            word |= BIT_13
        if motion.limits.active or motion.limits.switched:
            word |= cia402.INTERNAL_LIMIT
        self.objects.statusword = word

    # --- states -----------------------------------------------------------------------------------

    def _execute(self, controlword: int, previous: int) -> None:
        command = cia402.decode(controlword, previous)
        stays = stopping.quick_stop_stays(self.objects.quick_stop_option_code)
        if self._ramp_target is not None and command is Command.ENABLE_OPERATION:
            self._enter(State.OPERATION_ENABLED)
        found = cia402.transition(self.state, command, stays)
        while found is not None:
            self._take(found)
            if self.state is not found.target:
                break  # a ramp comes first
            found = cia402.transition(self.state, command, stays)
        if self.state is State.OPERATION_ENABLED and self._ramp_target is None:
            self.motion.halt(bool(controlword & cia402.HALT))
            self.motion.mode.command(controlword, previous)

    def _take(self, found: Transition) -> None:
        objects = self.objects
        if found.number == 5:
            self._ramp_to(found.target, stopping.DISABLE_OPERATION[objects.disable_operation_option_code])
        elif found.number == 8:
            self._ramp_to(found.target, stopping.SHUTDOWN[objects.shutdown_option_code])
        elif found.number == 11:
            self._quick_stop()
        else:
            if found.number == 15:
                self._clear_fault()
            self._enter(found.target)

    def _enter(self, state: State) -> None:
        """Enter a state and switch the power stage accordingly; the caller starts a ramp."""
        self.state = state
        self._ramp_target = None
        if state is State.OPERATION_ENABLED:
            self.motion.follow()
        elif state not in cia402.POWERED:
            self.motion.switch_off()

    def _automatic_transition(self, event: Event) -> None:
        """Carry out the transition of an event in the drive."""
        self._enter(cia402.TRANSITIONS[self.state, event].target)

    def _ramp_to(self, target: State, ramp: Ramp | None) -> None:
        if ramp is None:
            self._enter(target)
        elif self._ramp_target is not target:
            self._ramp_target = target
            self.motion.stop(ramp, partial(self._enter, target))

    def _quick_stop(self) -> None:
        option = self.objects.quick_stop_option_code
        ramp = stopping.QUICK_STOP[option]
        self._enter(State.QUICK_STOP_ACTIVE)
        if ramp is None:
            self._automatic_transition(Event.QUICK_STOP_ENDED)
            return
        stays = stopping.quick_stop_stays(option)
        self.motion.stop(ramp, None if stays else partial(self._automatic_transition, Event.QUICK_STOP_ENDED))

    def fault(self, code: int, register: int) -> None:
        """Report error `code` and carry out the fault reaction 605Eh."""
        if (self.state, Event.FAULT) not in cia402.TRANSITIONS:
            return
        self.objects.error_code = code
        self.slave.emergency.report(code, register)
        ramp = stopping.FAULT_REACTION[self.objects.fault_reaction_option_code]
        self._automatic_transition(Event.FAULT)
        if self.motion.powered and ramp is not None:
            ended = partial(self._automatic_transition, Event.FAULT_REACTION_ENDED)
            self.motion.stop(ramp, ended, in_position_loop=False)
        else:
            self._automatic_transition(Event.FAULT_REACTION_ENDED)
        self._show()

    def _clear_fault(self) -> None:
        self.slave.emergency.clear(self.objects.error_code)
        self.objects.error_code = 0
