"""Properties of an axis that readers and sensor checks need; the nominal model provides them."""

from pathlib import Path
from typing import NamedTuple, Protocol


class BusNodes(NamedTuple):
    """Nodes of an axis on the CAN bus, and the rated values that per mille refer to."""

    drive_node_id: int
    drive_eds: Path
    rated_torque_nm: float
    rated_current_a: float
    scale_node_id: int | None = None
    scale_eds: Path | None = None


class ModelAxis(Protocol):
    """One axis. Unknown properties are None and are not checked."""

    @property
    def lead_m(self) -> float:
        """Travel per turn."""

    @property
    def force_constant_n_a(self) -> float:
        """Motor force at the table per current."""

    @property
    def mass_kg(self) -> float:
        """Total moving mass, at the table."""

    @property
    def encoder_resolution_m(self) -> float | None:
        """One count of the motor encoder, at the table."""

    @property
    def scale_resolution_m(self) -> float | None:
        """One count of the linear scale."""

    @property
    def bus(self) -> BusNodes | None:
        """Nodes for logs of the CAN bus."""
