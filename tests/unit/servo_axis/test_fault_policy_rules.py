"""The policy table again, derived from rules: who can stop the axes with a ramp, and who moves them."""

import pytest

from servo_ctrl.axis.fault_policy import ENDS_THE_RUN, REQUESTS, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage

WE_CAN_LEAD = {
    Event.LATE_TICK,
    Event.LOST_HEARTBEAT,
    Event.EMCY,
    Event.DRIVE_FAULT,
    Event.LIMIT,
    Event.SATURATED,
    Event.BAD_PROGRAM,
    Event.OBJECT_CHANGED,
    Event.FRAMES_LOST,
    Event.STOP_SIGNAL,
    Event.DISABLE,
}
"""Position, inputs and set points are good: the axes come to rest on their line."""
NO_LOOP_IS_RIGHT = {Event.RUNAWAY}
NOBODY_HEARS_US = {Event.BUS_DOWN}
ONLY_THE_DRIVES_CAN = set(Event) - WE_CAN_LEAD - NO_LOOP_IS_RIGHT - NOBODY_HEARS_US
PART_OF_HOMING = {Event.LIMIT, Event.LIMIT_SWITCH}
NO_MATTER_WHILE_THE_DRIVE_LEADS = {Event.LATE_TICK, Event.EMCY, Event.BAD_PROGRAM}
WITHOUT_POWER = {Stage.BOOTING, Stage.OFF, Stage.STANDBY}


def by_rule(stage: Stage, event: Event) -> Reaction:  # noqa: PLR0911  # one rule, one line
    if event in NOBODY_HEARS_US:
        return Reaction.NONE if stage is Stage.OFF else Reaction.DISABLE
    if stage in WITHOUT_POWER:
        ends = {Event.STOP_SIGNAL} if stage is not Stage.OFF else set()
        if stage is Stage.STANDBY:  # the cycle goes on there, and there must not be two
            ends |= {Event.FOREIGN_MASTER}
        return Reaction.DISABLE if event in ends else Reaction.NONE
    if stage is Stage.DISABLING:
        return Reaction.NONE
    if event in NO_LOOP_IS_RIGHT:
        return Reaction.CUT_OFF
    if stage is Stage.QUICK_STOPPING:
        return Reaction.DISABLE if event is Event.STOP_SIGNAL else Reaction.NONE
    if stage is Stage.STARTING and event in PART_OF_HOMING | NO_MATTER_WHILE_THE_DRIVE_LEADS:
        return Reaction.NONE
    if stage is Stage.STARTING or event in ONLY_THE_DRIVES_CAN:
        return Reaction.QUICK_STOP
    if stage is Stage.STOPPING:  # that is what it does already, but who asks twice wants it faster
        return Reaction.QUICK_STOP if event is Event.STOP_SIGNAL else Reaction.NONE
    return Reaction.HOLD


@pytest.mark.parametrize("stage", Stage)
def test_table_follows_from_the_rules(stage: Stage) -> None:
    assert {event: reaction(stage, event) for event in Event} == {
        event: by_rule(stage, event) for event in Event
    }


def test_stages_are_numbered_as_in_object_2000h() -> None:
    """What panels and PLCs read must never be renumbered."""
    assert [(stage.value, stage.name.lower()) for stage in Stage] == list(
        enumerate("booting starting ready running stopping quick_stopping disabling off standby".split())  # noqa: SIM905
    )


def test_reactions_are_ordered_by_severity() -> None:
    assert [(one.value, one.name) for one in Reaction] == list(
        enumerate(["NONE", "HOLD", "QUICK_STOP", "CUT_OFF", "DISABLE"])
    )


def test_events_have_distinct_texts() -> None:
    assert len({event.value for event in Event}) == len(list(Event)) == len(Event.__members__)


@pytest.mark.parametrize("event", Event)
def test_requested_stops_are_no_failures_and_an_event_ends_the_run_exactly_if_standby_reacts_to_it(
    event: Event,
) -> None:
    assert (event in REQUESTS) == (event in {Event.STOP_SIGNAL, Event.DISABLE, Event.QUICK_STOP})
    assert (event in ENDS_THE_RUN) == (by_rule(Stage.STANDBY, event) is not Reaction.NONE)
