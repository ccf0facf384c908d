"""One CiA 402 drive on the bus: state machine, modes, stops and faults wired to the axis port.

The runner calls `before` and `after` around every advance of the plant; the slave calls `process` when process
objects have changed. What is done in a tick is one bound method, chosen when state or mode change.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hil_sim.drive import cia402_device as cia402
from hil_sim.drive import stopping
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.cia402_device import State
from hil_sim.drive.drive_dictionary import guard, hardware_values
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.following_error import FollowingError
from hil_sim.drive.homing import Homing
from hil_sim.drive.modes import CyclicPosition, CyclicTorque, CyclicVelocity, Mode, ModeCode
from hil_sim.drive.profile_modes import ProfilePosition, ProfileVelocity
from hil_sim.drive.stopping import Ramp, StopRamp
from hil_sim.drive.travel_limits import TravelLimits
from hil_sim.node import emcy
from hil_sim.node.slave import Slave

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hil_sim.config import AxisPlant, Plant
    from hil_sim.node.nmt import Clock

CONNECTION_ERROR = 0x8100  # communication, generic: the master stopped or reset a node in motion


class Drive:
    """Amplifier with motor encoder of axis `index` of the plant. Raises what `Slave` raises."""

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
        self.limits = TravelLimits(self.objects)
        self.state = State.NOT_READY_TO_SWITCH_ON
        self._config = config
        self._stop = StopRamp(self.objects, self.port)
        self._following = FollowingError(self.objects)
        self._make_modes()
        self._begin_state()
        drive = config.drive
        self.slave = Slave(drive.node_id, drive.eds, self.objects, self, clock, send, state_directory)
        guard(self.slave.dictionary, self)

    def _make_modes(self) -> None:
        parts = (self.objects, self.port, self.limits)
        self.modes: dict[int, Mode] = {
            ModeCode.NONE: Mode(*parts),
            ModeCode.PROFILE_POSITION: ProfilePosition(*parts),
            ModeCode.PROFILE_VELOCITY: ProfileVelocity(*parts),
            ModeCode.HOMING: Homing(*parts),
            ModeCode.CYCLIC_POSITION: CyclicPosition(*parts),
            ModeCode.CYCLIC_VELOCITY: CyclicVelocity(*parts),
            ModeCode.CYCLIC_TORQUE: CyclicTorque(*parts),
        }
        self.mode = self.modes[ModeCode.NONE]

    def _begin_state(self) -> None:
        self._controlword = 0
        self._obeyed_in: State | None = None  # the state in which the controlword was last looked at
        self._tick: Callable[[float, float], None] = self._idle
        self._after_stop: Callable[[], None] | None = None
        self._powered = self._stopping = self._halted = False
        self._torque_limits = (0, 0)  # 6072h and 6073h as given to the port
        self._leaving: State | None = None  # where a ramp of 605Bh or 605Ch leads

    # --- what the slave asks ---------------------------------------------------------------------------------

    def factory_settings(self) -> None:
        """Rating plate and encoder, and torque limits as far as the amplifier goes."""
        for (index, subindex), value in hardware_values(self._config).items():
            self.slave.dictionary.put(index, subindex, value)

    def reset(self) -> None:
        """Power-up: not homed, power off; the self-test passes at once."""
        self.port.off()
        self.port.origin = 0
        self.port.take_polarity(self.objects.polarity)
        self._make_modes()
        self._begin_state()
        self.limits.release(1)
        self.limits.release(-1)
        self._following.clear()
        self._limit_torque()
        self.port.read(self.objects)
        self.objects.digital_inputs = 0
        self._enter(State.SWITCH_ON_DISABLED)
        self._read_switches()
        self._show()

    def is_idle(self) -> bool:
        """Parameters may be stored while the motor has no power."""
        return not self._powered

    def connection_lost(self, code: int) -> None:
        """Abort connection option code 6007h."""
        powered = self._powered
        option = self.objects.abort_connection_option_code
        if option == 1 and (code or powered):
            self.fault(code or CONNECTION_ERROR, emcy.COMMUNICATION)
        elif option == 2 and powered:
            self._enter(State.SWITCH_ON_DISABLED)
        elif option == 3 and self.state is State.OPERATION_ENABLED:
            self._quick_stop()
        self._show()

    def process(self) -> None:
        """Act on a new controlword, mode or torque limit; set points are read in the tick."""
        objects = self.objects
        if objects.modes_of_operation != objects.modes_of_operation_display:
            self._choose_mode(objects.modes_of_operation)
        if (objects.max_torque, objects.max_current) != self._torque_limits:
            self._limit_torque()
        controlword = objects.controlword
        if controlword != self._controlword or self._obeyed_in is not self.state:
            previous, self._controlword = self._controlword, controlword
            self._obey(controlword, previous)
            self._obeyed_in = self.state
            self._show()

    # --- the tick --------------------------------------------------------------------------------------------

    def before(self, dt_s: float, fraction: float) -> None:
        """Command the axis for the next `dt_s`; `fraction` of the advance is over at its end."""
        self._tick(dt_s, fraction)

    def after(self, dt_s: float) -> None:
        """Read the axis back and supervise it."""
        self.port.read(self.objects)
        if self.port.switches() != self.objects.digital_inputs:
            self._read_switches()
        if self._powered:
            self._supervise(dt_s)
        self._show()
        self.limits.active = False

    def _limit_torque(self) -> None:
        self._torque_limits = (self.objects.max_torque, self.objects.max_current)
        self.port.limit_torque(*self._torque_limits)

    def _idle(self, dt_s: float, fraction: float) -> None:
        """Power is off."""

    def _supervise(self, dt_s: float) -> None:
        if self._stopping:
            if self._after_stop is not None and self._stop.done():
                self._after_stop()
            return
        self.mode.check(dt_s)
        if self.mode.position_loop and self._following.check(dt_s):
            self.fault(emcy.FOLLOWING_ERROR, emcy.PROFILE)

    def _show(self) -> None:
        """Compose the statusword."""
        word = self.state | cia402.VOLTAGE_ENABLED | cia402.REMOTE
        if self.state is State.OPERATION_ENABLED:
            if self._stopping:
                word |= cia402.TARGET_REACHED if self._halted and self._stop.done() else 0
            else:
                word |= self.mode.status
        if self.limits.active or self.limits.switched:
            word |= cia402.INTERNAL_LIMIT
        self.objects.statusword = word

    # --- states ----------------------------------------------------------------------------------------------

    def _obey(self, controlword: int, previous: int) -> None:
        command = cia402.decode(controlword, previous)
        stays = stopping.quick_stop_stays(self.objects.quick_stop_option_code)
        if self._leaving is not None and command is cia402.Command.ENABLE_OPERATION:
            self._enter(State.OPERATION_ENABLED)
        found = cia402.transition(self.state, command, stays)
        while found is not None:
            self._go(found)
            if self.state is not found.target:
                break  # a ramp comes first
            found = cia402.transition(self.state, command, stays)
        if self.state is State.OPERATION_ENABLED and self._leaving is None:
            self._halt(bool(controlword & cia402.HALT))
            self.mode.command(controlword, previous)

    def _go(self, found: cia402.Transition) -> None:
        objects = self.objects
        if found.number == 5:
            self._leave(found.target, stopping.DISABLE_OPERATION[objects.disable_operation_option_code])
        elif found.number == 8:
            self._leave(found.target, stopping.SHUTDOWN[objects.shutdown_option_code])
        elif found.number == 11:
            self._quick_stop()
        else:
            if found.number == 15:
                self._clear_fault()
            self._enter(found.target)

    def _enter(self, state: State) -> None:
        self.state = state
        self._powered = state in cia402.POWERED
        self._stopping = self._halted = False
        self._after_stop = self._leaving = None
        if state is State.OPERATION_ENABLED:
            self.mode.enter()
            self._tick = self.mode.tick
        elif not self._powered:
            self.mode.leave()
            self._following.clear()
            self._tick = self._idle
            self.port.off()

    def _leave(self, target: State, ramp: Ramp | None) -> None:
        if ramp is None:
            self._enter(target)
        elif self._leaving is not target:
            self._leaving = target
            self._begin_stop(ramp, lambda: self._enter(target))

    def _quick_stop(self) -> None:
        option = self.objects.quick_stop_option_code
        ramp = stopping.QUICK_STOP[option]
        if ramp is None:
            self._enter(State.SWITCH_ON_DISABLED)
            return
        self._enter(State.QUICK_STOP_ACTIVE)
        stays = stopping.quick_stop_stays(option)
        self._begin_stop(ramp, None if stays else lambda: self._enter(State.SWITCH_ON_DISABLED))

    def fault(self, code: int, register: int) -> None:
        """Report error `code` and carry out the fault reaction 605Eh."""
        if self.state in {State.FAULT, State.FAULT_REACTION_ACTIVE}:
            return
        self.objects.error_code = code
        self.slave.emergency.report(code, register)
        ramp = stopping.FAULT_REACTION[self.objects.fault_reaction_option_code]
        if self._powered and ramp is not None:
            self._enter(State.FAULT_REACTION_ACTIVE)
            self._begin_stop(ramp, lambda: self._enter(State.FAULT), in_position_loop=False)
        else:
            self._enter(State.FAULT)

    def _clear_fault(self) -> None:
        self.slave.emergency.clear(self.objects.error_code)
        self.objects.error_code = 0

    # --- stops and modes -------------------------------------------------------------------------------------

    def _begin_stop(
        self, ramp: Ramp, after: Callable[[], None] | None, *, in_position_loop: bool = True
    ) -> None:
        objects = self.objects
        if ramp is Ramp.LIMIT:
            deceleration = math.inf
        elif ramp is Ramp.QUICK_STOP:
            deceleration = min(objects.quick_stop_deceleration, objects.max_acceleration)
        else:
            homing = isinstance(self.mode, Homing)
            chosen = objects.homing_acceleration if homing else objects.profile_deceleration
            deceleration = min(chosen, objects.max_acceleration)
        demanded = isinstance(self.mode, (ProfilePosition, Homing)) and in_position_loop
        if self._stopping:  # a stop replaces a stop: go on from its demand
            velocity = self._stop.velocity
            position = self._stop.position if self._stop.in_position_loop and in_position_loop else None
        else:
            velocity = self.mode.velocity if demanded else float(objects.velocity_actual_value)
            position = self.mode.position if demanded and ramp is not Ramp.LIMIT else None
        self._stop.begin(velocity, deceleration, position)
        self._stopping = True
        self._after_stop = after
        self._tick = self._stop.tick

    def _halt(self, wanted: bool) -> None:
        if wanted and not self._stopping:
            self._halted = True
            self._begin_stop(stopping.HALT[self.objects.halt_option_code] or Ramp.SLOW_DOWN, None)
        elif self._halted and not wanted:
            self._resume()

    def _resume(self) -> None:
        """Back from a stop to the mode, from where the axis is."""
        stop = self._stop
        here = stop.position if stop.in_position_loop else float(self.objects.position_actual_value)
        self._stopping = self._halted = False
        self._after_stop = None
        self.mode.resume(here)
        self._tick = self.mode.tick

    def _choose_mode(self, code: int) -> None:
        mode = self.modes.get(code)
        if mode is None:
            return  # 6061h goes on showing the mode that is active
        self.objects.modes_of_operation_display = code
        self.mode.leave()
        self.mode = mode
        if self._powered and not self._stopping:
            mode.enter()
            self._tick = mode.tick

    def _read_switches(self) -> None:
        objects = self.objects
        inputs = self.port.switches()
        fresh = inputs & ~objects.digital_inputs
        objects.digital_inputs = inputs
        for bit, physical in ((1, -1), (2, 1)):
            direction = physical * self.port.position_sign
            if not inputs & bit:
                self.limits.release(direction)
            elif fresh & bit and not isinstance(self.mode, Homing):
                self.limits.block(direction, float(objects.position_actual_value))
                if self.state is State.OPERATION_ENABLED and not self._stopping:
                    self._begin_stop(Ramp.QUICK_STOP, lambda side=direction: self._stopped_at_switch(side))

    def _stopped_at_switch(self, direction: int) -> None:
        self.limits.block(direction, float(self.objects.position_actual_value))
        self._resume()
