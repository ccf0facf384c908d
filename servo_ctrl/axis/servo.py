"""One axis in the daemon: inputs -> sequence and control law -> set points.

A shell around two pure functions (`drive.advance`, `control.tick.axis_tick`), which keeps their states.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.records import Pool, flat_layout, record_type, store
from servo_ctrl.axis import drive
from servo_ctrl.axis.axis_watch import AxisWatch
from servo_ctrl.axis.drive import COASTS_M_S, HOMED, UNDER_CONTROL, Phase, Route, advance, begin, home
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.inputs import AxisInputs
from servo_ctrl.axis.set_points import TORQUE_OFFSET, SetPoints
from servo_ctrl.canopen.cia402 import MODE_OF_NAME, Mode
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.axis_record import AxisRecord, axis_records, tick_axes
from servo_ctrl.control.set_point_counts import SetPointUnits
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.control.types import AxisCommand
from servo_ctrl.motion.profile import Motion
from servo_ctrl.recording.channels import AxisRow

REFERENCE_FIELDS = len(Motion._fields)
"""Set points of an axis in a reference row: the fields of `Motion`, in its order."""
_RECORD = record_type(AxisRecord)
_GIVEN, _GIVEN_AT = flat_layout(_RECORD, ["sample", "current_a"])
"""Numbers of the record of an axis that a tick is given, and where they begin."""
_MADE, _MADE_AT = flat_layout(_RECORD, ["command", "counts", "signs"])
"""Those that it makes."""
_COMMAND_FIELDS = len(AxisCommand._fields)
_NOT_LED = AxisRow._make([math.nan] * len(AxisRow._fields))


class AxisServo:
    """The axis called `name`. Positions in metres at the table, relative to home."""

    def __init__(
        self,
        name: str,
        config: AxisConfig,
        params: AxisParams,
        *,
        rpdo: PdoCodec,
        tpdo: PdoCodec,
        scale_tpdo: PdoCodec | None,
        further_rpdos: Sequence[PdoCodec] = (),
        further_tpdos: Sequence[PdoCodec] = (),
    ) -> None:
        """`further_tpdos`: come with every SYNC too; `step` is given their values behind those of `tpdo`."""
        self.name = name
        self.params = params
        self.hold_m = 0.0
        """Position at which the axis was taken over; its set point until a program runs."""
        self.events: list[tuple[Event, str]] = []
        """Of the last step; the machine takes them."""
        self.row = _NOT_LED
        """Of the last step, for the recording; NaN where there is no value."""
        self.homed = False
        """Its homing has come to its end."""
        self.input_age: Callable[[], int] = lambda: 0
        """How many cycles old the last inputs of drive or scale may be, as many came late."""
        self.power_allowed: Callable[[], bool] = lambda: True
        """Whether a drive that is without power may get it yet."""
        self.error_code: int | None = None
        """Of the last emergency message of its drive, until that reports a reset or is switched on."""
        mode = MODE_OF_NAME[config.mode]
        self.route = Route(
            mode,
            config.homing_method != 0,
            params.period_s,
            mode_switch_disabled=config.drive.mode_switch == "disabled",
            homed_by_bit_12=config.drive.homing_bits == "12",
        )
        self.sequence: drive.Sequence = begin(self.route)
        self.inputs = AxisInputs(config, (tpdo, *further_tpdos), scale_tpdo)
        unit = self.inputs.unit
        self._newton_per_ampere = unit.newton_per_ampere
        self._engaged = False
        self._slow_m = COASTS_M_S * params.period_s + abs(unit.metre_per_count)
        self._last_m = 0.0
        """The last motor position that came."""
        self._periods_without = 0
        """Periods since then."""
        self._axes: NDArray[Any]
        self._tables: Pool
        self._set_points = SetPoints((rpdo, *further_rpdos))
        self.watch = AxisWatch(name, config, unit, params.period_s)
        self._units = SetPointUnits(
            unit.newton_per_permille,
            unit.metre_per_count,
            unit.metre_per_s_per_unit,
            offset_apart=any(codec.position(TORQUE_OFFSET) is not None for codec in (rpdo, *further_rpdos)),
            velocity_offset=mode is Mode.CYCLIC_SYNC_POSITION,
        )
        self._begin_at(0.0)

    @property
    def further_payloads(self) -> list[bytes]:
        """Of the RPDOs from 2 on, by the last step."""
        return self._set_points.further

    @property
    def ready(self) -> bool:
        """The loop leads the axis and it has settled."""
        return self.sequence.phase is Phase.SERVO

    @property
    def off(self) -> bool:
        """The drive is without power, as far as anyone can know."""
        return self.sequence.phase in {Phase.OFF, Phase.LOST}

    def begin_again(self) -> None:
        """Switch the drive on once more, whatever has happened to it; its home stays where it is."""
        self.sequence = begin(self.route, homed=self.homed)
        self.error_code = None
        self.watch.begin()

    def home(self) -> None:
        """Let the drive look for its home once more; then the axis is taken over where it is."""
        self.sequence = home()
        self.homed = False

    def warm_up(self) -> None:
        """Compile or load the kernel before the first SYNC: it takes seconds, a cycle takes a millisecond."""
        tick_axes(self._axes.copy(), self._tables)

    def step(
        self, drive: tuple[int, ...] | None, scale: tuple[int, ...] | None, reference: list[float] | None
    ) -> bytes:
        """Advance by one cycle; return the payload of RPDO 1, as `further_payloads` has those of the others.

        `drive`, `scale`: inputs of this cycle, None = missing; `reference`: `REFERENCE_FIELDS` of this
        axis, None = stay where the axis was taken over.
        """
        inputs = self.inputs
        whole = inputs.take(drive, scale)
        age = 0 if self.sequence.phase is Phase.SERVO else self.input_age()
        taken = advance(
            self.route,
            self.sequence,
            inputs.statusword,
            whole=whole,
            age=age,
            rests=self._at_rest,
            mode_shown=inputs.mode_shown,
        )
        if self.sequence.phase is Phase.HOMING and taken.sequence.phase in HOMED:
            self.homed = True
        self.sequence = taken.sequence
        if taken.problem:
            self.events.append((Event.DRIVE_FAULT, f"axis {self.name}: the drive {taken.problem}"))
        led = taken.sequence.phase in UNDER_CONTROL
        if led and not self._engaged:
            self._take_over()
        self._engaged = led
        if led:
            counts = self._control(reference or [self.hold_m, 0.0, 0.0, 0.0])
            return self._set_points.led(taken, counts)
        self.row = _NOT_LED._replace(
            motor_position_m=inputs.motor_m,
            scale_position_m=inputs.scale_m,
            motor_current_a=inputs.current_a,
            statusword=inputs.statusword,
        )
        if taken.sequence.phase is Phase.QUICK_STOPPING:
            self.events += self.watch.braked(inputs.motor_m)
        return self._set_points.neutral(taken, inputs.counts)

    def closed_switch(self, inputs: int) -> str:
        """Take the digital inputs (60FDh); return which limit switch has closed while we lead, or ""."""
        return self.watch.closed_switch(inputs, led=self.sequence.phase in UNDER_CONTROL)

    def change_params(self, params: AxisParams) -> None:
        """Let another compensation act from the next cycle on; the loop goes on where it is."""
        self.params = params
        self._tables = store(self._axes["params"], [params])

    def pass_missed(self, cycles: int) -> None:
        """Let periods go by that had no SYNC."""
        self._periods_without += cycles

    def _at_rest(self) -> bool:
        """Whether it may be given power: allowed, and two positions in a row differ as little as at rest."""
        step_m = self.inputs.motor_m - self.inputs.previous_motor_m
        return self.power_allowed() and abs(step_m) <= self._slow_m

    def _take_over(self) -> None:
        """Lead the axis where it is."""
        self.hold_m = self._last_m = self.inputs.motor_m
        self._periods_without = 0
        self.inputs.align_scale()
        self._begin_at(self.hold_m)
        self.watch.begin(self.hold_m)

    def _begin_at(self, motor_m: float) -> None:
        """Begin the control law at rest."""
        self._axes, self._tables = axis_records([self.params], [motor_m], [self._units], [self.watch.limits])
        self._memory = self._axes.view(np.uint8).data
        self._correction_m = 0.0

    def _control(self, reference: list[float]) -> tuple[int, ...]:
        """One tick of an axis that we lead: its row, its events, and the values of its `SetPointCounts`."""
        inputs = self.inputs
        motor_m, scale_m, current_a = inputs.motor_m, inputs.scale_m, inputs.current_a
        if math.isnan(motor_m):
            self._periods_without += 1
        else:
            if self._periods_without:
                self._bridge_gap(motor_m)
            self._last_m = motor_m
            led_m = motor_m - self._correction_m
            if not self.watch.lowest_m <= led_m <= self.watch.highest_m:
                self.events += self.watch.beyond(led_m)
        force_n = current_a * self._newton_per_ampere
        _GIVEN.pack_into(self._memory, _GIVEN_AT, *reference, motor_m, scale_m, force_n, current_a)
        tick_axes(self._axes, self._tables)
        made = _MADE.unpack_from(self._memory, _MADE_AT)
        command, seen = AxisCommand._make(made[:_COMMAND_FIELDS]), made[-1]
        self._correction_m = command.correction_m
        if command.status or seen:
            self.events += self.watch.led(command, seen, motor_m, scale_m, current_a, self.input_age)
        else:
            self.watch.led_well()
        self.row = AxisRow._make(
            (
                command.position_m,
                reference[1],
                motor_m,
                scale_m,
                command.motor_velocity_m_s,
                command.force_n,
                current_a,
                command.position_error_m,
                command.pulse_m_s,
                command.disturbance_n,
                command.correction_m,
                inputs.statusword,
            )
        )
        return made[_COMMAND_FIELDS:-1]

    def _bridge_gap(self, motor_m: float) -> None:
        """Put the mean velocity over periods without a motor position into the velocity estimate.

        Extrapolation to where the motor was a period ago would be off by a T^2 n^2 / 2 after n of them, and
        the velocity loop would take that, over one period, for a velocity. The observer leaves the gap out.
        """
        step_m = (motor_m - self._last_m) / (self._periods_without + 1)
        state = self._axes["state"][0]
        state["velocity_loop"]["position_1_m"] = motor_m - step_m
        state["velocity_loop"]["position_2_m"] = motor_m - 2.0 * step_m
        state["observer"]["velocity_m_s"] = math.nan
        state["position_loop"]["error_m"] = math.nan
        self._periods_without = 0
