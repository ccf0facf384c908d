"""What `servo-ctrl conformance` and `servo-ctrl nodes` do on the bus."""

import asyncio
from pathlib import Path

import typer

from servo_ctrl.conformance.bus_wire import BusWire, bus_wire
from servo_ctrl.conformance.dialogue import Failed
from servo_ctrl.conformance.lss_master import Address, find_unnamed, give_ids
from servo_ctrl.conformance.scan import scan
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


async def lines_of(bus: str, names: dict[int, int]) -> list[str]:
    """Give ids by serial number, then scan the bus. Raises BusError; Failed where an id cannot be given."""
    async with bus_wire(bus) as wire:
        if names:
            await asyncio.to_thread(give, wire, names)
        found = [node.line for node in await asyncio.to_thread(scan, wire)]
        return found + [address.line for address in await asyncio.to_thread(find_unnamed, wire)]


def give(wire: BusWire, names: dict[int, int]) -> None:
    """Give the nodes with these serial numbers their ids, once all of them are there and no id is taken.

    Raises:
        Failed: one is not there, an id is taken, or see `give_ids`.
    """
    nodes = scan(wire)
    present: dict[Address, int | None] = dict.fromkeys(find_unnamed(wire))
    for node in nodes:
        identity = (node.vendor, node.product, node.revision, node.serial)
        if None not in identity:
            present[Address(*(number or 0 for number in identity))] = node.node_id
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
