"""One CiA 406 linear grating scale on the bus: counts from power-up, preset, speed, reference mark."""

from typing import Any

from numpy.typing import NDArray

from hil_sim.config import AxisPlant, Plant
from hil_sim.cyclic.scale_step import LARGEST_I16, read_scales, scale_records
from hil_sim.node.node_host import NodeHost
from hil_sim.node.sdo_abort import AbortCode, SdoAbort
from hil_sim.node.slave import Slave
from hil_sim.plant.measured_point import velocity_field
from hil_sim.scale.cams import Cams
from hil_sim.scale.scale_objects import ScaleObjects
from kernels.arrays import Array

REVERSED = 1 << 3
"""Bit "measuring direction" of the operating parameters 6000h: counts fall in positive direction."""
ACCELERATION_UNIT_M_S2 = 1e-3
"""Unit of the acceleration value 6040h."""
OPERATING_TIME_UNIT_US = 360_000_000
"""Unit of the operating time 6508h, 0.1 h."""


class LinearScale:
    """Reading head at the measured point of axis `index` of the plant.

    Raises:
        ValueError: the axis has no scale; and what `Slave` raises.
    """

    profile = 406

    def __init__(self, config: AxisPlant, plant: Plant, index: int, host: NodeHost) -> None:
        scale = config.scale
        if scale is None:
            raise ValueError("this axis has no scale")
        self.objects = ScaleObjects()
        self.objects.head = self
        self._clock = host.clock
        self._read_us, self._read_m_s, self._acceleration = 0, 0.0, 0  # at the last read of the acceleration
        self._resolution_nm = round(scale.resolution_um * 1e3)
        mark_counts = round(scale.reference_mark_mm * 1e3 / scale.resolution_um)
        self._state: Any = plant.state[index]
        self._all_states = plant.state
        self._velocity_field = velocity_field(plant.params[index])
        self.has_cams = False
        """Whether any cam is enabled."""
        record = scale_records(1)
        record["axis"], record["carried"] = index, self._velocity_field == "carried_velocity_m_s"
        record["mark"] = mark_counts - int(self._state["scale_origin_counts"])
        record["raw"] = self._state["scale_counts"]
        self.record: Any = record[0]
        """A `ScaleRecord`."""
        self._records, self._own = record, self.objects.records
        self.slave = Slave(scale.node_id, scale.eds, self.objects, self, host)
        dictionary = self.slave.dictionary
        dictionary.followers[0x6003] = lambda _sub: self._preset(self.objects.preset_value)
        dictionary.followers[0x6010] = lambda _sub: self._preset(self.objects.preset_value_channel_1)
        dictionary.readers[0x6508] = lambda _sub: self._clock.now_us // OPERATING_TIME_UNIT_US
        dictionary.readers[0x650B] = lambda _sub: self.slave.identity()[-1]
        self._cams = Cams(dictionary, self._apply_cams)
        dictionary.checks[0x6000] = _check_parameters
        dictionary.followers[0x6000] = lambda _sub: self._reverse_direction()
        dictionary.readers[0x6500] = lambda _sub: self.objects.operating_parameters
        # the cyclic timer 6200h is the event timer of the first TPDO
        dictionary.readers[0x6200] = lambda _sub: dictionary.value(0x1800, 5)
        dictionary.checks[0x6200] = lambda _sub, ms: dictionary.set_data(0x1800, 5, ms.to_bytes(2, "little"))

    # --- services for the slave ----------------------------------------------------------------------

    def factory_settings(self) -> None:
        """Write the measuring step of the grating (nm)."""
        self.slave.dictionary.put(0x6005, 1, self._resolution_nm)
        self.slave.dictionary.put(0x6501, 0, self._resolution_nm)

    def reset(self) -> None:
        """Power up: the position starts at 0, the head has passed no reference mark."""
        self.record["offset"], self.record["sign"] = 0, self._chosen_sign()
        self._apply_cams()

    def process(self) -> None:
        """Do nothing: a scale receives no PDOs."""

    def connection_lost(self, code: int) -> None:
        """Do nothing: a scale continues to measure."""

    def is_idle(self) -> bool:
        """Return True: parameters may always be stored."""
        return True

    def manufacturer_status(self) -> int:
        """Return bit 0 set once the head has passed the reference mark since power-up."""
        return int(self.objects.reference_mark_passages > 0)

    # --- the tick ---------------------------------------------------------------------------------

    @property
    def frozen(self) -> bool:
        """Whether the head has stopped reading (`faults.broken_scale`)."""
        return bool(self.record["frozen"])

    @frozen.setter
    def frozen(self, frozen: bool) -> None:
        self.record["frozen"] = frozen

    def move_to(self, record: NDArray[Any], numbers: Array) -> None:
        """Move record (1,) and process objects (values,) into these arrays of the bench."""
        numbers[:] = self.objects.numbers
        self.objects.move_to(numbers)
        record[0] = self.record
        self.record, self._records, self._own = record[0], record, self.objects.records

    def read_axis(self) -> None:
        """Update position and speed from the plant; `bench_scales` does it for all scales at once."""
        read_scales(self._records, self._own, self._all_states)
        self.switch_cams()

    def switch_cams(self) -> None:
        """Update the cam state register from the position if any cam is enabled."""
        if self.has_cams and not self.frozen:
            self.objects.cam_state_channel_1 = self._cams.state(self.objects.position_value)

    def acceleration(self) -> int:
        """Return the mean acceleration since the last call (mm/s^2); a mapped PDO calls in every cycle."""
        now_us = self._clock.now_us
        if now_us != self._read_us:
            velocity_m_s = int(self.record["sign"]) * float(self._state[self._velocity_field])
            since_s = (now_us - self._read_us) * 1e-6
            acceleration = round((velocity_m_s - self._read_m_s) / since_s / ACCELERATION_UNIT_M_S2)
            self._acceleration = max(-LARGEST_I16, min(LARGEST_I16, acceleration))
            self._read_us, self._read_m_s = now_us, velocity_m_s
        return self._acceleration

    def _apply_cams(self) -> None:
        """Apply the objects of the cams."""
        self._cams.apply_objects()
        self.has_cams = self._cams.any_enabled
        self.objects.cam_state_channel_1 = 0
        self.read_axis()

    def _preset(self, value: int) -> None:
        """Set the offset so that the present position reads `value` (counts)."""
        record = self.record
        record["offset"] = self.objects.offset_value = value - int(record["sign"] * record["raw"])
        self.read_axis()

    def _reverse_direction(self) -> None:
        """Apply the measuring direction of 6000h; the present position keeps its value."""
        sign = self._chosen_sign()
        record = self.record
        record["offset"] += (record["sign"] - sign) * record["raw"]
        record["sign"] = sign
        self.read_axis()

    def _chosen_sign(self) -> int:
        return -1 if self.objects.operating_parameters & REVERSED else 1


def _check_parameters(_subindex: int, value: int) -> None:
    """Refuse all bits but the measuring direction: code sequence and scaling are for other encoders."""
    if value not in {0, REVERSED}:
        raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
