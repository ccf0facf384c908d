"""All faults of the campaign."""

from __future__ import annotations

from tests.campaign import faults_bus, faults_files, faults_host, faults_node, faults_table

ALL = (
    *faults_bus.FAULTS,
    *faults_node.FAULTS,
    *faults_table.FAULTS,
    *faults_host.FAULTS,
    *faults_files.FAULTS,
)
