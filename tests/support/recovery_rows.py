"""A fault for every row of docs/fault_policy.md, and how the page says to go on after it."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import fault_scripts as way
from consecutive_runs import ConsecutiveRuns, Script

from hil_sim.faults import jammed_axis, runaway_sign, slipped_coupling
from servo_ctrl.commands.command import Command

SWITCH_ON, NEW_RUN = "switch on", "a new run"


class RecoveryRow(NamedTuple):
    """`happens` while a program runs, and `words` are in the reason.

    `passes` is what becomes of the fault while the machine stands by, `repaired` what is done by hand once it
    is switched on again.
    """

    event: str
    words: str
    happens: Callable[[ConsecutiveRuns], Script]
    again: str
    passes: Callable[[ConsecutiveRuns], None] = way.nothing
    repaired: Callable[[ConsecutiveRuns], Script] = way.at_once
    refused: str = ""
    """Why switching on is refused, where the page asks for a new run for that."""
    machine: tuple[str, ...] = ()
    """A text of the machine file, and what is in its place."""


AWAY = "inputs do not come"
RESTARTED = "restarted"
PATIENT = ("following_error_mm = 1.0", "following_error_mm = 50.0")
ROWS = (
    RecoveryRow("inputs missing", AWAY, way.missing_inputs, SWITCH_ON, way.mended_bus),
    RecoveryRow("inputs missing", AWAY, way.missing_scale, SWITCH_ON, way.mended_bus),
    RecoveryRow("inputs missing", AWAY, way.nodes_die, NEW_RUN, way.nodes_come_back, refused=RESTARTED),
    RecoveryRow("inputs missing", AWAY, way.one_drive_dies, NEW_RUN, way.drive_comes_back, refused=RESTARTED),
    RecoveryRow("tick too late", "ticks were missed", way.late_tick, SWITCH_ON),
    RecoveryRow("emergency message", "EMCY 8130h", way.late_tick_that_the_drives_miss, SWITCH_ON),
    RecoveryRow("heartbeat missing", "no heartbeat", way.no_heartbeats, SWITCH_ON, way.mended_bus),
    RecoveryRow("heartbeat missing", "restarted", way.restart_of_a_drive, NEW_RUN, refused=RESTARTED),
    RecoveryRow("emergency message", "EMCY 4210h", way.emergency, SWITCH_ON),
    RecoveryRow("drive fault", "drive", way.drive_fault, SWITCH_ON),
    RecoveryRow(
        "following error",
        "following error",
        partial(way.broken, module=jammed_axis, section="coulomb_friction", then=60),
        SWITCH_ON,
        way.mended_axis,
    ),
    RecoveryRow(
        "position limit", "beyond limits.position_mm", way.narrow_limit, SWITCH_ON, repaired=way.jogged_back
    ),
    RecoveryRow(
        "limit switch", "limit switch", way.real_switch, SWITCH_ON, repaired=way.jogged_away_and_homed
    ),
    RecoveryRow(
        "scale and encoder disagree",
        "encoder and scale",
        way.dead_scale_head,
        SWITCH_ON,
        way.new_scale_head,
        repaired=way.homed_anew,
    ),
    RecoveryRow(
        "scale and encoder disagree",
        "",
        partial(way.broken, module=slipped_coupling, section="drive_compliance", then=60),
        SWITCH_ON,
        way.mended_axis,
        repaired=way.homed_anew,
    ),
    RecoveryRow(
        "axis runs away",
        "runs away",
        partial(way.broken, module=runaway_sign, section="mechanics", then=60),
        NEW_RUN,
        way.mended_axis,
    ),
    RecoveryRow(
        "current saturated",
        "at its limit",
        partial(way.broken, module=jammed_axis, section="coulomb_friction", then=120),
        SWITCH_ON,
        way.mended_axis,
        machine=PATIENT,
    ),
    RecoveryRow("set point is not a number", "not a number", way.not_a_number, NEW_RUN),
    RecoveryRow("another controller", "another controller", way.stranger, NEW_RUN),
    RecoveryRow("duplicate node", "twice", way.twin, SWITCH_ON, way.mended_bus),
    RecoveryRow("PDO of another length", "bytes", way.cut_pdo, SWITCH_ON, way.mended_bus),
    RecoveryRow("PDO of another length", "bytes", way.cut_pdo, NEW_RUN, way.mended_bus),
    RecoveryRow(
        "object of a node changed", "somebody else writes", way.written_to, NEW_RUN, refused="writes"
    ),
    RecoveryRow("frames lost on the bus", "overrun", way.overrun, SWITCH_ON),
    RecoveryRow("bus down", "bus-off", way.bus_off, NEW_RUN),
    RecoveryRow("stop signal", "SIGTERM", way.signalled, NEW_RUN),
    RecoveryRow("switched off", "switched off", partial(way.told, command=Command.DISABLE), SWITCH_ON),
    RecoveryRow("quick stop", "quick stop", partial(way.told, command=Command.QUICK_STOP), SWITCH_ON),
)
