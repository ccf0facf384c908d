"""Machine file + EDS files -> what boot does to every node. Pure: `servo-ctrl check` runs it offline."""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from servo_ctrl.canopen.cia402 import MODE_OF_NAME, SUPPORTED_BIT, Mode
from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.canopen.pdo import STRUCT_FORMATS, PdoCodec, compile_pdo
from servo_ctrl.canopen.settings import Setting, common_settings, drive_settings
from servo_ctrl.canopen.stack import Eds, load_eds
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.config.node_model import Drive, Scale
from servo_ctrl.errors import ConfigError

PRODUCED = (0x6040, 0x6060, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60FF)
"""Objects the controller has a value for every cycle; nothing else may be in an RPDO."""
SYNCHRONOUS = 1
UNIT_COUNT, UNIT_COUNT_PER_SECOND = 0x00B5_0000, 0x00B5_0300
"""SI unit objects 60A8h, 60A9h (CiA 303-2): B5h increments, 03h second; a drive in rpm has 00B44700h."""
RPDO_1, TPDO_1, TPDO_2 = 0x1400, 0x1800, 0x1801
"""Communication parameters (CiA 301); TPDO 2 carries the limit switches."""
COB_ID_BASE = {0x1400: 0x200, 0x1800: 0x180}
"""Pre-defined connection set: of PDO 1 by its communication parameter; each that follows has 100h more."""
PDOS = 4
"""PDOs of either direction in that set."""


@dataclass(frozen=True, slots=True)
class Write:
    """One SDO download; `data` is little-endian, `what` names it for the error message."""

    index: int
    subindex: int
    data: bytes
    what: str


@dataclass(frozen=True, slots=True)
class Expectation:
    """One SDO upload and what it must give; `key` is the machine file's word for it."""

    index: int
    subindex: int
    value: int
    key: str
    mask: int = -1
    """Bits that are compared."""


@dataclass(frozen=True, slots=True)
class PdoPlan:
    """One PDO of a node. `communication` is the index of its communication parameter."""

    communication: int
    cob_id: int
    transmission_type: int
    codec: PdoCodec

    @property
    def mapping(self) -> int:
        """Index of its mapping parameter."""
        return self.communication + 0x200


@dataclass(frozen=True, slots=True)
class NodePlan:
    """All that boot does to one node; `key` is its section in the machine file, e.g. "axis.x.drive"."""

    key: str
    node_id: int
    eds: Eds
    pdos: tuple[PdoPlan, ...]
    unused_pdos: tuple[tuple[int, int], ...]
    """(communication index, COB-ID) of the node's other PDOs, which are switched off."""
    expectations: tuple[Expectation, ...]
    writes: tuple[Write, ...]

    @property
    def name(self) -> str:
        """How messages name the node, as "axis.x.drive (node 1)"."""
        return f"{self.key} (node {self.node_id})"

    @property
    def tpdo(self) -> PdoPlan:
        """What the node sends us every cycle."""
        return next(pdo for pdo in self.pdos if pdo.communication == TPDO_1)

    @property
    def switches(self) -> PdoPlan | None:
        """What brings the limit switches of a drive, where they are read."""
        return next((pdo for pdo in self.pdos if pdo.communication == TPDO_2), None)

    @property
    def rpdo(self) -> PdoPlan:
        """What we send the node every cycle (drives)."""
        return next(pdo for pdo in self.pdos if pdo.communication == RPDO_1)


def plan_machine(machine: MachineConfig) -> tuple[NodePlan, ...]:
    """The boot plan of every node, in order of axes, the drive before the scale.

    Raises ConfigError naming the machine file and the key: EDS absent or unreadable, unknown PDO name,
    an object we have no value for, a mode the drive does not have, a limit its integers cannot hold.
    """
    plans = []
    for name, axis in machine.axes.items():
        plans.append(_drive_plan(machine, f"axis.{name}", axis))
        if axis.scale is not None:
            plans.append(_scale_plan(machine, f"axis.{name}.scale", axis.scale))
    return tuple(plans)


class _Planner:
    """Plans one node. Raises ConfigError naming the machine file and a key below `key`."""

    def __init__(self, machine: MachineConfig, key: str, node: Drive | Scale) -> None:
        self._machine, self._key, self._node = machine, key, node
        try:
            self.eds = load_eds(node.eds, node.node_id)
        except EdsError as error:
            raise ConfigError(machine.source, f"{key}.eds", str(error)) from None

    def pdo(self, communication: int, key: str, names: Iterable[str], transmission_type: int) -> PdoPlan:
        """A PDO of these objects, which the file has under `key`."""
        first = communication & ~0xFF
        try:
            codec = compile_pdo(self.eds, names, receive=first == RPDO_1)
        except EdsError as error:
            raise ConfigError(self._machine.source, f"{self._key}.{key}", str(error)) from None
        cob_id = _cob_id(communication, self._node.node_id)
        return PdoPlan(communication, cob_id, transmission_type, codec)

    def tpdo(self) -> PdoPlan:
        """TPDO 1, which comes with every SYNC."""
        if self._node.tpdo_transmission_type != SYNCHRONOUS:
            reason = "must be 1: every cycle waits for every node's inputs"
            raise ConfigError(self._machine.source, f"{self._key}.tpdo_transmission_type", reason)
        return self.pdo(TPDO_1, "tpdo1", self._node.tpdo1, SYNCHRONOUS)

    def plan(
        self, pdos: tuple[PdoPlan, ...], expectations: Iterable[Expectation], settings: Iterable[Setting]
    ) -> NodePlan:
        """The whole plan. What the EDS has no entry for is neither expected nor written."""
        used = {pdo.communication for pdo in pdos}
        spare = [first + number for first in COB_ID_BASE for number in range(1, PDOS)]
        return NodePlan(
            key=self._key,
            node_id=self._node.node_id,
            eds=self.eds,
            pdos=pdos,
            unused_pdos=tuple(
                (index, _cob_id(index, self._node.node_id))
                for index in spare
                if index not in used and (index, 1) in self.eds
            ),
            expectations=tuple(one for one in expectations if (one.index, one.subindex) in self.eds),
            writes=tuple(self._writes(settings)),
        )

    def _writes(self, settings: Iterable[Setting]) -> Iterator[Write]:
        """The settings in the types of the EDS; a drive without limits keeps to ours."""
        for index, subindex, value, what in settings:
            variable = self.eds.variables.get((index, subindex))
            if variable is None or variable.data_type not in STRUCT_FORMATS:
                continue
            try:
                data = struct.pack("<" + STRUCT_FORMATS[variable.data_type], value)
            except struct.error:
                reason = f"{what} would be {value}, which {index:04X}h of {self.eds.path} cannot hold"
                raise ConfigError(self._machine.source, self._key, reason) from None
            yield Write(index, subindex, data, what)


def _cob_id(communication: int, node_id: int) -> int:
    """The COB-ID that the pre-defined connection set has for a PDO."""
    first, number = communication & ~0xFF, communication & 0xFF
    return COB_ID_BASE[first] + 0x100 * number + node_id


def _drive_plan(machine: MachineConfig, axis_key: str, axis: AxisConfig) -> NodePlan:
    drive, key = axis.drive, f"{axis_key}.drive"
    planner = _Planner(machine, key, drive)
    rpdo = planner.pdo(RPDO_1, "rpdo1", drive.rpdo1, drive.rpdo_transmission_type)
    _check_rpdo(machine, axis_key, axis, rpdo.codec)
    modes = [MODE_OF_NAME[axis.mode]] + ([Mode.HOMING] if axis.homing_method else [])
    mask = sum(1 << SUPPORTED_BIT[mode] for mode in modes)
    announced = planner.eds.default(0x6502)
    if announced is not None and announced & mask != mask:
        reason = f"{planner.eds.path} (6502h) has no mode {axis.mode} or no homing"
        raise ConfigError(machine.source, f"{axis_key}.mode", reason)
    pdos = [rpdo, planner.tpdo()]
    if drive.limit_switch_syncs:
        pdos.append(planner.pdo(TPDO_2, "limit_switch_syncs", ["0x60FD:00"], drive.limit_switch_syncs))
    expectations = (
        Expectation(0x608F, 1, drive.counts_per_rev, f"{key}.counts_per_rev"),
        Expectation(0x608F, 2, 1, f"{key}.counts_per_rev (motor revolutions)"),
        *_counts(key, drive.counts_per_rev),
        Expectation(0x6075, 0, drive.rated_current_ma, f"{key}.rated_current_ma"),
        Expectation(0x6076, 0, drive.rated_torque_mnm, f"{key}.rated_torque_mnm"),
        Expectation(0x6502, 0, mask, f"{axis_key}.mode", mask),
    )
    settings = (*common_settings(machine), *drive_settings(machine, axis_key, axis))
    return planner.plan(tuple(pdos), expectations, settings)


def _counts(key: str, counts_per_rev: int) -> Iterator[Expectation]:
    """That the drive speaks in counts and counts/s: gear, feed and unit objects, where it has them.

    A drive that is scaled in rpm or micrometres would take our set points for others.
    """
    gear, unit = f"{key} (no gear and no velocity factor in the drive)", f"{key} (set points are counts)"
    for index in (0x6091, 0x6096):
        yield Expectation(index, 1, 1, gear)
        yield Expectation(index, 2, 1, gear)
    yield Expectation(0x6092, 1, counts_per_rev, f"{key}.counts_per_rev (feed constant in counts)")
    yield Expectation(0x6092, 2, 1, f"{key}.counts_per_rev (feed constant in counts)")
    yield Expectation(0x60A8, 0, UNIT_COUNT, unit)
    yield Expectation(0x60A9, 0, UNIT_COUNT_PER_SECOND, unit)


def _check_rpdo(machine: MachineConfig, axis_key: str, axis: AxisConfig, rpdo: PdoCodec) -> None:
    """Refuse an object that we have no value for, and an object that is missing where we have one."""
    key = f"{axis_key}.drive.rpdo1"
    for mapped in rpdo.objects:
        if mapped.index not in PRODUCED:
            reason = f"{mapped.name} is nothing the controller computes every cycle"
            raise ConfigError(machine.source, key, reason)
    if axis.homing_method and rpdo.position(0x6060) is None:
        reason = "modes_of_operation is missing; homing switches the mode over the PDO"
        raise ConfigError(machine.source, key, reason)
    # Where the amplifier closes a loop, feedforward reaches it as an offset of its own or not at all.
    control, csv, csp = axis.control, "csv", "csp"
    for gain, value, modes, index, name in (
        (
            "acceleration_feedforward_kg",
            control.acceleration_feedforward_kg,
            {csv, csp},
            0x60B2,
            "torque_offset",
        ),
        ("velocity_feedforward", control.velocity_feedforward, {csp}, 0x60B1, "velocity_offset"),
    ):
        if value > 0.0 and axis.mode in modes and rpdo.position(index) is None:
            reason = (
                f'mode {axis.mode} needs "{name}" in drive.rpdo1 for it; without room there, set it to 0.0'
            )
            raise ConfigError(machine.source, f"{axis_key}.control.{gain}", reason)


def _scale_plan(machine: MachineConfig, key: str, scale: Scale) -> NodePlan:
    planner = _Planner(machine, key, scale)
    step_nm = Expectation(0x6005, 1, round(scale.resolution_um * 1000.0), f"{key}.resolution_um (nanometres)")
    return planner.plan((planner.tpdo(),), (step_nm,), common_settings(machine))
