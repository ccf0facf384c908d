"""Bus access of `servo-ctrl conformance` and `servo-ctrl nodes`."""

import asyncio
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import typer

from servo_ctrl.conformance.dialogue import Failed
from servo_ctrl.conformance.lss_master import Address, configure_ids, find_unnamed, set_bit_rate
from servo_ctrl.conformance.scan import FoundNode, scan
from servo_ctrl.conformance.suite import BusWire, bus_wire, examine
from servo_ctrl.conformance.verdicts import ClauseFinding, line


async def findings_of(bus: str, node_id: int, eds: Path) -> list[ClauseFinding]:
    """Run the conformance suite on a node and print one line per clause. Raises BusError, EdsError."""
    done = []
    async with bus_wire(bus) as wire:
        findings = examine(wire, node_id, eds)
        while (finding := await asyncio.to_thread(next, findings, None)) is not None:
            typer.echo(line(finding))
            done.append(finding)
    return done


async def nodes_on(bus: str) -> list[FoundNode]:
    """Return the nodes that answer on a bus. Raises BusError."""
    async with bus_wire(bus) as wire:
        return await asyncio.to_thread(scan, wire)


class BitRateChange(NamedTuple):
    """A bit rate for all nodes of a bus, after `activate_ms`, or from their next power-up on (None)."""

    kbit_s: int
    activate_ms: int | None


async def configure_nodes(bus: str, names: dict[int, int], rate: BitRateChange | None = None) -> list[str]:
    """Configure node ids by serial number, list the nodes, then configure their bit rate.

    Returns one line per node. Raises BusError, Failed.
    """
    async with bus_wire(bus) as wire:
        return await asyncio.to_thread(_configure, wire, names, rate)


def _configure(wire: BusWire, names: dict[int, int], rate: BitRateChange | None) -> list[str]:
    """Configure ids and bit rate; return one line per node."""
    if names:
        assign_ids(wire, names)
    nodes, unnamed = scan(wire), find_unnamed(wire)
    if rate is not None:
        addresses = addresses_of(nodes)
        if len(addresses) < len(nodes):
            raise Failed(
                "a node has no serial number in 1018h, or that of another node: LSS cannot select it"
            )
        set_bit_rate(wire, [*unnamed, *addresses], rate.kbit_s, rate.activate_ms)
    return [node.line for node in nodes] + [address.line for address in unnamed]


def addresses_of(nodes: Iterable[FoundNode]) -> dict[Address, int]:
    """Return node ids by LSS address, of the nodes with a complete identity."""
    ids = {}
    for node in nodes:
        identity = (node.vendor, node.product, node.revision, node.serial)
        if None not in identity:
            ids[Address(*(number or 0 for number in identity))] = node.node_id
    return ids


def assign_ids(wire: BusWire, names: dict[int, int]) -> None:
    """Configure the ids of the nodes with these serial numbers, if all of them are found and no id is in use.

    Raises:
        Failed: a node is not found, an id is in use, or see `configure_ids`.
    """
    nodes = scan(wire)
    present: dict[Address, int | None] = dict.fromkeys(find_unnamed(wire))
    present |= addresses_of(nodes)
    chosen = []
    for serial, node_id in names.items():
        addresses = [address for address in present if address.serial == serial]
        if len(addresses) != 1:
            raise Failed(f"{len(addresses)} nodes have the serial number {serial:X}h")
        chosen.append((addresses[0], node_id, present[addresses[0]]))
    previous = {before for _, _, before in chosen}
    taken = {node.node_id for node in nodes} - previous
    for _, node_id, _ in chosen:
        if node_id in taken:
            raise Failed(f"node id {node_id} is taken")
    configure_ids(wire, chosen)
