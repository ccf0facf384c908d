"""The motion of an axis under power: it follows its mode of operation, or stops on a ramp.

Faults, halts and limit switches stop it. The attribute `tick` is the method that commands the axis; it is
replaced only if the mode or the state changes.
"""

import math
from collections.abc import Callable
from functools import partial

from hil_sim.cyclic.drive_record import NO_CYCLIC_MODE
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.cyclic_modes import CyclicPosition, CyclicTorque, CyclicVelocity
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.homing import Homing
from hil_sim.drive.interpolated_position import InterpolatedPosition
from hil_sim.drive.mode import TARGET_REACHED, Mode, ModeCode
from hil_sim.drive.profile_modes import ProfilePosition, ProfileVelocity
from hil_sim.drive.profile_torque import ProfileTorque
from hil_sim.drive.stopping import HALT, Ramp, StopRamp
from hil_sim.drive.travel_limits import TravelLimits


class FollowingError:
    """Compares position demand and actual value once a tick: window 6065h, time out 6066h."""

    def __init__(self, objects: DriveObjects, port: AxisPort) -> None:
        self._objects, self._port = objects, port

    def clear(self) -> None:
        """Reset the error: no position loop is closed."""
        self._port.record["outside_us"] = 0
        self._objects.following_error_actual_value = 0

    def check(self, dt_s: float) -> bool:
        """Update 60F4h; return whether the error has been too large for too long."""
        return self._port.check_following(dt_s)


SWITCHES = ((1, -1), (2, 1))  # bit of 60FDh, side of the axis


class Motion:
    """Modes and stops of one axis.

    `powered`: the motor may carry current. `stopping`: a ramp or a hold commands the axis, not its mode.
    """

    def __init__(self, objects: DriveObjects, port: AxisPort) -> None:
        self._objects = objects
        self._port = port
        self.limits = TravelLimits(objects, port)
        self._following = FollowingError(objects, port)
        self._ramp = StopRamp(objects, port)
        self.reset()

    def reset(self) -> None:
        """Return to the state after power-up: power stage off, no mode, not homed."""
        parts = (self._objects, self._port, self.limits)
        self._homing = Homing(*parts)
        self.interpolated = InterpolatedPosition(*parts)
        self.modes: dict[int, Mode] = {
            ModeCode.NONE: Mode(*parts),
            ModeCode.PROFILE_POSITION: ProfilePosition(*parts),
            ModeCode.PROFILE_VELOCITY: ProfileVelocity(*parts),
            ModeCode.PROFILE_TORQUE: ProfileTorque(*parts),
            ModeCode.HOMING: self._homing,
            ModeCode.INTERPOLATED_POSITION: self.interpolated,
            ModeCode.CYCLIC_POSITION: CyclicPosition(*parts),
            ModeCode.CYCLIC_VELOCITY: CyclicVelocity(*parts),
            ModeCode.CYCLIC_TORQUE: CyclicTorque(*parts),
        }
        self.mode = self.modes[ModeCode.NONE]
        for _, side in SWITCHES:
            self.limits.release(side)
        self.switch_off()

    @property
    def homed(self) -> bool:
        """Whether a homing has set the zero of the position."""
        return self._homing.homed

    def switch_off(self) -> None:
        """Switch the power stage off: the axis coasts."""
        self.powered = self.stopping = self._halted = self._halt_commanded = False
        self._on_standstill: Callable[[], None] | None = None
        self.mode.leave()
        self._following.clear()
        self._set_tick(self._idle)
        self._port.power_off()

    def enable(self) -> None:
        """Start the mode of operation: the drive has entered operation enabled."""
        self.powered = True
        self.stopping = self._halted = False
        self._on_standstill = None
        if shift := self._port.move_into_range():
            self.limits.shift(shift)
        self.limits.keep_position_beyond(float(self._port.position))
        self.mode.enter()
        self._set_tick(self.mode.tick, self.mode.cyclic_code)

    def _set_tick(self, tick: Callable[[float, float], None], cyclic_code: int = NO_CYCLIC_MODE) -> None:
        """Let `tick(dt_s, cycle_fraction)` command the axis; `cyclic_code` is that of a cyclic mode."""
        self.tick, self.cyclic_code = tick, cyclic_code
        self._port.record["cyclic_mode"] = cyclic_code

    def select_mode(self, code: int) -> None:
        """Change the mode of operation; an unsupported code changes nothing, as 6061h shows."""
        mode = self.modes.get(code)
        if mode is None:
            return
        self._objects.modes_of_operation_display = code
        self.mode.leave()
        self.mode = mode
        self._following.clear()
        self._objects.digital_inputs = 0  # so that a switch that is still closed after homing blocks its side
        self.read_switches()
        if self.powered and not self.stopping:
            mode.enter()
            self._set_tick(mode.tick, mode.cyclic_code)

    def stop(
        self, ramp: Ramp, on_standstill: Callable[[], None] | None, *, in_position_loop: bool = True
    ) -> None:
        """Brake on `ramp`, then call `on_standstill`; if it is None, hold standstill.

        In PP, IP and HM the position demand follows the ramp in the closed position loop, unless
        `in_position_loop` is false; in the other modes the velocity loop brakes from the actual velocity.
        """
        position, velocity = self._demand(in_position_loop and ramp is not Ramp.LIMIT)
        self._ramp.begin(velocity, self._deceleration(ramp), position)
        self.powered = self.stopping = True
        self._halted = False
        self._on_standstill = on_standstill
        self._set_tick(self._ramp.tick)

    def hold(self, on_standstill: Callable[[], None]) -> None:
        """Hold the present position under power, and call `on_standstill` in every tick from the next on."""
        self._ramp.begin(0.0, math.inf, float(self._port.position))
        self.powered = self.stopping = True
        self._halted = False
        self._on_standstill = on_standstill
        self._set_tick(self._ramp.tick)

    def _demand(self, in_position_loop: bool) -> tuple[float | None, float]:
        """Return the demands to brake from: position (None outside the position loop) and velocity."""
        if self.stopping:  # a stop replaces a stop
            closed = in_position_loop and self._ramp.in_position_loop
            return self._ramp.position if closed else None, self._ramp.velocity
        if in_position_loop and self.mode.generates_motion:
            return self.mode.position, self.mode.velocity
        return None, float(self._objects.velocity_actual_value)

    def _deceleration(self, ramp: Ramp) -> float:
        """Return the deceleration of `ramp` in counts/s^2, within 60C6h."""
        largest = self._objects.max_deceleration
        match ramp:
            case Ramp.LIMIT:
                return math.inf
            case Ramp.QUICK_STOP:
                return min(self._objects.quick_stop_deceleration, largest)
            case Ramp.SLOW_DOWN:
                return min(self.mode.slow_down_deceleration(), largest)

    def halt(self, commanded: bool) -> None:
        """Start or end a halt: bit 8 of the controlword, ramp by 605Dh."""
        self._halt_commanded = commanded
        if commanded and not self.stopping:
            self.stop(HALT[self._objects.halt_option_code], None)
            self._halted = True
        elif self._halted and not commanded:
            self._resume()

    def _resume(self) -> None:
        """Continue the mode at the position at which the stop ended."""
        ramp = self._ramp
        position = ramp.position if ramp.in_position_loop else float(self._port.position)
        self.stopping = self._halted = False
        self._on_standstill = None
        self.mode.resume(position)
        self._set_tick(self.mode.tick, self.mode.cyclic_code)

    def check(self, dt_s: float) -> bool:
        """Supervise the axis after a tick; return whether the following error is a fault."""
        if self.stopping:
            if self._on_standstill is not None and self._ramp.done():
                self._on_standstill()
            return False
        self.mode.check(dt_s)
        return self.mode.position_loop and self._following.check(dt_s)

    def status(self) -> int:
        """Return bits 10, 12 and 13 of the statusword; bit 10 shows the end of a halt or quick stop."""
        if not self.stopping:
            return self.mode.status
        return TARGET_REACHED if self._on_standstill is None and self._ramp.done() else 0

    def read_switches(self) -> None:
        """Read the limit switches. One that closes stops the axis and blocks its side, except in homing."""
        objects = self._objects
        inputs = self._port.switches()
        closed = inputs & ~objects.digital_inputs
        objects.digital_inputs = inputs
        for bit, physical in SWITCHES:
            side = physical * self._port.position_sign
            if not inputs & bit:
                self.limits.release(side)
            elif closed & bit and not self.mode.searches_switches:
                self._block(side)
                if self.powered and not self.stopping:
                    self.stop(Ramp.QUICK_STOP, partial(self._stopped_at_switch, side))

    def _block(self, side: int) -> None:
        self.limits.block(side, float(self._port.position))

    def _stopped_at_switch(self, side: int) -> None:
        if self.limits.blocks(side):  # else the axis stopped before the edge of the switch
            self._block(side)
        self._resume()
        self.halt(self._halt_commanded)

    def _idle(self, dt_s: float, cycle_fraction: float) -> None:
        """Command nothing: the power stage is off."""
