"""Drive states: carries out the transitions of CiA 402 with power stage, brake and stop ramps.

Which transition a controlword or an event causes is in the table of `cia402_device`. This module carries it
out: option codes 605Ah to 605Eh choose the ramp that brakes the axis first, 6007h the reaction to a lost
connection.
"""

from functools import partial

from hil_sim.cyclic.drive_record import store_fields
from hil_sim.drive import cia402_device as cia402
from hil_sim.drive import stopping
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.brake_control import BrakeControl
from hil_sim.drive.cia402_device import Command, Event, State, Transition
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.motion import Motion
from hil_sim.drive.stopping import Ramp
from hil_sim.node import emcy
from hil_sim.node.emcy import EmergencyProducer

CONNECTION_ERROR = 0x8100
"""Error code "communication, generic": the master stopped or reset the node while the motor had power."""
NO_STATE = -1
"""Value of the record's `acted_state` until a controlword has been executed after power-up."""
FAULT, DISABLE_VOLTAGE, QUICK_STOP = 1, 2, 3
"""Values of the abort connection option code 6007h; with 0 the drive does nothing."""


class DriveStates:
    """The state of one drive, and the actions of its transitions on motion and brake."""

    def __init__(
        self,
        objects: DriveObjects,
        port: AxisPort,
        motion: Motion,
        brake: BrakeControl,
        emergency: EmergencyProducer,
    ) -> None:
        self._objects, self._port = objects, port
        self._motion, self._brake = motion, brake
        self._emergency = emergency
        self.power_up()

    def power_up(self) -> None:
        """Enter not ready to switch on, the state before the self-test."""
        self.state = State.NOT_READY_TO_SWITCH_ON
        store_fields(self._port.record, acted_controlword=0, state=self.state, acted_state=NO_STATE)
        self._state_after_ramp: State | None = None  # while a ramp of 605Bh or 605Ch brakes the axis

    def self_test_passed(self) -> None:
        """Carry out transition 1."""
        self._handle_event(Event.SELF_TEST_PASSED)

    def execute(self, controlword: int, previous: int) -> None:
        """Carry out the transitions that a controlword causes, then its bits for the mode of operation."""
        command = cia402.decode(controlword, previous)
        remains = stopping.remains_in_quick_stop(self._objects.quick_stop_option_code)
        ramp = self._state_after_ramp is not None and not self._brake.commanded_set
        if ramp and command is Command.ENABLE_OPERATION:
            self._enter(State.OPERATION_ENABLED)  # ends the ramp early
        if self._releasing and command is Command.SWITCH_ON:
            self._enter(State.SWITCHED_ON)
        transition = cia402.transition(self.state, command, remains)
        while transition is not None:
            self._carry_out(transition)
            if self.state is not transition.target:
                break  # after a ramp
            transition = cia402.transition(self.state, command, remains)
        if self.state is State.OPERATION_ENABLED and self._state_after_ramp is None:
            self._motion.halt(bool(controlword & cia402.HALT))
            self._motion.mode.command(controlword, previous)

    def fault(self, code: int, register: int) -> bool:
        """Report error `code` and carry out the fault reaction 605Eh.

        `register` holds the bits of the error register 1001h. Returns False if the drive is in a fault
        already: it reports only the first error.
        """
        if (self.state, Event.FAULT) not in cia402.TRANSITIONS:
            return False
        self._objects.error_code = code
        self._emergency.report(code, register)
        ramp = stopping.FAULT_REACTION[self._objects.fault_reaction_option_code]
        ended = partial(self._handle_event, Event.FAULT_REACTION_ENDED)
        self._handle_event(Event.FAULT)
        if self._motion.powered and ramp is not None:
            self._motion.stop(ramp, self._brake.set_then(ended), in_position_loop=False)
        else:
            ended()
        return True

    def connection_lost(self, code: int) -> None:
        """React by the abort connection option code 6007h; `code` 0: the master stopped or reset the node."""
        powered = self._motion.powered
        option = self._objects.abort_connection_option_code
        if option == FAULT and (code or powered):
            self.fault(code or CONNECTION_ERROR, emcy.COMMUNICATION)
        elif option == DISABLE_VOLTAGE and powered:
            self._enter(State.SWITCH_ON_DISABLED)
        elif option == QUICK_STOP and self.state is State.OPERATION_ENABLED:
            self._quick_stop()
        elif option == QUICK_STOP and self._releasing:
            self._enter(State.SWITCH_ON_DISABLED)

    def _carry_out(self, transition: Transition) -> None:
        """Enter the next state; transitions 5, 8 and 11 brake the axis by their option codes first."""
        objects = self._objects
        match transition.number:
            case 4:
                self._enter_after_release(transition.target)
            case 5:
                ramp = stopping.DISABLE_OPERATION[objects.disable_operation_option_code]
                self._enter_after_ramp(transition.target, ramp)
            case 8:
                self._enter_after_ramp(transition.target, stopping.SHUTDOWN[objects.shutdown_option_code])
            case 11:
                self._quick_stop()
            case 15:
                self._emergency.clear(objects.error_code)
                objects.error_code = 0
                self._enter(transition.target)
            case _:
                self._enter(transition.target)

    @property
    def _releasing(self) -> bool:
        """Whether the drive holds the axis until its brake is released."""
        return self.state is State.SWITCHED_ON and self._motion.powered

    def _enter(self, state: State) -> None:
        """Enter a state and switch power stage and brake accordingly; the caller starts a ramp."""
        self.state = state
        self._port.record["state"] = state
        self._state_after_ramp = None
        if state is State.OPERATION_ENABLED:
            self._brake.command(close=False)
            self._motion.enable()
        elif state not in cia402.POWERED:
            self._brake.command(close=True)
            self._motion.switch_off()

    def _handle_event(self, event: Event) -> None:
        """Carry out the automatic transition of an event in the drive."""
        self._enter(cia402.TRANSITIONS[self.state, event].target)

    def _enter_after_release(self, state: State) -> None:
        """Hold the axis while its brake is released, then enter `state`."""
        if self._releasing:
            return
        enter = self._brake.release_then(partial(self._enter, state))
        enter()
        if self.state is not state:
            self._motion.hold(enter)

    def _enter_after_ramp(self, state: State, ramp: Ramp | None) -> None:
        """Enter `state` at the end of `ramp`; None switches the power stage off at once."""
        if ramp is None:
            self._enter(state)
        elif self._state_after_ramp is not state:
            self._state_after_ramp = state
            self._motion.stop(ramp, self._brake.set_then(partial(self._enter, state)))

    def _quick_stop(self) -> None:
        """Carry out transition 11, and transition 12 at the end of the ramp where 605Ah asks for it."""
        option = self._objects.quick_stop_option_code
        ramp = stopping.QUICK_STOP[option]
        ended = partial(self._handle_event, Event.QUICK_STOP_ENDED)
        self._enter(State.QUICK_STOP_ACTIVE)
        if ramp is None:
            ended()
        else:
            remains = stopping.remains_in_quick_stop(option)
            if remains:
                self._brake.command(close=False)  # an earlier ramp may have set it already
            self._motion.stop(ramp, None if remains else self._brake.set_then(ended))
