"""Boot plan of every node from machine file and EDS files, without a bus; `servo-ctrl check` uses it too."""

import struct
from collections.abc import Iterable, Iterator, Sequence

from servo_ctrl.canopen.concise_dcf import read_concise_dcf
from servo_ctrl.canopen.drive_units import DriveUnits, units_of
from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.canopen.node_plan import RPDO_1, SYNCHRONOUS, TPDO_1, Expectation, NodePlan, PdoPlan, Write
from servo_ctrl.canopen.pdo import COB_ID_INVALID, STRUCT_FORMATS, compile_pdo
from servo_ctrl.canopen.settings import Setting, common_settings, drive_settings
from servo_ctrl.canopen.stack import load_eds
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.config.node_model import Drive, Pdo, Scale
from servo_ctrl.cyclic.cia402 import MODE_OF_NAME, SUPPORTED_BIT, Mode
from servo_ctrl.errors import ConfigError

CYCLIC_OUTPUTS = (0x6040, 0x6060, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60FF)
"""Objects for which the controller has a value in every cycle; an RPDO may map no other."""
PDOS_MAX = 512
"""Largest number of PDOs per direction of a node (CiA 301)."""
COB_ID_BASE = {0x1400: 0x200, 0x1800: 0x180}
"""Pre-defined connection set: base of the COB-ID of PDO 1 by communication parameter; 100h more a PDO."""
PREDEFINED_PDOS = 4
"""Number of PDOs per direction in that set."""
READ_ONLY = {"ro", "const"}
"""Access types of the EDS (CiA 306) that boot cannot write."""
RESTRICTED_CAN_IDS = (
    range(0x081),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x800),
)
"""Restricted CAN-IDs, not for PDOs (CiA 301, 7.3.5): NMT, SYNC, TIME, SDO, heartbeats, reserved ones."""


def plan_machine(machine: MachineConfig) -> tuple[NodePlan, ...]:
    """Plan the boot of every node, in order of axes, the drive before the scale.

    Raises ConfigError naming the machine file and the key: EDS absent or unreadable, unknown PDO name,
    an object for which the controller has no value, a mode that the drive lacks, a limit that its integers
    cannot hold.
    """
    plans = []
    for name, axis in machine.axes.items():
        plans.append(_drive_plan(machine, f"axis.{name}", axis))
        if axis.scale is not None:
            plans.append(_scale_plan(machine, f"axis.{name}.scale", axis.scale))
    _check_identifiers(machine, plans)
    return tuple(plans)


def _check_identifiers(machine: MachineConfig, plans: Sequence[NodePlan]) -> None:
    """Refuse a CAN-ID that is restricted, or that two senders would use."""
    own = machine.controller.node_id
    emcy = {
        0x080 + node_id: f"EMCY of node {node_id}" for node_id in (own, *(plan.node_id for plan in plans))
    }
    owners = {**emcy, COB_ID_BASE[TPDO_1] + own: f"the status TPDO of node {own}"}
    for plan in plans:
        for pdo in plan.pdos:
            reason = ""
            if any(pdo.cob_id in reserved for reserved in RESTRICTED_CAN_IDS):
                reason = f"{pdo.cob_id:03X}h is restricted: no PDO may have it"
            elif pdo.cob_id in owners:
                reason = f"{pdo.cob_id:03X}h is that of {owners[pdo.cob_id]}"
            if reason:
                raise ConfigError(machine.source, f"{plan.key}.pdo.{pdo.key}.cob_id", reason)
            owners[pdo.cob_id] = f"{pdo.name} of {plan.name}"


class _Planner:
    """Plans one node. Raises ConfigError naming the machine file and a key below `key`."""

    def __init__(self, machine: MachineConfig, key: str, node: Drive | Scale) -> None:
        self._machine, self._key, self._node = machine, key, node
        try:
            self.eds = load_eds(node.eds, node.node_id)
        except EdsError as error:
            raise ConfigError(machine.source, f"{key}.eds", str(error)) from None

    def pdo(self, number: int, key: str, names: Iterable[str], transmission_type: int) -> PdoPlan:
        """Plan the PDO of this number with these objects, from `key` of the machine file."""
        received = key.startswith("r")
        communication = (RPDO_1 if received else TPDO_1) + number - 1
        try:
            codec = compile_pdo(self.eds, names, receive=received)
        except EdsError as error:
            raise ConfigError(self._machine.source, f"{self._key}.{key}", str(error)) from None
        settings = self._node.pdo.get(f"{'r' if received else 't'}pdo{number}", Pdo())
        cob_id = settings.cob_id
        if cob_id is None and number > PREDEFINED_PDOS:
            reason = f"is missing: the pre-defined connection set ends at PDO {PREDEFINED_PDOS}"
            raise ConfigError(self._machine.source, f"{self._key}.{key}.cob_id", reason)
        if (communication, 1) not in self.eds:
            raise ConfigError(self._machine.source, f"{self._key}.{key}", f"{self.eds.path} has no such PDO")
        mapping = self.eds.variables.get((communication + 0x200, 0))
        return PdoPlan(
            communication=communication,
            cob_id=_cob_id(communication, self._node.node_id) if cob_id is None else cob_id,
            transmission_type=transmission_type,
            codec=codec,
            event_timer_ms=settings.event_timer_ms,
            inhibit_ms=settings.inhibit_ms,
            fixed=mapping is not None and mapping.access in READ_ONLY,
        )

    def further(self, direction: str) -> Iterator[PdoPlan]:
        """Plan PDO 2 and those after it of one direction, "r" or "t"."""
        for number, settings in self._node.numbered(direction).items():
            if number > 1:
                kind = SYNCHRONOUS if settings.transmission_type is None else settings.transmission_type
                yield self.pdo(number, f"{direction}pdo{number}", settings.objects or (), kind)

    def tpdo(self) -> PdoPlan:
        """Plan TPDO 1, which the node sends after every SYNC."""
        if self._node.tpdo_transmission_type != SYNCHRONOUS:
            reason = "must be 1: every cycle waits for every node's inputs"
            raise ConfigError(self._machine.source, f"{self._key}.tpdo_transmission_type", reason)
        return self.pdo(1, "tpdo1", self._node.tpdo1, SYNCHRONOUS)

    def plan(
        self,
        pdos: tuple[PdoPlan, ...],
        expectations: Iterable[Expectation],
        settings: Iterable[Setting],
        units: DriveUnits | None = None,
    ) -> NodePlan:
        """Plan the node, without entries that the EDS lacks or that are to be left alone."""
        used, node = {pdo.communication for pdo in pdos}, self._node
        excluded = {int(address, 16) for address in node.leave_alone}
        try:
            entries = read_concise_dcf(node.concise_dcf) if node.concise_dcf is not None else ()
        except EdsError as error:
            raise ConfigError(self._machine.source, f"{self._key}.concise_dcf", str(error)) from None
        return NodePlan(
            key=self._key,
            node_id=node.node_id,
            eds=self.eds,
            pdos=pdos,
            unused_pdos=tuple(self._unused(used)),
            expectations=tuple(
                expectation
                for expectation in expectations
                if (expectation.index, expectation.subindex) in self.eds and expectation.index not in excluded
            ),
            writes=tuple(write for write in self._writes(settings) if write.index not in excluded),
            units=units,
            excluded_objects=frozenset(excluded),
            concise_dcf=entries,
            sdo_timeout_s=None if node.sdo_timeout_ms is None else node.sdo_timeout_ms * 1e-3,
        )

    def _unused(self, used: set[int]) -> Iterator[tuple[int, int]]:
        """Yield communication parameter and COB-ID of the other PDOs of the node that may be on."""
        for first in COB_ID_BASE:
            for communication in range(first, first + PDOS_MAX):
                variable = self.eds.variables.get((communication, 1))
                if communication in used or variable is None or variable.access in READ_ONLY:
                    continue
                if communication - first < PREDEFINED_PDOS:
                    yield communication, _cob_id(communication, self._node.node_id)
                elif isinstance(variable.default, int) and not variable.default & COB_ID_INVALID:
                    yield communication, variable.default & 0x7FF

    def _writes(self, settings: Iterable[Setting]) -> Iterator[Write]:
        """Encode the settings in the types of the EDS, without objects that are absent or read-only."""
        for index, subindex, value, description in settings:
            variable = self.eds.variables.get((index, subindex))
            if variable is None or variable.data_type not in STRUCT_FORMATS or variable.access in READ_ONLY:
                continue
            try:
                data = struct.pack("<" + STRUCT_FORMATS[variable.data_type], value)
            except struct.error:
                reason = f"{description} would be {value}, which {index:04X}h of {self.eds.path} cannot hold"
                raise ConfigError(self._machine.source, self._key, reason) from None
            yield Write(index, subindex, data, description)


def _cob_id(communication: int, node_id: int) -> int:
    """Return the COB-ID of a PDO in the pre-defined connection set."""
    first, number = communication & ~0xFF, communication & 0xFF
    return COB_ID_BASE[first] + 0x100 * number + node_id


def _drive_plan(machine: MachineConfig, axis_key: str, axis: AxisConfig) -> NodePlan:
    drive, key = axis.drive, f"{axis_key}.drive"
    planner = _Planner(machine, key, drive)
    rpdos = [planner.pdo(1, "rpdo1", drive.rpdo1, drive.rpdo_transmission_type), *planner.further("r")]
    _check_rpdos(machine, axis_key, axis, rpdos)
    modes = [MODE_OF_NAME[axis.mode]] + ([Mode.HOMING] if axis.homing_method else [])
    mask = sum(1 << SUPPORTED_BIT[mode] for mode in modes)
    supported_modes = planner.eds.default(0x6502)
    if supported_modes is not None and supported_modes & mask != mask and "0x6502" not in drive.leave_alone:
        reason = f"{planner.eds.path} (6502h) has no mode {axis.mode} or no homing"
        raise ConfigError(machine.source, f"{axis_key}.mode", reason)
    tpdos = [planner.tpdo(), *planner.further("t")]
    if drive.limit_switch_syncs:
        free_number = next(number for number in range(2, PDOS_MAX) if f"tpdo{number}" not in drive.pdo)
        tpdos.append(planner.pdo(free_number, "tpdo_limit_switches", ["0x60FD:00"], drive.limit_switch_syncs))
    expectations = (
        Expectation(0x6075, 0, drive.rated_current_ma, f"{key}.rated_current_ma"),
        Expectation(0x6076, 0, drive.rated_torque_mnm, f"{key}.rated_torque_mnm"),
        Expectation(0x6502, 0, mask, f"{axis_key}.mode", mask),
    )
    settings = (*common_settings(machine), *drive_settings(machine, axis_key, axis))
    return planner.plan((*rpdos, *tpdos), expectations, settings, units_of(axis_key, axis))


def _check_rpdos(machine: MachineConfig, axis_key: str, axis: AxisConfig, rpdos: Sequence[PdoPlan]) -> None:
    """Refuse mapped objects without a value of the controller, and missing objects that the axis needs."""
    key = f"{axis_key}.drive.rpdo1"
    mapped_indices = set()
    for pdo in rpdos:
        for mapped in pdo.codec.objects:
            if mapped.index not in CYCLIC_OUTPUTS:
                reason = f"{mapped.name} is not computed by the controller every cycle"
                raise ConfigError(machine.source, f"{axis_key}.drive.{pdo.key}", reason)
            mapped_indices.add(mapped.index)
    if axis.homing_method and 0x6060 not in mapped_indices:
        reason = "modes_of_operation is missing; homing switches the mode over the PDO"
        raise ConfigError(machine.source, key, reason)
    # an amplifier that closes a loop gets feedforward only by an offset object
    control = axis.control
    for gain, value, modes, index, name in (
        (
            "acceleration_feedforward_kg",
            control.acceleration_feedforward_kg,
            {"csv", "csp"},
            0x60B2,
            "torque_offset",
        ),
        ("velocity_feedforward", control.velocity_feedforward, {"csp"}, 0x60B1, "velocity_offset"),
    ):
        if value > 0.0 and axis.mode in modes and index not in mapped_indices:
            reason = f'mode {axis.mode} needs "{name}" in an RPDO (drive.pdo.rpdo2); else set it to 0.0'
            raise ConfigError(machine.source, f"{axis_key}.control.{gain}", reason)


def _scale_plan(machine: MachineConfig, key: str, scale: Scale) -> NodePlan:
    planner = _Planner(machine, key, scale)
    step_nm = Expectation(0x6005, 1, round(scale.resolution_um * 1000.0), f"{key}.resolution_um (nanometres)")
    return planner.plan((planner.tpdo(),), (step_nm,), common_settings(machine))
