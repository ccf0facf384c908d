"""Faults of a machine in motion, how they end, and the operator's manual actions after them.

Scripts of `consecutive_runs`, started while a program runs.
"""

import operator
from functools import partial
from typing import Any

import can
import numpy as np
from consecutive_runs import ConsecutiveRuns, Script

from hil_sim.faults import broken_scale
from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage

TPDO_X, EMCY_X, HEARTBEAT_X, SDO_X = 0x181, 0x081, 0x701, 0x601
GAP = 30
"""Cycles: more than the tolerated ones."""


def drop(table: ConsecutiveRuns, *can_ids: int) -> None:
    """Frames with these identifiers do not arrive."""
    table.wire.inbound = lambda can_id, data: [] if can_id in can_ids else [(can_id, data)]


def repair_bus(table: ConsecutiveRuns) -> None:
    """All frames arrive again."""
    table.wire.inbound = None


def missing_inputs(table: ConsecutiveRuns) -> Script:
    drop(table, TPDO_X)
    yield GAP


def missing_scale(table: ConsecutiveRuns) -> Script:
    drop(table, 0x18B)
    yield GAP


def late_tick(table: ConsecutiveRuns) -> Script:
    table.stand.late.append(GAP)
    yield 2


def late_tick_that_the_drives_miss(table: ConsecutiveRuns) -> Script:
    table.stand.late.append(90)
    yield 2


def no_heartbeats(table: ConsecutiveRuns) -> Script:
    drop(table, HEARTBEAT_X)
    yield 150


def restart_of_a_drive(table: ConsecutiveRuns) -> Script:
    bench = table.stand.bench

    def restart() -> None:
        bench.slaves[0].start()
        bench._update_routes()

    table.wire.after_frame(restart)
    yield 5


def emergency(table: ConsecutiveRuns) -> Script:
    table.wire.send_foreign(EMCY_X, bytes.fromhex("10 42 09 00 00 00 00 00"))
    yield 2


def drive_fault(table: ConsecutiveRuns) -> Script:
    table.wire.after_frame(lambda: table.stand.bench._drives.drives[0].fault(0x3210, 0x05))
    yield 2


def fault_target(table: ConsecutiveRuns) -> Any:
    return table.stand.bench.fault_targets["x"]


def broken(table: ConsecutiveRuns, module: Any, section: str, *, then: int = 2) -> Script:
    """A fault of the simulator that changes this section of the axis; `table.undo` restores the values."""
    axis = fault_target(table)
    values = [
        (part, field, part[field])
        for part in (axis.params[section], axis.params["amplifier"])
        for field in part.dtype.names
    ]
    table.undo = lambda: [part.__setitem__(field, value) for part, field, value in values]
    table.wire.after_frame(lambda: module.begin(axis, module.Params()))
    yield then


def repair_axis(table: ConsecutiveRuns) -> None:
    """Restore what the fault has changed."""
    table.undo()


def dead_scale_head(table: ConsecutiveRuns) -> Script:
    table.wire.after_frame(lambda: broken_scale.begin(fault_target(table), broken_scale.Params()))
    yield 2


def new_scale_head(table: ConsecutiveRuns) -> None:
    fault_target(table).scale.frozen = False


def narrow_limit(table: ConsecutiveRuns) -> Script:
    """The table is beyond a limit, because the limit moves inwards."""
    bounds = table.servo._record["bounds"]
    table.undo = partial(operator.setitem, bounds, "highest_m", float(bounds["highest_m"]))
    bounds["highest_m"] = 0.0005
    yield lambda: table.machine.stage is not Stage.RUNNING


def jogged_back(table: ConsecutiveRuns) -> Script:
    """Under power, with the table beyond its limit."""
    yield 20
    yield from jogged(table, -0.02, 200)
    assert table.machine.set_points_m()[0] < 0.0005
    table.undo()


def jogged(table: ConsecutiveRuns, velocity_m_s: float, ticks: int) -> Script:
    for _ in range(ticks // 20):
        assert table.stand.handler.jog("x", velocity_m_s).accepted
        yield 20
    yield table.at(Stage.READY)


def real_switch(table: ConsecutiveRuns) -> Script:
    """The switch is nearer than its position relative to home."""
    axis = table.stand.bench._drives.drives[0].port.record
    table.undo = partial(axis.__setitem__, "positive_m", float(axis["positive_m"]))
    axis["positive_m"] = 0.001
    yield lambda: table.machine.stage is not Stage.RUNNING


def jogged_away_and_homed(table: ConsecutiveRuns) -> Script:
    yield from jogged(table, -0.02, 200)
    table.undo()
    yield from homed_again(table)


def homed_again(table: ConsecutiveRuns) -> Script:
    table.ask(Command.HOME, "x")
    yield lambda: table.machine.stage is Stage.STARTING
    yield table.at(Stage.READY)


def not_a_number(table: ConsecutiveRuns) -> Script:
    program = table.machine.program
    advance = program.advance
    program.advance = lambda cycle: [*np.full(4, np.nan).tolist(), *advance(cycle)[4:]]
    yield 2


def foreign_sync(table: ConsecutiveRuns) -> Script:
    table.wire.send_foreign(0x080, b"")
    yield 2


def duplicate_node(table: ConsecutiveRuns) -> Script:
    def inbound(can_id: int, data: bytes) -> list[tuple[int, bytes]]:
        own = [(can_id, data)]
        return [*own, (can_id, bytes(byte ^ 0x10 for byte in data))] if can_id == TPDO_X else own

    table.wire.inbound = inbound
    yield 10


def short_pdo(table: ConsecutiveRuns) -> Script:
    table.wire.inbound = lambda can_id, data: [(can_id, data[:3] if can_id == TPDO_X else data)]
    yield 3


def foreign_sdo_write(table: ConsecutiveRuns) -> Script:
    table.wire.send_foreign(SDO_X, bytes.fromhex("23 65 60 00 10 27 00 00"))
    yield 3


def overrun(table: ConsecutiveRuns) -> Script:
    table.wire.error(0x004, bytes((0, 1, 0, 0, 0, 0, 0, 0)))
    yield 2


def bus_off(table: ConsecutiveRuns) -> Script:
    table.wire.outbound = lambda _can_id, _data: []
    drop(table, *range(0x800))
    table.wire.error(0x040, bytes(8))
    yield 50


def bus_restarts(table: ConsecutiveRuns) -> None:
    """The bus works again: the interface reports it, and frames pass."""
    table.wire.outbound = table.wire.inbound = None
    table.wire.error(0x100, bytes(8))


def interface_fails(table: ConsecutiveRuns) -> Script:
    table.wire.failure = can.CanOperationError("the adapter was pulled out")
    table.wire.controller_port.wake()
    yield 50


def signalled(table: ConsecutiveRuns) -> Script:
    table.stand.signal("SIGTERM")
    yield 400


def commanded(table: ConsecutiveRuns, command: Command) -> Script:
    table.ask(command)
    yield 2


def nodes_die(table: ConsecutiveRuns) -> Script:
    """The simulator is killed, or the cabinet loses power."""
    table.wire.nodes_dead = True
    yield GAP


def nodes_come_back(table: ConsecutiveRuns) -> None:
    table.wire.nodes_dead = False
    table.stand.bench.start()


def one_drive_dies(table: ConsecutiveRuns) -> Script:
    drive = table.stand.bench._drives.drives[0]
    table.wire.after_frame(drive.motion.switch_off)
    drop(table, TPDO_X, EMCY_X, HEARTBEAT_X, 0x581)
    yield 200


def drive_comes_back(table: ConsecutiveRuns) -> None:
    repair_bus(table)
    table.stand.bench.slaves[0].start()
    table.stand.bench._update_routes()


def nothing(_table: ConsecutiveRuns) -> None:
    """The fault is over already."""


def no_repair(_table: ConsecutiveRuns) -> Script:
    yield 1
