"""What `servo-ctrl conformance` and `servo-ctrl nodes` do on the bus."""

import asyncio
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import typer

from servo_ctrl.conformance.bus_wire import BusWire, bus_wire
from servo_ctrl.conformance.dialogue import Failed
from servo_ctrl.conformance.lss_master import Address, find_unnamed, give_ids, set_bit_rate
from servo_ctrl.conformance.scan import FoundNode, scan
from servo_ctrl.conformance.suite import examine
from servo_ctrl.conformance.verdicts import ClauseFinding, line


async def findings_of(bus: str, node_id: int, eds: Path) -> list[ClauseFinding]:
    """Open the bus, ask, print a line a clause. Raises BusError, EdsError."""
    found = []
    async with bus_wire(bus) as wire:
        findings = examine(wire, node_id, eds)
        while (finding := await asyncio.to_thread(next, findings, None)) is not None:
            typer.echo(line(finding))
            found.append(finding)
    return found


async def nodes_on(bus: str) -> list[FoundNode]:
    """The nodes that answer on a bus. Raises BusError."""
    async with bus_wire(bus) as wire:
        return await asyncio.to_thread(scan, wire)


class BitRateWish(NamedTuple):
    """A bit rate for all nodes of a bus; `activate_ms` None: from their next power-up on."""

    kbit_s: int
    activate_ms: int | None


async def lines_of(bus: str, names: dict[int, int], rate: BitRateWish | None = None) -> list[str]:
    """Give ids by serial number, scan the bus, then give bit rates. Raises BusError, Failed."""
    async with bus_wire(bus) as wire:
        return await asyncio.to_thread(_configured, wire, names, rate)


def _configured(wire: BusWire, names: dict[int, int], rate: BitRateWish | None) -> list[str]:
    """A line a node, as it is before another rate."""
    if names:
        give(wire, names)
    nodes, unnamed = scan(wire), find_unnamed(wire)
    if rate is not None:
        named = addresses_of(nodes)
        if len(named) < len(nodes):
            raise Failed(
                "a node tells no serial number in 1018h, or has that of another: LSS cannot select it"
            )
        set_bit_rate(wire, [*unnamed, *named], rate.kbit_s, rate.activate_ms)
    return [node.line for node in nodes] + [address.line for address in unnamed]


def addresses_of(nodes: Iterable[FoundNode]) -> dict[Address, int]:
    """Node ids by the address of those that tell it."""
    found = {}
    for node in nodes:
        identity = (node.vendor, node.product, node.revision, node.serial)
        if None not in identity:
            found[Address(*(number or 0 for number in identity))] = node.node_id
    return found


def give(wire: BusWire, names: dict[int, int]) -> None:
    """Give the nodes with these serial numbers their ids, once all of them are there and no id is taken.

    Raises:
        Failed: one is not there, an id is taken, or see `give_ids`.
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
    moved = {before for _, _, before in chosen}
    taken = {node.node_id for node in nodes} - moved
    for _, node_id, _ in chosen:
        if node_id in taken:
            raise Failed(f"node id {node_id} is taken")
    give_ids(wire, chosen)
