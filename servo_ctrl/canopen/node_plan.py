"""What boot does to one node: its PDOs, what it must read back, and what is written to it. Data alone."""

from dataclasses import dataclass

from servo_ctrl.canopen.concise_dcf import SdoDownload
from servo_ctrl.canopen.drive_units import DriveUnits
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.canopen.stack import Eds

LIMIT_SWITCHES = 0x60FD
SYNCHRONOUS = 1
"""Transmission type of what comes or goes with every SYNC."""
RPDO_1, TPDO_1 = 0x1400, 0x1800
"""Communication parameters (CiA 301)."""


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
    event_timer_ms: int = 0
    inhibit_ms: float = 0.0
    fixed: bool = False
    """Its mapping cannot be written; it must be this one."""

    @property
    def name(self) -> str:
        """As people call it, e.g. "TPDO 2"."""
        return f"{'RPDO' if self.received else 'TPDO'} {(self.communication & 0x1FF) + 1}"

    @property
    def key(self) -> str:
        """As the machine file calls it, e.g. "tpdo2"."""
        return self.name.lower().replace(" ", "")

    @property
    def received(self) -> bool:
        """Whether the node receives it (an RPDO)."""
        return self.communication < TPDO_1

    @property
    def cyclic(self) -> bool:
        """Whether it comes or goes with every SYNC."""
        return self.transmission_type == SYNCHRONOUS

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
    units: DriveUnits | None = None
    """Those of a drive, which are read and held against the machine file."""
    left_alone: frozenset[int] = frozenset()
    """Objects that are neither read nor written."""
    concise_dcf: tuple[SdoDownload, ...] = ()
    """Configuration of a file, which is written before everything else."""
    sdo_timeout_s: float | None = None
    """Patience with its answers; None = the usual."""

    @property
    def name(self) -> str:
        """How messages name the node, as "axis.x.drive (node 1)"."""
        return f"{self.key} (node {self.node_id})"

    @property
    def tpdo(self) -> PdoPlan:
        """What the node sends us every cycle."""
        return next(pdo for pdo in self.pdos if pdo.communication == TPDO_1)

    @property
    def further_tpdos(self) -> tuple[PdoPlan, ...]:
        """What else the node sends us."""
        return tuple(pdo for pdo in self.pdos if not pdo.received and pdo.communication != TPDO_1)

    @property
    def switches(self) -> PdoPlan | None:
        """What brings the limit switches of a drive, where they are read."""
        return next(
            (pdo for pdo in self.further_tpdos if pdo.codec.position(LIMIT_SWITCHES) is not None), None
        )

    @property
    def rpdos(self) -> tuple[PdoPlan, ...]:
        """What we send the node (drives), PDO 1 first."""
        return tuple(pdo for pdo in self.pdos if pdo.received)

    @property
    def rpdo(self) -> PdoPlan:
        """The first of them."""
        return next(pdo for pdo in self.pdos if pdo.communication == RPDO_1)
