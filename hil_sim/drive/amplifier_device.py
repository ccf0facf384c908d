"""One CiA 402 drive on the bus: the state machine, its option codes and faults, wired to the motion.

The runner calls `command_axis` before and `read_axis` after every advance of the plant; the slave calls
`process` when process objects have changed.
"""

from functools import partial
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from hil_sim.config import AxisPlant, Plant
from hil_sim.cyclic.drive_record import NO_SET_POINT
from hil_sim.drive import cia402_device as cia402
from hil_sim.drive import stopping
from hil_sim.drive.axis_port import AxisPort, store_fields
from hil_sim.drive.brake_control import BrakeControl, brake_of
from hil_sim.drive.cia402_device import Command, Event, State, Transition
from hil_sim.drive.drive_dictionary import guard, hardware_values
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.mode import BIT_13
from hil_sim.drive.motion import Motion
from hil_sim.drive.stopping import Ramp
from hil_sim.drive.touch_probe import TouchProbes
from hil_sim.node import emcy
from hil_sim.node.slave import NodeHost, Slave
from kernels.arrays import Array

CONNECTION_ERROR = 0x8100
"""Error code "communication, generic": the master stopped or reset a node in motion."""
NEVER = -1
"""State in which no controlword was executed yet."""
TORQUE_LIMITS = (
    *("acted_max_torque", "acted_max_current"),
    *("acted_positive_torque", "acted_negative_torque"),
)
"""Fields of the record: 6072h, 6073h, 60E0h, 60E1h as the port has them."""
FAULT, DISABLE_VOLTAGE, QUICK_STOP = 1, 2, 3
"""Abort connection option codes 6007h; 0 does nothing."""


class Drive:
    """Amplifier with motor encoder of axis `index` of the plant; `inside_eds` is the slave's.

    Raises what `Slave` raises.
    """

    profile = 402

    def __init__(
        self,
        config: AxisPlant,
        plant: Plant,
        index: int,
        host: NodeHost,
        objects: DriveObjects | None = None,
        inside_eds: Path | None = None,
    ) -> None:
        self.objects = DriveObjects() if objects is None else objects
        self.port = AxisPort(config, plant, index, self.objects)
        self.objects.sensors = self.port
        self.motion = Motion(self.objects, self.port)
        self._probes = TouchProbes(config, self.objects, self.port)
        self.brake = BrakeControl(self.objects, self.port, brake_of(config, plant, index), host.clock)
        self._clock = host.clock
        self._hardware_values = hardware_values(config)
        self._power_up()
        self.slave = Slave(config.drive.node_id, config.drive.eds, self.objects, self, host, inside_eds)
        guard(self.slave.dictionary, self)

    def _power_up(self) -> None:
        self.state = State.NOT_READY_TO_SWITCH_ON
        store_fields(self.port.record, acted_controlword=0, state=self.state, acted_state=NEVER)
        self._state_after_ramp: State | None = None  # while a ramp of 605Bh or 605Ch brakes the axis
        store_fields(self.port.record, **dict.fromkeys(TORQUE_LIMITS, 0))

    # --- services for the slave -------------------------------------------------------------------

    def factory_settings(self) -> None:
        """Set the rating plate, the encoder, and the torque limits of the amplifier."""
        for address, value in self._hardware_values.items():
            self.slave.dictionary.put(*address, value)

    def reset(self) -> None:
        """Power up: not homed, power stage off; the self-test passes at once."""
        self.port.origin = 0
        self.motion.reset()
        self._power_up()
        self.brake.reset()
        self.set_polarity()
        self.limit_speed()
        self._probes.reset()
        self.port.record["acted_probe_function"] = 0
        self.objects.interpolation_data_record = NO_SET_POINT
        self.last_set_point = 0
        self.take_range()
        self.objects.digital_inputs = 0
        self._enter_after(Event.SELF_TEST_PASSED)
        self.motion.read_switches()
        self._compose_statusword()

    def is_idle(self) -> bool:
        """Whether the motor has no power: parameters may be stored then."""
        return not self.motion.powered

    def manufacturer_status(self) -> int:
        """Bit 0 motor under power, 1 homed, 2 stopping, 3 a limit switch blocks a direction."""
        motion = self.motion
        bits = (motion.powered, motion.homed, motion.stopping, motion.limits.switched)
        return sum(1 << place for place, bit in enumerate(bits) if bit)

    def connection_lost(self, code: int) -> None:
        """React by the abort connection option code 6007h; `code` 0: the master stopped or reset the node."""
        powered = self.motion.powered
        option = self.objects.abort_connection_option_code
        if option == FAULT and (code or powered):
            self.fault(code or CONNECTION_ERROR, emcy.COMMUNICATION)
        elif option == DISABLE_VOLTAGE and powered:
            self._enter(State.SWITCH_ON_DISABLED)
        elif option == QUICK_STOP and self.state is State.OPERATION_ENABLED:
            self._quick_stop()
        elif option == QUICK_STOP and self._releasing:
            self._enter(State.SWITCH_ON_DISABLED)
        self._compose_statusword()

    def process(self) -> None:
        """Act on new process objects; the tick reads the set points."""
        objects = self.objects
        if objects.interpolation_data_record != NO_SET_POINT:
            self.push_set_point(objects.interpolation_data_record)
        if objects.touch_probe_function != self._probes.function:
            self._probes.follow()
            self.port.record["acted_probe_function"] = self._probes.function
        if objects.modes_of_operation != objects.modes_of_operation_display:
            self.motion.select_mode(objects.modes_of_operation)
        record = self.port.record
        if self._wanted_torque_limits() != tuple(record[name] for name in TORQUE_LIMITS):
            self._limit_torque()
        if (objects.physical_outputs, objects.bit_mask) != self.brake.outputs:
            self.brake.follow()
        previous, controlword = int(record["acted_controlword"]), objects.controlword
        if controlword != previous or record["acted_state"] != self.state:
            record["acted_controlword"] = controlword
            self._execute(controlword, previous)
            record["acted_state"] = self.state
            self._compose_statusword()

    def take_set_point(self) -> None:
        """Leave no set point in 60C1h:01."""
        self.objects.interpolation_data_record = NO_SET_POINT

    def push_set_point(self, set_point: int) -> bool:
        """Buffer a set point of interpolated position; return whether there was room."""
        self.take_set_point()
        self.last_set_point = set_point
        return self.motion.interpolated.push(set_point)

    def set_polarity(self) -> None:
        """Follow 607Eh, with the torque limits, which have a sign."""
        self.port.set_polarity(self.objects.polarity)
        self._limit_torque()

    def take_range(self) -> None:
        """Follow the position range limit 607Bh."""
        objects = self.objects
        self.port.take_range(objects.min_position_range_limit, objects.max_position_range_limit)
        self.port.read()

    def limit_speed(self) -> None:
        """Follow the max motor speed 6080h (1/min)."""
        turns_s = self.objects.max_motor_speed / 60.0
        self.motion.limits.motor_speed = turns_s * self.port.counts_per_rev

    def _wanted_torque_limits(self) -> tuple[int, int, int, int]:
        objects = self.objects
        directions = (objects.positive_torque_limit_value, objects.negative_torque_limit_value)
        return objects.max_torque, objects.max_current, *directions

    def _limit_torque(self) -> None:
        limits = self._wanted_torque_limits()
        store_fields(self.port.record, **dict(zip(TORQUE_LIMITS, limits, strict=True)))
        self.port.limit_torque(*limits[:2])
        self.port.limit_direction(*limits[2:])

    # --- the tick ---------------------------------------------------------------------------------

    @property
    def follows_cycle(self) -> bool:
        """Whether its tick is a cyclic mode's and nothing else, as `drives_in_step` has it for all drives."""
        return bool(self.motion.led) and not self._probes.watching and not self.brake.brake.moving

    def lie_in(self, record: NDArray[Any], numbers: Array) -> None:
        """Have record (1,) and objects (values,) in the memory of the bench from now on."""
        numbers[:] = self.objects.numbers
        self.objects.move_to(numbers)
        self.port.lie_in(record, self.objects.records)

    def command_axis(self, dt_s: float, share: float) -> None:
        """Command the axis for the next `dt_s`, which is a `share` of the communication cycle."""
        self.motion.tick(dt_s, share)

    def read_axis(self, dt_s: float) -> None:
        """Read the axis back and supervise it."""
        motion = self.motion
        self.port.read()
        if self.port.switches() != self.objects.digital_inputs:
            motion.read_switches()
        if self._probes.watching:
            self._probes.look()
        if self.brake.brake.moving:
            self.brake.brake.run(self._clock.now_us)
        if motion.powered and motion.check(dt_s):
            self.fault(emcy.FOLLOWING_ERROR, emcy.PROFILE)
        self._compose_statusword()
        motion.limits.active = False

    def _compose_statusword(self) -> None:
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
        """Carry out the transitions that a controlword causes, then its bits for the mode."""
        command = cia402.decode(controlword, previous)
        stays = stopping.quick_stop_stays(self.objects.quick_stop_option_code)
        ramp = self._state_after_ramp is not None and not self.brake.wanted_set
        if ramp and command is Command.ENABLE_OPERATION:
            self._enter(State.OPERATION_ENABLED)  # the ramp is broken off
        if self._releasing and command is Command.SWITCH_ON:
            self._enter(State.SWITCHED_ON)
        found = cia402.transition(self.state, command, stays)
        while found is not None:
            self._carry_out(found)
            if self.state is not found.target:
                break  # a ramp comes first
            found = cia402.transition(self.state, command, stays)
        if self.state is State.OPERATION_ENABLED and self._state_after_ramp is None:
            self.motion.halt(bool(controlword & cia402.HALT))
            self.motion.mode.command(controlword, previous)

    def _carry_out(self, transition: Transition) -> None:
        """Enter the next state; transitions 5, 8 and 11 brake the axis by their option codes first."""
        objects = self.objects
        match transition.number:
            case 4:
                self._release_into(transition.target)
            case 5:
                ramp = stopping.DISABLE_OPERATION[objects.disable_operation_option_code]
                self._brake_into(transition.target, ramp)
            case 8:
                self._brake_into(transition.target, stopping.SHUTDOWN[objects.shutdown_option_code])
            case 11:
                self._quick_stop()
            case 15:
                self.slave.emergency.clear(objects.error_code)
                objects.error_code = 0
                self._enter(transition.target)
            case _:
                self._enter(transition.target)

    @property
    def _releasing(self) -> bool:
        """Whether the axis is held until its brake is released."""
        return self.state is State.SWITCHED_ON and self.motion.powered

    def _enter(self, state: State) -> None:
        """Enter a state and switch power stage and brake accordingly; the caller starts a ramp."""
        self.state = state
        self.port.record["state"] = state
        self._state_after_ramp = None
        if state is State.OPERATION_ENABLED:
            self.brake.order(close=False)
            self.motion.follow()
        elif state not in cia402.POWERED:
            self.brake.order(close=True)
            self.motion.switch_off()

    def _release_into(self, state: State) -> None:
        """Hold the axis while its brake is released, then enter `state`."""
        if self._releasing:
            return
        enter = self.brake.release_then(partial(self._enter, state))
        enter()
        if self.state is not state:
            self.motion.hold(enter)

    def _enter_after(self, event: Event) -> None:
        """Carry out the automatic transition of an event in the drive."""
        self._enter(cia402.TRANSITIONS[self.state, event].target)

    def _brake_into(self, state: State, ramp: Ramp | None) -> None:
        """Enter `state` at the end of `ramp`; None switches the power stage off at once."""
        if ramp is None:
            self._enter(state)
        elif self._state_after_ramp is not state:
            self._state_after_ramp = state
            self.motion.stop(ramp, self.brake.set_then(partial(self._enter, state)))

    def _quick_stop(self) -> None:
        option = self.objects.quick_stop_option_code
        ramp = stopping.QUICK_STOP[option]
        ended = partial(self._enter_after, Event.QUICK_STOP_ENDED)
        self._enter(State.QUICK_STOP_ACTIVE)
        if ramp is None:
            ended()
        else:
            stays = stopping.quick_stop_stays(option)
            if stays:
                self.brake.order(close=False)  # had a ramp before this one already set it
            self.motion.stop(ramp, None if stays else self.brake.set_then(ended))

    def fault(self, code: int, register: int) -> None:
        """Report error `code` and carry out the fault reaction 605Eh."""
        if (self.state, Event.FAULT) not in cia402.TRANSITIONS:
            return
        self.objects.error_code = code
        self.slave.emergency.report(code, register)
        ramp = stopping.FAULT_REACTION[self.objects.fault_reaction_option_code]
        ended = partial(self._enter_after, Event.FAULT_REACTION_ENDED)
        self._enter_after(Event.FAULT)
        if self.motion.powered and ramp is not None:
            self.motion.stop(ramp, self.brake.set_then(ended), in_position_loop=False)
        else:
            ended()
        self._compose_statusword()
