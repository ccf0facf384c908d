"""What `servo-ctrl conformance` and `servo-ctrl nodes` do on the bus."""

import asyncio
from pathlib import Path

import typer

from servo_ctrl.conformance.bus_wire import bus_wire
from servo_ctrl.conformance.scan import scan
from servo_ctrl.conformance.suite import examine
from servo_ctrl.conformance.verdicts import Finding, line


async def findings_of(bus: str, node_id: int, eds: Path) -> list[Finding]:
    """Open the bus, ask, print a line a clause. Raises BusError, EdsError."""
    found = []
    async with bus_wire(bus) as wire:
        findings = examine(wire, node_id, eds)
        while (finding := await asyncio.to_thread(next, findings, None)) is not None:
            typer.echo(line(finding))
            found.append(finding)
    return found


async def lines_of(bus: str) -> list[str]:
    """Scan the bus. Raises BusError."""
    async with bus_wire(bus) as wire:
        return [node.line for node in await asyncio.to_thread(scan, wire)]
