"""One CiA 402 drive on the bus: its services for the slave, and its part of a tick.

The runner calls `command_axis` before and `read_axis` after every advance of the plant; the slave calls
`process` when process objects have changed. `drive_states` carries out the state machine, `motion` the modes
of operation.
"""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from hil_sim.config import AxisPlant, Plant
from hil_sim.cyclic.drive_record import NO_SET_POINT, store_fields
from hil_sim.drive import cia402_device as cia402
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.brake_control import BrakeControl, brake_of
from hil_sim.drive.cia402_device import State
from hil_sim.drive.drive_dictionary import connect_objects, hardware_values
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.drive_states import DriveStates
from hil_sim.drive.mode import BIT_13
from hil_sim.drive.motion import Motion
from hil_sim.drive.temperature_probe import thermometer_of
from hil_sim.drive.touch_probe import TouchProbes
from hil_sim.node import emcy
from hil_sim.node.node_host import NodeHost
from hil_sim.node.sdo_abort import AbortCode, SdoAbort
from hil_sim.node.slave import Slave
from kernels.arrays import Array

TORQUE_LIMITS = ("acted_max_torque", "acted_max_current", "acted_positive_torque", "acted_negative_torque")
"""Fields of the record with the limits in effect: 6072h, 6073h, 60E0h, 60E1h, in per mille."""


class Drive:
    """Amplifier with motor encoder of axis `index` of the plant.

    `inside_eds` describes further objects of the dictionary, see `Dictionary`. Raises what `Slave` raises.
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
        self.slave = Slave(
            config.drive.node_id,
            config.drive.eds,
            objects=self.objects,
            device=self,
            host=host,
            inside_eds=inside_eds,
        )
        self._states = DriveStates(self.objects, self.port, self.motion, self.brake, self.slave.emergency)
        connect_objects(self.slave.dictionary, self)
        self._thermometer = thermometer_of(config, plant, index)
        self.slave.dictionary.readers[0x2012] = lambda _sub: self.guide_temperature()

    @property
    def state(self) -> State:
        """State of the power drive system (CiA 402)."""
        return self._states.state

    def guide_temperature(self) -> int:
        """Return the reading of the thermometer at the guide (0.1 degC). Raises SdoAbort without one."""
        if self._thermometer is None:
            raise SdoAbort(AbortCode.NO_DATA)
        return self._thermometer.counts(self._clock.now_us * 1e-6)

    # --- services for the slave -------------------------------------------------------------------

    def factory_settings(self) -> None:
        """Write the objects that describe motor, encoder, screw and amplifier of the axis."""
        for address, value in self._hardware_values.items():
            self.slave.dictionary.put(*address, value)

    def reset(self) -> None:
        """Power up: not homed, power stage off; the self-test passes at once."""
        self.port.origin = 0
        self.motion.reset()
        self._states.power_up()
        self.brake.reset()
        self.apply_polarity()
        self.limit_speed()
        self._probes.reset()
        self.port.record["acted_probe_function"] = 0
        self.objects.interpolation_data_record = NO_SET_POINT
        self.last_set_point = 0
        self.apply_position_range()
        self.objects.digital_inputs = 0
        self._states.self_test_passed()
        self.motion.read_switches()
        self._compose_statusword()

    def is_idle(self) -> bool:
        """Return whether the motor has no power, so that parameters may be stored."""
        return not self.motion.powered

    def manufacturer_status(self) -> int:
        """Return bits 0 motor under power, 1 homed, 2 stopping, 3 a limit switch blocks a direction."""
        motion = self.motion
        bits = (motion.powered, motion.homed, motion.stopping, motion.limits.switched)
        return sum(1 << place for place, bit in enumerate(bits) if bit)

    def connection_lost(self, code: int) -> None:
        """React by the abort connection option code 6007h; `code` 0: the master stopped or reset the node."""
        self._states.connection_lost(code)
        self._compose_statusword()

    def fault(self, code: int, register: int) -> None:
        """Report error `code` with the bits `register` of 1001h, and carry out the fault reaction 605Eh."""
        if self._states.fault(code, register):
            self._compose_statusword()

    def process(self) -> None:
        """Act on changed process objects; the tick itself reads the set points."""
        objects = self.objects
        if objects.interpolation_data_record != NO_SET_POINT:
            self.push_set_point(objects.interpolation_data_record)
        if objects.touch_probe_function != self._probes.function:
            self._probes.set_function()
            self.port.record["acted_probe_function"] = self._probes.function
        if objects.modes_of_operation != objects.modes_of_operation_display:
            self.motion.select_mode(objects.modes_of_operation)
        record = self.port.record
        if self._torque_limits() != tuple(record[name] for name in TORQUE_LIMITS):
            self._limit_torque()
        if (objects.physical_outputs, objects.bit_mask) != self.brake.outputs:
            self.brake.drive_output()
        previous, controlword = int(record["acted_controlword"]), objects.controlword
        if controlword != previous or record["acted_state"] != self.state:
            record["acted_controlword"] = controlword
            self._execute(controlword, previous)
            record["acted_state"] = self.state
            self._compose_statusword()

    def _execute(self, controlword: int, previous: int) -> None:
        self._states.execute(controlword, previous)

    def clear_set_point(self) -> None:
        """Mark the set point in 60C1h:01 as used, so that the same value can be written again."""
        self.objects.interpolation_data_record = NO_SET_POINT

    def push_set_point(self, set_point: int) -> bool:
        """Buffer a set point of interpolated position (counts); return whether there was room."""
        self.clear_set_point()
        self.last_set_point = set_point
        return self.motion.interpolated.push(set_point)

    def apply_polarity(self) -> None:
        """Apply the polarity 607Eh, and again the torque limits, which have a direction."""
        self.port.set_polarity(self.objects.polarity)
        self._limit_torque()

    def apply_position_range(self) -> None:
        """Apply the position range limit 607Bh."""
        objects = self.objects
        self.port.set_range(objects.min_position_range_limit, objects.max_position_range_limit)
        self.port.read()

    def limit_speed(self) -> None:
        """Apply the max motor speed 6080h (1/min)."""
        turns_s = self.objects.max_motor_speed / 60.0
        self.motion.limits.motor_speed = turns_s * self.port.encoder.counts_per_rev

    def _torque_limits(self) -> tuple[int, int, int, int]:
        """Return the values of the objects, in the order of TORQUE_LIMITS (per mille)."""
        objects = self.objects
        directions = (objects.positive_torque_limit_value, objects.negative_torque_limit_value)
        return objects.max_torque, objects.max_current, *directions

    def _limit_torque(self) -> None:
        limits = self._torque_limits()
        store_fields(self.port.record, **dict(zip(TORQUE_LIMITS, limits, strict=True)))
        self.port.limit_torque(*limits[:2])
        self.port.limit_torque_direction(*limits[2:])

    # --- the tick ---------------------------------------------------------------------------------

    @property
    def follows_set_points(self) -> bool:
        """Whether the drive only follows a cyclic mode: the compiled tick of all drives can serve it."""
        return bool(self.motion.cyclic_code) and not self._probes.watching and not self.brake.brake.moving

    def move_to(self, record: NDArray[Any], numbers: Array) -> None:
        """Move record (1,) and process objects (values,) into these arrays of the bench."""
        numbers[:] = self.objects.numbers
        self.objects.move_to(numbers)
        self.port.move_to(record, self.objects.records)

    def command_axis(self, dt_s: float, cycle_fraction: float) -> None:
        """Command the axis for the next `dt_s`, a fraction `cycle_fraction` of the communication cycle."""
        self.motion.tick(dt_s, cycle_fraction)

    def read_axis(self, dt_s: float) -> None:
        """Read the actual values and supervise the axis over the last `dt_s`."""
        motion = self.motion
        self.port.read()
        if self.port.switches() != self.objects.digital_inputs:
            motion.read_switches()
        if self._probes.watching:
            self._probes.capture()
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
