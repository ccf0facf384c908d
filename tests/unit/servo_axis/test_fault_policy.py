"""The fault policy: complete, and sensible over all pairs of stage and event."""

from itertools import product
from pathlib import Path

import pytest

from servo_ctrl.axis.fault_bounds import BOUND_CYCLES
from servo_ctrl.axis.fault_policy import ENDS_THE_RUN, REACTIONS, WISHES, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage

PAIRS = list(product(Stage, Event))
MOVING = (Stage.READY, Stage.RUNNING)


@pytest.mark.parametrize(("stage", "event"), PAIRS)
def test_every_pair_has_a_reaction(stage: Stage, event: Event) -> None:
    assert isinstance(reaction(stage, event), Reaction)


def test_table_has_nothing_else() -> None:
    assert {(stage, event) for stage, table in REACTIONS.items() for event in table} == set(PAIRS)


@pytest.mark.parametrize(("stage", "event"), list(product(MOVING, Event)))
def test_nothing_is_ignored_while_we_lead_the_axes(stage: Stage, event: Event) -> None:
    assert reaction(stage, event) > Reaction.NONE


@pytest.mark.parametrize("event", [Event.LOST_TPDO, Event.FOLLOWING_ERROR])
@pytest.mark.parametrize("stage", [*MOVING, Stage.STOPPING])
def test_our_own_ramp_is_not_trusted_without_feedback(stage: Stage, event: Event) -> None:
    assert reaction(stage, event) is Reaction.QUICK_STOP


@pytest.mark.parametrize("event", Event)
def test_controlled_stop_is_ours_to_give_only_while_we_lead(event: Event) -> None:
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
def test_stop_that_has_reached_power_off_is_left_alone(event: Event) -> None:
    assert reaction(Stage.DISABLING, event) is Reaction.NONE
    assert reaction(Stage.OFF, event) is Reaction.NONE


def test_dead_bus_ends_everything_that_is_on() -> None:
    assert {stage for stage in Stage if reaction(stage, Event.BUS_DOWN) is Reaction.DISABLE} == set(Stage) - {
        Stage.OFF
    }


@pytest.mark.parametrize("event", Event)
def test_nothing_moves_in_standby_and_only_what_ends_the_run_is_reacted_to(event: Event) -> None:
    assert reaction(Stage.STANDBY, event) in {Reaction.NONE, Reaction.DISABLE}
    assert (reaction(Stage.STANDBY, event) is Reaction.DISABLE) == (event in ENDS_THE_RUN)


@pytest.mark.parametrize("stage", [*MOVING, Stage.STARTING, Stage.STOPPING])
def test_operators_quick_stop_brakes_wherever_something_may_move(stage: Stage) -> None:
    assert reaction(stage, Event.QUICK_STOP) is Reaction.QUICK_STOP


def test_what_is_asked_for_is_never_milder_than_a_controlled_stop_while_we_lead() -> None:
    assert {reaction(stage, wish) for stage in MOVING for wish in WISHES} == {
        Reaction.HOLD,
        Reaction.QUICK_STOP,
    }


def test_asking_again_is_asking_for_more() -> None:
    assert reaction(Stage.RUNNING, Event.STOP_SIGNAL) is Reaction.HOLD
    assert reaction(Stage.STOPPING, Event.STOP_SIGNAL) is Reaction.QUICK_STOP
    assert reaction(Stage.QUICK_STOPPING, Event.STOP_SIGNAL) is Reaction.DISABLE


def test_axis_that_runs_away_is_cut_off_wherever_a_loop_is_closed_on_it() -> None:
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


def test_document_says_when_how_soon_and_how_to_go_on_for_every_event() -> None:
    heading, *rows = rows_of(5)
    assert [row[0] for row in rows] == [event.value for event in Event]
    assert [int(row[heading.index("reacts within")]) for row in rows] == list(BOUND_CYCLES.values())
    assert all(cell for row in rows for cell in row)
