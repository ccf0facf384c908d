"""Boot plan of one node: its PDOs, expected values, and values to write. Data only."""

from dataclasses import dataclass

from servo_ctrl.canopen.concise_dcf import SdoDownload
from servo_ctrl.canopen.drive_units import DriveUnits
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.canopen.stack import Eds

LIMIT_SWITCHES = 0x60FD
SYNCHRONOUS = 1
"""Transmission type of a PDO with every SYNC."""
RPDO_1, TPDO_1 = 0x1400, 0x1800
"""Communication parameters of PDO 1 (CiA 301)."""


@dataclass(frozen=True, slots=True)
class Write:
    """One SDO download; `data` is little-endian, `description` names it in error messages."""

    index: int
    subindex: int
    data: bytes
    description: str


@dataclass(frozen=True, slots=True)
class Expectation:
    """One SDO upload and its expected value; `key`: its key in the machine file."""

    index: int
    subindex: int
    value: int
    key: str
    mask: int = -1
    """Bits to compare."""


@dataclass(frozen=True, slots=True)
class PdoPlan:
    """One PDO of a node. `communication` is the index of its communication parameter."""

    communication: int
    cob_id: int
    transmission_type: int
    codec: PdoCodec
    event_timer_ms: int = 0
    inhibit_ms: float = 0.0
    fixed: bool = False
    """Whether the mapping is read-only; it must then be this one."""

    @property
    def name(self) -> str:
        """Name in messages, e.g. "TPDO 2"."""
        return f"{'RPDO' if self.received else 'TPDO'} {(self.communication & 0x1FF) + 1}"

    @property
    def key(self) -> str:
        """Key in the machine file, e.g. "tpdo2"."""
        return self.name.lower().replace(" ", "")

    @property
    def received(self) -> bool:
        """Whether the node receives it (an RPDO)."""
        return self.communication < TPDO_1

    @property
    def cyclic(self) -> bool:
        """Whether it is transmitted with every SYNC."""
        return self.transmission_type == SYNCHRONOUS

    @property
    def mapping(self) -> int:
        """Index of the mapping parameter."""
        return self.communication + 0x200


@dataclass(frozen=True, slots=True)
class NodePlan:
    """Boot plan of one node; `key`: its section in the machine file, e.g. "axis.x.drive"."""

    key: str
    node_id: int
    eds: Eds
    pdos: tuple[PdoPlan, ...]
    unused_pdos: tuple[tuple[int, int], ...]
    """(communication index, COB-ID) of the node's other PDOs, which are switched off."""
    expectations: tuple[Expectation, ...]
    writes: tuple[Write, ...]
    units: DriveUnits | None = None
    """Units of a drive, to compare with those it has; None for other nodes."""
    excluded_objects: frozenset[int] = frozenset()
    """Objects that are neither read nor written."""
    concise_dcf: tuple[SdoDownload, ...] = ()
    """Entries of a configuration file, written before everything else."""
    sdo_timeout_s: float | None = None
    """Longest wait for its answers; None: the default."""

    @property
    def name(self) -> str:
        """Name in messages, e.g. "axis.x.drive (node 1)"."""
        return f"{self.key} (node {self.node_id})"

    @property
    def tpdo(self) -> PdoPlan:
        """TPDO 1, which the node sends every cycle."""
        return next(pdo for pdo in self.pdos if pdo.communication == TPDO_1)

    @property
    def further_tpdos(self) -> tuple[PdoPlan, ...]:
        """The other TPDOs of the node."""
        return tuple(pdo for pdo in self.pdos if not pdo.received and pdo.communication != TPDO_1)

    @property
    def switches(self) -> PdoPlan | None:
        """The TPDO with the limit switches of a drive; None if they are not read."""
        return next(
            (pdo for pdo in self.further_tpdos if pdo.codec.position(LIMIT_SWITCHES) is not None), None
        )

    @property
    def rpdos(self) -> tuple[PdoPlan, ...]:
        """RPDOs of a drive, PDO 1 first."""
        return tuple(pdo for pdo in self.pdos if pdo.received)

    @property
    def rpdo(self) -> PdoPlan:
        """RPDO 1."""
        return next(pdo for pdo in self.pdos if pdo.communication == RPDO_1)
