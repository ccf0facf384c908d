"""All faults of the campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.campaigns.campaign import faults_bus, faults_files, faults_host, faults_node, faults_table

if TYPE_CHECKING:
    from tests.campaigns.campaign.fault_context import Fault

ALL = (
    *faults_bus.FAULTS,
    *faults_node.FAULTS,
    *faults_table.FAULTS,
    *faults_host.FAULTS,
    *faults_files.FAULTS,
)


def named(name: str) -> Fault:
    """Return the fault with this name."""
    (found,) = (fault for fault in ALL if fault.name == name)
    return found
