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
SWITCHES = 0x1801
"""The TPDO that carries the limit switches."""
_TORQUE_OFFSET, _VELOCITY_OFFSET = (0x60B2, "torque_offset"), (0x60B1, "velocity_offset")


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
    mask: int | None = None
    """Bits that must be set (instead of equality)."""


@dataclass(frozen=True, slots=True)
class PdoPlan:
    """PDO 1 of a node. `communication` and `mapping` are the indices of its two records."""

    communication: int
    mapping: int
    cob_id: int
    transmission_type: int
    codec: PdoCodec


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
    def tpdo(self) -> PdoPlan:
        """What the node sends us every cycle."""
        return next(pdo for pdo in self.pdos if pdo.communication >= 0x1800)

    @property
    def switches(self) -> PdoPlan | None:
        """What brings the limit switches of a drive, where they are read."""
        return next((pdo for pdo in self.pdos if pdo.communication == SWITCHES), None)

    @property
    def rpdo(self) -> PdoPlan:
        """What we send the node every cycle (drives)."""
        return next(pdo for pdo in self.pdos if pdo.communication < 0x1800)


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


def _drive_plan(machine: MachineConfig, axis_key: str, axis: AxisConfig) -> NodePlan:
    drive, key = axis.drive, f"{axis_key}.drive"
    eds = _eds(machine, key, drive)
    rpdo = _pdo(machine, f"{key}.rpdo1", eds, drive.rpdo1, receive=True)
    for mapped in rpdo.objects:
        if mapped.index not in PRODUCED:
            raise ConfigError(
                machine.source,
                f"{key}.rpdo1",
                f"{mapped.name} is nothing the controller computes every cycle",
            )
    if axis.homing_method != 0 and rpdo.position(0x6060) is None:
        raise ConfigError(
            machine.source,
            f"{key}.rpdo1",
            "modes_of_operation is missing; homing switches the mode over the PDO",
        )
    _refuse_unsent_feedforward(machine, axis_key, axis, rpdo)
    modes = [MODE_OF_NAME[axis.mode]] + ([Mode.HOMING] if axis.homing_method else [])
    mask = sum(1 << SUPPORTED_BIT[mode] for mode in modes)
    announced = eds.default(0x6502)
    if announced is not None and announced & mask != mask:
        raise ConfigError(
            machine.source, f"{axis_key}.mode", f"{eds.path} (6502h) has no mode {axis.mode} or no homing"
        )
    expectations = (
        Expectation(0x608F, 1, drive.counts_per_rev, f"{key}.counts_per_rev"),
        Expectation(0x608F, 2, 1, f"{key}.counts_per_rev (motor revolutions)"),
        Expectation(0x6075, 0, drive.rated_current_ma, f"{key}.rated_current_ma"),
        Expectation(0x6076, 0, drive.rated_torque_mnm, f"{key}.rated_torque_mnm"),
        Expectation(0x6502, 0, mask, f"{axis_key}.mode", mask),
    )
    return NodePlan(
        key=key,
        node_id=drive.node_id,
        eds=eds,
        pdos=(
            PdoPlan(0x1400, 0x1600, 0x200 + drive.node_id, drive.rpdo_transmission_type, rpdo),
            _tpdo(machine, key, eds, drive),
            *_switches(machine, key, eds, drive),
        ),
        unused_pdos=tuple(
            unused
            for unused in _unused_pdos(eds, drive.node_id)
            if not (drive.limit_switch_syncs and unused[0] == SWITCHES)
        ),
        expectations=tuple(wanted for wanted in expectations if (wanted.index, wanted.subindex) in eds),
        writes=_writes(
            machine, key, eds, [*common_settings(machine), *drive_settings(machine, axis_key, axis)]
        ),
    )


def _refuse_unsent_feedforward(
    machine: MachineConfig, axis_key: str, axis: AxisConfig, rpdo: PdoCodec
) -> None:
    """Where the amplifier closes a loop, feedforward reaches it as an offset of its own or not at all."""
    control, mode = axis.control, MODE_OF_NAME[axis.mode]
    csv, csp = Mode.CYCLIC_SYNC_VELOCITY, Mode.CYCLIC_SYNC_POSITION
    for key, value, modes, index, name in (
        ("acceleration_feedforward_kg", control.acceleration_feedforward_kg, {csv, csp}, *_TORQUE_OFFSET),
        ("velocity_feedforward", control.velocity_feedforward, {csp}, *_VELOCITY_OFFSET),
    ):
        if value > 0.0 and mode in modes and rpdo.position(index) is None:
            raise ConfigError(
                machine.source,
                f"{axis_key}.control.{key}",
                f'mode {axis.mode} needs "{name}" in drive.rpdo1 for it; without room there, set it to 0.0',
            )


def _scale_plan(machine: MachineConfig, key: str, scale: Scale) -> NodePlan:
    eds = _eds(machine, key, scale)
    step_nm = Expectation(0x6005, 1, round(scale.resolution_um * 1000.0), f"{key}.resolution_um (nanometres)")
    return NodePlan(
        key=key,
        node_id=scale.node_id,
        eds=eds,
        pdos=(_tpdo(machine, key, eds, scale),),
        unused_pdos=tuple(_unused_pdos(eds, scale.node_id)),
        expectations=(step_nm,) if (step_nm.index, step_nm.subindex) in eds else (),
        writes=_writes(machine, key, eds, common_settings(machine)),
    )


def _eds(machine: MachineConfig, key: str, node: Drive | Scale) -> Eds:
    try:
        return load_eds(node.eds, node.node_id)
    except EdsError as error:
        raise ConfigError(machine.source, f"{key}.eds", str(error)) from None


def _pdo(machine: MachineConfig, key: str, eds: Eds, names: Iterable[str], *, receive: bool) -> PdoCodec:
    try:
        return compile_pdo(eds, names, receive=receive)
    except EdsError as error:
        raise ConfigError(machine.source, key, str(error)) from None


def _tpdo(machine: MachineConfig, key: str, eds: Eds, node: Drive | Scale) -> PdoPlan:
    if node.tpdo_transmission_type != SYNCHRONOUS:
        raise ConfigError(
            machine.source,
            f"{key}.tpdo_transmission_type",
            "must be 1: every cycle waits for every node's inputs",
        )
    codec = _pdo(machine, f"{key}.tpdo1", eds, node.tpdo1, receive=False)
    return PdoPlan(0x1800, 0x1A00, 0x180 + node.node_id, node.tpdo_transmission_type, codec)


def _switches(machine: MachineConfig, key: str, eds: Eds, drive: Drive) -> Iterator[PdoPlan]:
    every = drive.limit_switch_syncs
    if every:
        codec = _pdo(machine, f"{key}.limit_switch_syncs", eds, ["0x60FD:00"], receive=False)
        yield PdoPlan(SWITCHES, 0x1A01, 0x280 + drive.node_id, every, codec)


def _unused_pdos(eds: Eds, node_id: int) -> Iterator[tuple[int, int]]:
    for first, bases in ((0x1400, (0x200, 0x300, 0x400, 0x500)), (0x1800, (0x180, 0x280, 0x380, 0x480))):
        for number, base in enumerate(bases):
            if number > 0 and (first + number, 1) in eds:
                yield first + number, base + node_id


def _writes(machine: MachineConfig, key: str, eds: Eds, settings: Iterable[Setting]) -> tuple[Write, ...]:
    """The settings that the EDS has an entry for, in its type; a drive without limits keeps to ours.

    Raises ConfigError when a value does not fit.
    """
    writes = []
    for index, subindex, value, what in settings:
        variable = eds.variables.get((index, subindex))
        if variable is None or variable.data_type not in STRUCT_FORMATS:
            continue
        try:
            data = struct.pack("<" + STRUCT_FORMATS[variable.data_type], value)
        except struct.error:
            reason = f"{what} would be {value}, which {index:04X}h of {eds.path} cannot hold"
            raise ConfigError(machine.source, key, reason) from None
        writes.append(Write(index, subindex, data, what))
    return tuple(writes)
