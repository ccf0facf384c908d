"""`servo-ctrl ask`, `conformance` and `nodes`: SDO requests to a running controller and to other nodes."""

from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import BusOption, MachineOption
from servo_ctrl.commands.command import Command

COMMAND_HELP = (
    f"One of {', '.join(command.word for command in Command)}; set required-um NUMBER, set learner "
    "fast|paper|screw, set adaptation on|off; status; watch (until learning ends). enable, disable and "
    "roll-back are for the friction compensation, switch-on and switch-off for the drives."
)


def ask(
    machine: MachineOption,
    bus: BusOption,
    words: Annotated[list[str], typer.Argument(metavar="COMMAND", help=COMMAND_HELP, show_default=False)],
    axis: Annotated[str, typer.Option(help="Axis the command is for. Without it: all.")] = "",
    json: Annotated[bool, typer.Option("--json", help="Print the status as JSON.")] = False,
) -> None:
    """Give a running controller a command, or read its status, over the bus.

    Exits with 0 when the controller accepted, 1 when not. docs/commands.md has the objects behind it.

    Example: `servo-ctrl ask --machine machines/xy_table --bus socketcan:vcan0 start-learning --axis x`
    """
    import asyncio

    from servo_ctrl.cli.ask_request import parse_request, perform
    from servo_ctrl.config.load import load_machine

    config = load_machine(machine)
    request = parse_request(words, axis, list(config.axes))
    asyncio.run(perform(request, config, bus, json=json))


def conformance(
    bus: BusOption,
    node: Annotated[int, typer.Option(min=1, max=127, help="Node id.", show_default=False)],
    eds: Annotated[Path, typer.Option(help="EDS file of the node.", show_default=False)],
    html: Annotated[Path | None, typer.Option(help="Write the report as a page to this file.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write the report as JUnit XML to this file.")] = None,
) -> None:
    """Test a CANopen node against the standards, clause by clause: pass, fail or not applicable.

    It changes the node's NMT state and restarts its communication, so no controller may run. It never enables
    operation: a motor stays without power. The exit status is 0 where nothing failed.

    Example: `servo-ctrl conformance --bus socketcan:can0 --node 1 --eds eds/servo_drive.eds --html a.html`
    """
    import asyncio

    from servo_ctrl.cli.conformance_request import findings_of
    from servo_ctrl.conformance import verdicts

    findings = asyncio.run(findings_of(bus, node, eds))
    title = f"Node {node} on {bus} against {eds.name}"
    if html is not None:
        html.write_text(verdicts.page(findings, title), encoding="utf-8")
    if junit is not None:
        junit.write_text(verdicts.junit(findings, title), encoding="utf-8")
    typer.echo(verdicts.count(findings))
    if verdicts.failures(findings):
        raise typer.Exit(1)


def _checked_rate(value: int | None) -> int | None:
    """Check that CiA 305 has this bit rate. Raises typer.BadParameter."""
    rates = (1000, 800, 500, 250, 125, 50, 20, 10)
    if value is not None and value not in rates:
        raise typer.BadParameter(f"{value} is none of {', '.join(map(str, rates))} kbit/s")
    return value


def nodes(
    bus: BusOption,
    name: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SERIAL=ID", help="Give the node with this serial number (hex) a node id. Repeatable."
        ),
    ] = None,
    bit_rate: Annotated[
        int | None,
        typer.Option(
            metavar="KBIT_S",
            help="Configure this bit rate on every node by LSS, for their next power-up.",
            callback=_checked_rate,
        ),
    ] = None,
    activate: Annotated[
        int | None,
        typer.Option(metavar="MS", min=0, max=65535, help="With --bit-rate: use it now, after this time."),
    ] = None,
) -> None:
    """List the nodes on a bus: id, profile, vendor, product, revision, serial number and name of each.

    Nodes without a node id are found by LSS fastscan. Without --name and --bit-rate nothing is written. No
    EDS is needed. --name configures and stores node ids by LSS, of nodes with or without one; no node may be
    operational. --bit-rate configures all nodes that are found, or none if one refuses; set the interface of
    this computer yourself. The exit status is 1 if no node answers.

    Example: `servo-ctrl nodes --bus socketcan:can0 --name 10101=1 --name 10102=2`
    """
    import asyncio

    from servo_ctrl.cli.conformance_request import BitRateChange, configure_nodes
    from servo_ctrl.conformance.dialogue import Failed

    if activate is not None and bit_rate is None:
        raise typer.BadParameter("goes with --bit-rate", param_hint="--activate")
    rate = None if bit_rate is None else BitRateChange(bit_rate, activate)
    try:
        lines = asyncio.run(configure_nodes(bus, _names(name or []), rate))
    except Failed as failed:
        raise typer.BadParameter(str(failed), param_hint="--name" if rate is None else "LSS") from failed
    for line in lines:
        typer.echo(line)
    typer.echo(f"{len(lines)} nodes")
    if rate is not None and lines:
        when = "from their next power-up on" if activate is None else f"{activate} ms from now on"
        typer.echo(f"they have {rate.kbit_s} kbit/s {when}: set the interface of this computer likewise")
    if not lines:
        raise typer.Exit(1)


def _names(texts: list[str]) -> dict[int, int]:
    """Parse SERIAL=ID into node ids by serial number. Raises typer.BadParameter."""
    names: dict[int, int] = {}
    for text in texts:
        serial_text, _, id_text = text.partition("=")
        try:
            serial, node_id = int(serial_text, 16), int(id_text)
        except ValueError:
            raise typer.BadParameter(f"{text!r}: give SERIAL=ID, as 10101=1", param_hint="--name") from None
        if not 1 <= node_id <= 127:
            raise typer.BadParameter(f"{text!r}: node ids are 1 to 127", param_hint="--name")
        if serial in names or node_id in names.values():
            raise typer.BadParameter(f"{text!r}: one id for one node", param_hint="--name")
        names[serial] = node_id
    return names
