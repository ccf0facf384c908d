"""The sequence of a drive against scripted statuswords."""

import pytest

from servo_ctrl.cyclic.cia402 import Mode
from servo_ctrl.cyclic.drive_phases import (
    DISABLE_LIMIT_S,
    HOMING_LIMIT_S,
    QUICK_STOP_LIMIT_S,
    SWITCH_ON_LIMIT_S,
    UNKNOWN_MODE,
    Phase,
    Problem,
    problem_text,
)
from servo_ctrl.cyclic.sequence import FAULT_RESET_CYCLES, HOMING_START_CYCLES, SETTLING_CYCLES
from servo_ctrl.cyclic.sequence import advance as compiled_advance
from servo_ctrl.cyclic.sequence_state import Route, Sequence, Step, begin, brake, home, lose, release

PERIOD_S = 0.001
HOMED = Route(int(Mode.CYCLIC_SYNC_TORQUE), homing=True, period_s=PERIOD_S)
UNHOMED = Route(int(Mode.CYCLIC_SYNC_POSITION), homing=False, period_s=PERIOD_S)
SWITCHING_ON = Sequence(int(Phase.SWITCHING_ON), 0, int(Mode.HOMING))
DISABLED, READY, SWITCHED_ON, ENABLED, FAULT, QUICK_STOP = 0x0240, 0x0221, 0x0223, 0x0227, 0x0208, 0x0207
HOMING_DONE, HOMING_FAILED = 0x1627, 0x2627


def advance(
    route: Route,
    sequence: Sequence,
    statusword: int,
    *,
    complete: bool = True,
    age: int = 0,
    at_standstill: bool = True,
    mode_shown: int = UNKNOWN_MODE,
) -> Step:
    """Advance the sequence; by default all inputs have come, of this cycle, and the axis rests."""
    return compiled_advance(route, sequence, statusword, complete, age, at_standstill, mode_shown)


def problem_of(step: Step, statusword: int) -> str:
    """Say its problem."""
    return problem_text(step.problem, statusword)


def run(route: Route, sequence: Sequence, statuswords: list[int]) -> tuple[Sequence, list[int], list[str]]:
    """Controlwords and problems over a script."""
    controlwords, problems = [], []
    for statusword in statuswords:
        step = advance(route, sequence, statusword)
        sequence = step.sequence
        controlwords.append(step.controlword)
        if problem := problem_of(step, statusword):
            problems.append(problem)
    return sequence, controlwords, problems


def test_switching_on_takes_the_three_transitions() -> None:
    sequence, controlwords, problems = run(UNHOMED, begin(UNHOMED), [DISABLED, READY, SWITCHED_ON, ENABLED])
    assert controlwords == [0x06, 0x07, 0x0F, 0x0F]
    assert (sequence.phase, sequence.mode, problems) == (Phase.SETTLING, Mode.CYCLIC_SYNC_POSITION, [])


@pytest.mark.parametrize("statusword", [FAULT, DISABLED, READY, SWITCHED_ON])
def test_moving_axis_is_switched_on_once_it_stands_still(statusword: int) -> None:
    sequence = begin(UNHOMED)
    for _ in range(50):
        step = advance(UNHOMED, sequence, statusword, at_standstill=False)
        sequence = step.sequence
        assert (step.controlword, problem_of(step, statusword)) == (0x06, "")
    begun = advance(UNHOMED, sequence, statusword)
    assert begun == advance(UNHOMED, begin(UNHOMED), statusword), "it has the whole time to be switched on"


@pytest.mark.parametrize(("statusword", "controlword"), [(READY, 0x07), (SWITCHED_ON, 0x0F)])
def test_drive_switching_on_is_not_interrupted(statusword: int, controlword: int) -> None:
    """What it answers may be some cycles old: it may have power already, which it would give up then."""
    step = advance(HOMED, SWITCHING_ON, statusword, at_standstill=False)
    assert (step.sequence.phase, step.controlword) == (Phase.SWITCHING_ON, controlword)


def test_axis_that_never_stands_still_is_a_problem() -> None:
    cycles = round(SWITCH_ON_LIMIT_S / PERIOD_S)
    steps = [
        advance(UNHOMED, begin(UNHOMED)._replace(cycles=waited), READY, at_standstill=False)
        for waited in (cycles, cycles + 1)
    ]
    assert [step.controlword for step in steps] == [0x06, 0x06]
    assert [problem_of(step, READY) for step in steps] == ["", "is not switched on: its axis moves"]


def test_homing_raises_bit_4_in_homing_mode_and_then_changes_to_the_working_mode() -> None:
    script = [ENABLED] * 12 + [HOMING_DONE]
    sequence, controlwords, problems = run(HOMED, SWITCHING_ON, script)
    assert begin(HOMED).mode == Mode.HOMING
    assert controlwords[:5] == [0x0F] * 5
    assert set(controlwords[5:-1]) == {0x1F}
    assert controlwords[-1] == 0x0F
    assert (sequence.phase, sequence.mode, problems) == (Phase.SETTLING, Mode.CYCLIC_SYNC_TORQUE, [])


def test_homing_bits_of_an_earlier_homing_are_ignored() -> None:
    """A drive that was homed before says so the moment it is in homing mode."""
    sequence, controlwords, _ = run(HOMED, SWITCHING_ON, [HOMING_DONE] * 9)
    assert sequence.phase == Phase.HOMING
    assert controlwords[-1] == 0x1F


@pytest.mark.parametrize("statusword", [HOMING_DONE, HOMING_FAILED])
def test_statusword_older_than_the_command_is_ignored(statusword: int) -> None:
    """Inputs that come 15 cycles late still tell of the homing before this one."""
    sequence, answered = home(), 2 * HOMING_START_CYCLES + 15
    for cycle in range(answered):
        step = advance(HOMED, sequence, statusword, age=15)
        assert (cycle, step.sequence.phase, step.problem) == (cycle, Phase.HOMING, Problem.NONE)
        sequence = step.sequence
    step = advance(HOMED, sequence, statusword, age=15)
    assert (step.sequence.phase == Phase.SETTLING) == (statusword == HOMING_DONE)
    assert bool(step.problem) == (statusword == HOMING_FAILED)


@pytest.mark.parametrize(("route", "start"), [(HOMED, Phase.HOMING), (UNHOMED, Phase.SWITCHING_ON)])
def test_servo_phase_does_not_begin_in_a_cycle_with_missing_inputs(route: Route, start: Phase) -> None:
    sequence = Sequence(int(start), 50, int(Mode.HOMING) if route.homing else route.mode)
    step = advance(route, sequence, HOMING_DONE, complete=False)
    assert (step.sequence, step.problem) == (sequence._replace(cycles=51), Problem.NONE)
    assert advance(route, step.sequence, HOMING_DONE).sequence == Sequence(int(Phase.SETTLING), 0, route.mode)


def test_drive_that_is_homed_already_goes_straight_to_its_working_mode() -> None:
    again = begin(HOMED, homed=True)
    sequence, _, _ = run(HOMED, again, [FAULT] * 30 + [DISABLED, READY, SWITCHED_ON, ENABLED])
    assert again.mode == Mode.CYCLIC_SYNC_TORQUE
    assert sequence.phase == Phase.SETTLING


def test_homing_again_begins_and_ends_under_power() -> None:
    sequence, controlwords, problems = run(HOMED, home(), [ENABLED] * 12 + [HOMING_DONE])
    assert set(controlwords) == {0x0F, 0x1F}
    assert (sequence.phase, sequence.mode, problems) == (Phase.SETTLING, Mode.CYCLIC_SYNC_TORQUE, [])


def test_settling_ends_in_servo_and_stays_there() -> None:
    start = Sequence(int(Phase.SETTLING), 0, int(Mode.CYCLIC_SYNC_TORQUE))
    sequence, controlwords, _ = run(HOMED, start, [ENABLED] * SETTLING_CYCLES)
    assert sequence.phase == Phase.SERVO
    assert run(HOMED, sequence, [ENABLED] * 5)[0] == sequence
    assert set(controlwords) == {0x0F}


def test_fault_is_reset_by_edges_until_it_clears() -> None:
    _, controlwords, problems = run(UNHOMED, begin(UNHOMED), [FAULT] * (4 * FAULT_RESET_CYCLES))
    edges = [i for i in range(1, len(controlwords)) if controlwords[i] == 0x80 and controlwords[i - 1] == 0]
    assert edges == [FAULT_RESET_CYCLES, 3 * FAULT_RESET_CYCLES]
    assert problems == []


@pytest.mark.parametrize(
    ("route", "start", "statusword", "limit_s", "problem"),
    [
        (UNHOMED, SWITCHING_ON, FAULT, SWITCH_ON_LIMIT_S, "stays in fault"),
        (UNHOMED, SWITCHING_ON, DISABLED, SWITCH_ON_LIMIT_S, "stays in switch on disabled"),
        (
            HOMED,
            Sequence(int(Phase.HOMING), 0, int(Mode.HOMING)),
            ENABLED,
            HOMING_LIMIT_S,
            "did not finish homing in 120 s",
        ),
    ],
)
def test_every_wait_is_bounded(
    route: Route, start: Sequence, statusword: int, limit_s: float, problem: str
) -> None:
    limit_cycles = round(limit_s / PERIOD_S)
    early = start._replace(cycles=limit_cycles - 1)
    late = start._replace(cycles=limit_cycles + 1)
    assert problem_of(advance(route, early, statusword), statusword) == ""
    assert problem_of(advance(route, late, statusword), statusword) == problem


def test_homing_error_is_a_problem_at_once() -> None:
    start = Sequence(int(Phase.HOMING), 50, int(Mode.HOMING))
    assert run(HOMED, start, [HOMING_FAILED])[2] == ["reports a homing error"]


@pytest.mark.parametrize("phase", [Phase.SETTLING, Phase.SERVO])
def test_drive_that_leaves_operation_enabled_is_a_problem(phase: Phase) -> None:
    script = [FAULT, ENABLED, ENABLED, DISABLED]
    sequence, controlwords, problems = run(
        HOMED, Sequence(int(phase), 3, int(Mode.CYCLIC_SYNC_TORQUE)), script
    )
    assert (controlwords, problems) == ([0, 0, 0, 0], ["is in fault"])
    assert sequence.phase == Phase.OFF, "it is not led again, whatever it says afterwards"


@pytest.mark.parametrize("first", [ENABLED, QUICK_STOP, 0x0000])
def test_drive_that_is_found_with_power_brakes_before_it_is_switched_on(first: int) -> None:
    """Left enabled by a killed controller, or commanded by another one; 0 when it has sent nothing."""
    script = [first, ENABLED, QUICK_STOP, DISABLED, READY, SWITCHED_ON, ENABLED]
    sequence, controlwords, problems = run(HOMED, begin(HOMED), script)
    assert controlwords[1:] == [0x02, 0x02, 0x06, 0x07, 0x0F, 0x0F]
    assert controlwords[0] in {0x00, 0x02}
    assert (sequence.phase, problems) == (Phase.HOMING, [])


def test_drive_that_does_not_brake_loses_its_power_and_is_then_a_problem() -> None:
    start = begin(UNHOMED)
    braking = start._replace(cycles=round(QUICK_STOP_LIMIT_S / PERIOD_S) + 1)
    assert advance(UNHOMED, braking, QUICK_STOP).controlword == 0x00
    late = start._replace(cycles=round(SWITCH_ON_LIMIT_S / PERIOD_S) + 1)
    assert problem_of(advance(UNHOMED, late, ENABLED), ENABLED) == "stays in operation enabled"


def test_silent_drive_is_commanded_to_brake() -> None:
    start = lose(Sequence(int(Phase.SERVO), 9, int(Mode.CYCLIC_SYNC_TORQUE)))
    sequence, controlwords, problems = run(HOMED, start, [ENABLED] * 3)
    assert (sequence.phase, controlwords, problems) == (Phase.LOST, [0x02] * 3, [])


def test_quick_stop_waits_for_the_drive_and_then_takes_the_power() -> None:
    start = brake(Sequence(int(Phase.HOMING), 7, int(Mode.HOMING)))
    sequence, controlwords, _ = run(HOMED, start, [ENABLED, QUICK_STOP, QUICK_STOP, DISABLED, DISABLED])
    assert controlwords == [0x02, 0x02, 0x02, 0x00, 0x00]
    assert (sequence.phase, sequence.mode) == (Phase.OFF, Mode.HOMING)


def test_quick_stop_and_switching_off_are_bounded() -> None:
    never_stops = brake(begin(UNHOMED))._replace(cycles=round(QUICK_STOP_LIMIT_S / PERIOD_S) + 1)
    assert advance(UNHOMED, never_stops, QUICK_STOP).sequence.phase == Phase.DISABLING
    never_off = release(begin(UNHOMED))._replace(cycles=round(DISABLE_LIMIT_S / PERIOD_S) + 1)
    assert advance(UNHOMED, never_off, ENABLED).sequence.phase == Phase.OFF


@pytest.mark.parametrize("statusword", [DISABLED, READY, FAULT])
def test_drive_without_power_is_off_at_once(statusword: int) -> None:
    sequence, controlwords, _ = run(UNHOMED, release(begin(UNHOMED)), [statusword])
    assert (sequence.phase, controlwords) == (Phase.OFF, [0])
