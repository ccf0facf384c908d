"""The fault policy: complete, and sensible over all pairs of stage and event."""

from itertools import product
from pathlib import Path

import pytest

from servo_ctrl.axis.fault_bounds import BOUND_CYCLES
from servo_ctrl.axis.fault_policy import ENDS_THE_RUN, REACTIONS, REQUESTS, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage

PAIRS = list(product(Stage, Event))
MOVING = (Stage.READY, Stage.RUNNING)


@pytest.mark.parametrize(("stage", "event"), PAIRS)
def test_every_pair_has_a_reaction(stage: Stage, event: Event) -> None:
    assert isinstance(reaction(stage, event), Reaction)


def test_table_has_no_other_entries() -> None:
    assert {(stage, event) for stage, table in REACTIONS.items() for event in table} == set(PAIRS)


@pytest.mark.parametrize(("stage", "event"), list(product(MOVING, Event)))
def test_no_event_is_ignored_while_the_controller_moves_the_axes(stage: Stage, event: Event) -> None:
    assert reaction(stage, event) > Reaction.NONE


@pytest.mark.parametrize("event", [Event.LOST_TPDO, Event.FOLLOWING_ERROR])
@pytest.mark.parametrize("stage", [*MOVING, Stage.STOPPING])
def test_no_controlled_stop_without_feedback(stage: Stage, event: Event) -> None:
    assert reaction(stage, event) is Reaction.QUICK_STOP


@pytest.mark.parametrize("event", Event)
def test_controlled_stop_only_while_the_controller_moves_the_axes(event: Event) -> None:
    for stage in Stage:
        if reaction(stage, event) is Reaction.HOLD:
            assert stage in MOVING


RANK = {
    Stage.STOPPING: Reaction.HOLD,
    Stage.QUICK_STOPPING: Reaction.QUICK_STOP,
    Stage.DISABLING: Reaction.DISABLE,
}
DOCUMENT = Path(__file__).parents[3] / "docs" / "fault_policy.md"


def rows_of(columns: int) -> list[list[str]]:
    """The rows of the document's tables with so many columns."""
    lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if line.startswith("|")]
    return [row for row in rows if len(row) == columns and row[0] != "---"]


@pytest.mark.parametrize(("stage", "event"), list(product(RANK, Event)))
def test_no_event_makes_a_stop_milder(stage: Stage, event: Event) -> None:
    wanted = reaction(stage, event)
    assert wanted is Reaction.NONE or wanted >= RANK[stage]


@pytest.mark.parametrize("event", [e for e in Event if e is not Event.BUS_DOWN])
def test_nothing_changes_once_power_is_off(event: Event) -> None:
    assert reaction(Stage.DISABLING, event) is Reaction.NONE
    assert reaction(Stage.OFF, event) is Reaction.NONE


def test_bus_failure_ends_every_powered_stage() -> None:
    assert {stage for stage in Stage if reaction(stage, Event.BUS_DOWN) is Reaction.DISABLE} == set(Stage) - {
        Stage.OFF
    }


@pytest.mark.parametrize("event", Event)
def test_nothing_moves_in_standby_and_only_what_ends_the_run_is_reacted_to(event: Event) -> None:
    assert reaction(Stage.STANDBY, event) in {Reaction.NONE, Reaction.DISABLE}
    assert (reaction(Stage.STANDBY, event) is Reaction.DISABLE) == (event in ENDS_THE_RUN)


@pytest.mark.parametrize("stage", [*MOVING, Stage.STARTING, Stage.STOPPING])
def test_quick_stop_command_brakes_in_every_stage_that_can_move(stage: Stage) -> None:
    assert reaction(stage, Event.QUICK_STOP) is Reaction.QUICK_STOP


def test_requested_stops_are_at_least_controlled_stops_while_the_axes_move() -> None:
    assert {reaction(stage, request) for stage in MOVING for request in REQUESTS} == {
        Reaction.HOLD,
        Reaction.QUICK_STOP,
    }


def test_a_repeated_stop_request_escalates() -> None:
    assert reaction(Stage.RUNNING, Event.STOP_SIGNAL) is Reaction.HOLD
    assert reaction(Stage.STOPPING, Event.STOP_SIGNAL) is Reaction.QUICK_STOP
    assert reaction(Stage.QUICK_STOPPING, Event.STOP_SIGNAL) is Reaction.DISABLE


def test_runaway_takes_power_off_wherever_a_loop_is_closed() -> None:
    closed = {Stage.STARTING, Stage.READY, Stage.RUNNING, Stage.STOPPING, Stage.QUICK_STOPPING}
    assert {stage for stage in Stage if reaction(stage, Event.RUNAWAY) is Reaction.CUT_OFF} == closed
    assert all(event is Event.RUNAWAY for stage, event in PAIRS if reaction(stage, event) is Reaction.CUT_OFF)


def test_document_shows_the_table() -> None:
    shown = {row[0]: row[1:] for row in rows_of(1 + len(Stage))}
    assert shown.pop("event") == [stage.name.lower().replace("_", " ") for stage in Stage]
    assert shown == {
        event.value: [
            reaction(stage, event).name.lower().replace("_", " ").replace("none", "") for stage in Stage
        ]
        for event in Event
    }


def test_document_gives_condition_bound_and_recovery_of_every_event() -> None:
    heading, *rows = rows_of(5)
    assert [row[0] for row in rows] == [event.value for event in Event]
    assert [int(row[heading.index("reacts within")]) for row in rows] == list(BOUND_CYCLES.values())
    assert all(cell for row in rows for cell in row)
