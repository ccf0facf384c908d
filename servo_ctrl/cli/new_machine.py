"""`servo-ctrl new-machine`: a new machine directory, copied, or made from answers about its axes."""

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from servo_ctrl.errors import ConfigError
from shipped_files import EDS, MACHINES, machine_names

if TYPE_CHECKING:
    from servo_ctrl.config.machine_sheet import AxisSheet

NAME = "x"
"""Suggested name of the first axis."""


def new_machine(
    directory: Annotated[Path, typer.Argument(help="Directory to be made; must not exist yet.")],
    source: Annotated[
        str | None, typer.Option("--from", metavar="NAME", help="Copy a machine that comes with the program.")
    ] = None,
    axis: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TEXT",
            help="An axis, for scripts: 'x drive=1 scale=11 lead_mm=10 mass_kg=45 travel_mm=-100..100', and "
            "further keys. Repeatable.",
        ),
    ] = None,
    drive_eds: Annotated[
        Path | None, typer.Option(help="EDS file of the drives, in place of the simulated one's.")
    ] = None,
    scale_eds: Annotated[
        Path | None, typer.Option(help="EDS file of the scales, in place of the simulated one's.")
    ] = None,
    bus: Annotated[
        str | None,
        typer.Option(metavar="INTERFACE:CHANNEL", help="Check that the nodes there are those of the files."),
    ] = None,
) -> None:
    """Make a machine directory whose files can be changed: controller.toml, plant.toml, EDS files.

    It asks for node ids, leads, masses and limits of each axis. With --axis it does not ask; with --from it
    copies a machine and its programs, without learned results. The files are checked against the EDS files,
    and with --bus against the nodes on the bus; nothing is written to a node.

    Examples:  servo-ctrl new-machine my_table
               servo-ctrl new-machine my_table --from xy_table
    """
    from servo_ctrl.cli.new_machine import copy_machine
    from servo_ctrl.config.machine_sheet import read_axis

    if source is not None:
        if axis or drive_eds or scale_eds:
            raise typer.BadParameter("--from copies a machine as it is: leave out --axis and EDS files")
        copy_machine(source, directory)
        typer.echo(f"{directory}: a copy of {source}; next: servo-ctrl check --machine {directory}")
    else:
        if directory.exists():
            raise typer.BadParameter(f"{directory} exists already; name a directory that does not")
        try:
            axes = [read_axis(text) for text in axis] if axis else _ask_for_axes()
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--axis") from None
        _make(directory, axes, drive_eds, scale_eds)
        typer.echo(f"{directory}: controller.toml and plant.toml fit their EDS files; next:")
        typer.echo(f"  servo-ctrl check --machine {directory}")
    if bus is not None and not _nodes_agree(directory, bus):
        raise typer.Exit(1)


def _ask_for_axes() -> "list[AxisSheet]":
    """Ask for the axes, one after the other, until the name is left empty."""
    from servo_ctrl.config.machine_sheet import PROMPTS, AxisSheet, read_value

    axes: list[AxisSheet] = []
    while True:
        offered = NAME if not axes else ""
        name = typer.prompt(
            "name of the axis" if not axes else "name of the next axis, empty = no more", offered
        )
        if not name.strip():
            return axes
        if not name.isidentifier():
            typer.echo("enter letters, digits and _, a letter first")
            continue
        values = {}
        for key, prompt in PROMPTS.items():
            default = AxisSheet._field_defaults.get(key)
            while key not in values:
                answer = typer.prompt(f"  {prompt}", None if default is None else f"{default:.10g}")
                try:
                    values[key] = read_value(key, answer)
                except ValueError as error:
                    typer.echo(f"  {error}")
        axes.append(AxisSheet(name, **values))  # type: ignore[arg-type]  # `read_value` has checked each


def _make(directory: Path, axes: "list[AxisSheet]", drive_eds: Path | None, scale_eds: Path | None) -> None:
    """Write the directory; remove it if the files do not fit the EDS files. Raises ServoCtrlError."""
    import shutil

    from servo_ctrl.canopen.bus_load import check_load
    from servo_ctrl.canopen.plan import plan_machine
    from servo_ctrl.config.load import load_machine
    from servo_ctrl.config.machine_files import EdsNames, controller_text, plant_text
    from servo_ctrl.config.machine_sheet import check_ids
    from shipped_files import EDS

    check_ids(axes, directory)
    eds = EdsNames()
    try:
        shutil.copytree(EDS, directory / "eds")
        if drive_eds is not None:
            eds = eds._replace(drive=Path(shutil.copy(drive_eds, directory / "eds")).name)
        if scale_eds is not None:
            eds = eds._replace(scale=Path(shutil.copy(scale_eds, directory / "eds")).name)
        name = directory.resolve().name
        for file, text in (
            ("controller", controller_text(name, axes, eds)),
            ("plant", plant_text(name, axes, eds)),
        ):
            (directory / f"{file}.toml").write_text(text, encoding="utf-8")
        config = load_machine(directory)
        check_load(config, plan_machine(config))
    except BaseException:
        shutil.rmtree(directory, ignore_errors=True)
        raise


def _nodes_agree(directory: Path, bus: str) -> bool:
    """Print whether each node of the machine is on the bus and fits its EDS file; return whether all do."""
    import asyncio

    from servo_ctrl.canopen.plan import plan_machine
    from servo_ctrl.cli.conformance_request import nodes_on
    from servo_ctrl.config.load import load_machine

    found = {node.node_id: node for node in asyncio.run(nodes_on(bus))}
    agree = True
    for plan in plan_machine(load_machine(directory)):
        node = found.get(plan.node_id)
        if node is None:
            problem = f"not on {bus}"
        else:
            identity = (
                ("vendor-ID", node.vendor),
                ("product code", node.product),
                ("revision", node.revision),
            )
            stated = (plan.eds.default(0x1018, subindex) for subindex in (1, 2, 3))
            problem = "; ".join(
                f"{what} is {is_there or 0:08X}h, {plan.eds.path.name} says {wanted:08X}h"
                for (what, is_there), wanted in zip(identity, stated, strict=True)
                if wanted and is_there != wanted
            )
        agree = agree and not problem
        typer.echo(f"  node {plan.node_id:3d}  {plan.key}: {problem or 'is the one of its EDS file'}")
    return agree


SHIPPED_EDS_PREFIX, COPIED_EDS_PREFIX = re.compile(r'"(?:\.\./)+eds/'), '"eds/'
"""Prefixes of EDS paths in a shipped machine and in its copy."""


def copy_machine(name: str, directory: Path) -> None:
    """Copy machine `name` to `directory`, without learned results. Raises ConfigError, OSError."""
    if name not in machine_names():
        raise ConfigError(directory, "--from", f"no machine {name}; there are {', '.join(machine_names())}")
    if directory.exists():
        raise ConfigError(directory, "", "exists already; name a directory that does not")
    shutil.copytree(MACHINES / name, directory, ignore=shutil.ignore_patterns("learned", "__pycache__"))
    shutil.copytree(EDS, directory / "eds")
    template_eds = (MACHINES / name).parent / "eds"
    if template_eds.is_dir() and template_eds != EDS:
        shutil.copytree(template_eds, directory / "eds", dirs_exist_ok=True)
    for file in directory.glob("*.toml"):
        text = file.read_text(encoding="utf-8")
        file.write_text(SHIPPED_EDS_PREFIX.sub(COPIED_EDS_PREFIX, text), encoding="utf-8")
