"""What every row of the fault policy must show: seen and reacted to in time, as the table says, and told."""

from pathlib import Path

from fault_bench import BRAKE, POWER_OFF, FaultBench

from servo_ctrl.axis.fault_bounds import BOUND_CYCLES, detection_cycles
from servo_ctrl.axis.fault_policy import WISHES, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage

ROOT = Path(__file__).parents[2]
XY_TABLE = ROOT / "machines" / "xy_table"
FAULT_TIME_S, FAULT_CYCLE = 0.4005, 400
"""When it happens, ahead of this cycle's inputs: at full speed."""
LAST_CYCLE = 1500
X, Y = 1, 2
"""Node ids of the drives."""


def assert_reaction_in_time(bench: FaultBench, event: Event, *, since: int = FAULT_CYCLE) -> None:
    """Seen and reacted to within the bounds, as the table says, told to the bus, and off in the end.

    A wish is no fault, and is not told.
    """
    seen = bench.noted(event)
    allowed = detection_cycles(bench.config, lockstep=True).get(event, 1)
    assert 0 <= seen - since <= allowed + 1, f"seen {seen - since} cycles after the cause"
    wanted = reaction(Stage.RUNNING, event)
    if wanted is Reaction.HOLD:
        answered = [bench.ramp()]
    elif wanted is Reaction.QUICK_STOP:
        answered = [bench.reacted(X, BRAKE), bench.reacted(Y, BRAKE)]
    else:
        answered = [bench.reacted(X, POWER_OFF), bench.reacted(Y, BRAKE)]
    assert all(0 <= cycle - seen <= BOUND_CYCLES[event] for cycle in answered), (seen, answered)
    assert bench.machine.failed == (event not in WISHES)
    assert bench.off
    assert bench.machine.stage is Stage.OFF
    assert len(bench.emcy()) == (event not in WISHES)
