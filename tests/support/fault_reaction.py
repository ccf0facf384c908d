"""Asserts the reaction to a fault: detected and answered in time, as the policy table says, and reported."""

from pathlib import Path

from fault_bench import BRAKE, POWER_OFF, FaultBench

from servo_ctrl.axis.fault_bounds import BOUND_CYCLES, detection_cycles
from servo_ctrl.axis.fault_policy import REQUESTS, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage

ROOT = Path(__file__).parents[2]
XY_TABLE = ROOT / "machines" / "xy_table"
FAULT_TIME_S, FAULT_CYCLE = 0.4005, 400
"""Time of the fault, ahead of the inputs of this cycle: at full speed."""
LAST_CYCLE = 1500
X, Y = 1, 2
"""Node ids of the drives."""


def assert_reaction_in_time(bench: FaultBench, event: Event, *, since: int = FAULT_CYCLE) -> None:
    """Assert detection and reaction within the bounds, an emergency message, and power off in the end.

    A requested stop is not a fault and sends no emergency message.
    """
    seen = bench.noted(event)
    allowed = detection_cycles(bench.config, lockstep=True).get(event, 1)
    assert 0 <= seen - since <= allowed + 1, f"detected {seen - since} cycles after the cause"
    wanted = reaction(Stage.RUNNING, event)
    if wanted is Reaction.HOLD:
        answered = [bench.ramp()]
    elif wanted is Reaction.QUICK_STOP:
        answered = [bench.reacted(X, BRAKE), bench.reacted(Y, BRAKE)]
    else:
        answered = [bench.reacted(X, POWER_OFF), bench.reacted(Y, BRAKE)]
    assert all(0 <= cycle - seen <= BOUND_CYCLES[event] for cycle in answered), (seen, answered)
    assert bench.machine.failed == (event not in REQUESTS)
    assert bench.off
    assert bench.machine.stage is Stage.OFF
    assert len(bench.emcy()) == (event not in REQUESTS)
