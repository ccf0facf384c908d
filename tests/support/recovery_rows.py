"""A fault for every row of docs/fault_policy.md, and the recovery that the page prescribes."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import fault_scripts as scripts
from consecutive_runs import ConsecutiveRuns, Script

from hil_sim.faults import jammed_axis, runaway_sign, slipped_coupling
from servo_ctrl.commands.command import Command

SWITCH_ON, NEW_RUN = "switch on", "a new run"


class RecoveryRow(NamedTuple):
    """A fault that `happens` while a program runs; `words` are in the reason of the stop.

    `passes` ends the fault while the machine is in standby, `repaired` is what an operator does after it is
    switched on again.
    """

    event: str
    words: str
    happens: Callable[[ConsecutiveRuns], Script]
    again: str
    passes: Callable[[ConsecutiveRuns], None] = scripts.nothing
    repaired: Callable[[ConsecutiveRuns], Script] = scripts.no_repair
    refused: str = ""
    """Reason for which enabling is refused, where the page prescribes a new run."""
    machine: tuple[str, ...] = ()
    """A text of the machine file, and its replacement."""


MISSING = "TPDOs are no longer received"
TOLERANT = ("following_error_mm = 1.0", "following_error_mm = 50.0")
ROWS = (
    RecoveryRow("inputs missing", MISSING, scripts.missing_inputs, SWITCH_ON, scripts.repair_bus),
    RecoveryRow("inputs missing", MISSING, scripts.missing_scale, SWITCH_ON, scripts.repair_bus),
    RecoveryRow("inputs missing", MISSING, scripts.nodes_die, SWITCH_ON, scripts.nodes_come_back),
    RecoveryRow("inputs missing", MISSING, scripts.one_drive_dies, SWITCH_ON, scripts.drive_comes_back),
    RecoveryRow("tick too late", "ticks were missed", scripts.late_tick, SWITCH_ON),
    RecoveryRow("emergency message", "EMCY 8130h", scripts.late_tick_that_the_drives_miss, SWITCH_ON),
    RecoveryRow("heartbeat missing", "no heartbeat", scripts.no_heartbeats, SWITCH_ON, scripts.repair_bus),
    RecoveryRow("heartbeat missing", "restarted", scripts.restart_of_a_drive, SWITCH_ON),
    RecoveryRow("emergency message", "EMCY 4210h", scripts.emergency, SWITCH_ON),
    RecoveryRow("drive fault", "drive", scripts.drive_fault, SWITCH_ON),
    RecoveryRow(
        "following error",
        "following error",
        partial(scripts.broken, module=jammed_axis, section="coulomb_friction", then=60),
        SWITCH_ON,
        scripts.repair_axis,
    ),
    RecoveryRow(
        "position limit",
        "beyond limits.position_mm",
        scripts.narrow_limit,
        SWITCH_ON,
        repaired=scripts.jogged_back,
    ),
    RecoveryRow(
        "limit switch", "limit switch", scripts.real_switch, SWITCH_ON, repaired=scripts.jogged_away_and_homed
    ),
    RecoveryRow(
        "scale and encoder disagree",
        "encoder and scale",
        scripts.dead_scale_head,
        SWITCH_ON,
        scripts.new_scale_head,
        repaired=scripts.homed_again,
    ),
    RecoveryRow(
        "scale and encoder disagree",
        "",
        partial(scripts.broken, module=slipped_coupling, section="drive_compliance", then=60),
        SWITCH_ON,
        scripts.repair_axis,
        repaired=scripts.homed_again,
    ),
    RecoveryRow(
        "axis runs away",
        "runs away",
        partial(scripts.broken, module=runaway_sign, section="mechanics", then=60),
        NEW_RUN,
        scripts.repair_axis,
    ),
    RecoveryRow(
        "current saturated",
        "force saturated",
        partial(scripts.broken, module=jammed_axis, section="coulomb_friction", then=120),
        SWITCH_ON,
        scripts.repair_axis,
        machine=TOLERANT,
    ),
    RecoveryRow("set point is not a number", "not a number", scripts.not_a_number, NEW_RUN),
    RecoveryRow("another controller", "another controller", scripts.foreign_sync, NEW_RUN),
    RecoveryRow("duplicate node", "twice", scripts.duplicate_node, SWITCH_ON, scripts.repair_bus),
    RecoveryRow("PDO of another length", "bytes", scripts.short_pdo, SWITCH_ON, scripts.repair_bus),
    RecoveryRow("PDO of another length", "bytes", scripts.short_pdo, NEW_RUN, scripts.repair_bus),
    RecoveryRow(
        "object of a node changed", "another participant writes", scripts.foreign_sdo_write, SWITCH_ON
    ),
    RecoveryRow("frames lost on the bus", "overrun", scripts.overrun, SWITCH_ON),
    RecoveryRow("bus off", "bus-off", scripts.bus_off, SWITCH_ON, scripts.bus_restarts),
    RecoveryRow("bus off", "bus-off", scripts.bus_off, NEW_RUN, scripts.bus_restarts),
    RecoveryRow("bus down", "failed", scripts.interface_fails, NEW_RUN),
    RecoveryRow("stop signal", "SIGTERM", scripts.signalled, NEW_RUN),
    RecoveryRow(
        "switched off", "switched off", partial(scripts.commanded, command=Command.DISABLE), SWITCH_ON
    ),
    RecoveryRow(
        "quick stop", "quick stop", partial(scripts.commanded, command=Command.QUICK_STOP), SWITCH_ON
    ),
)
