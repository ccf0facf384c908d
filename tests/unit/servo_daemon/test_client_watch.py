"""How long a client may be silent in a motion that it requested, in cycles."""

import pytest

from servo_ctrl.commands.client_activity import ClientActivity
from servo_ctrl.daemon.run.client_watch import LOCKSTEP_SILENCE_S, SILENCE_S, ClientWatch

PERIOD_S = 1e-3


@pytest.mark.parametrize(("lockstep", "silence_s"), [(False, SILENCE_S), (True, LOCKSTEP_SILENCE_S)])
def test_a_silent_client_ends_the_motion_after_a_stated_time(lockstep: bool, silence_s: float) -> None:
    watch = ClientWatch(ClientActivity(), PERIOD_S, lockstep=lockstep)
    cycles = round(silence_s / PERIOD_S)
    assert [watch.step() for _ in range(cycles + 2)] == [*[False] * (cycles - 1), True, False, False]
    assert watch.problem == f"the program that asked for it was silent for {silence_s:g} s"


def test_a_client_with_requests_in_time_does_not() -> None:
    activity = ClientActivity()
    watch = ClientWatch(activity, PERIOD_S, lockstep=False)
    for _ in range(5):
        activity.requests += 1
        assert not any(watch.step() for _ in range(round(SILENCE_S / PERIOD_S) - 1))
    assert watch.problem == ""


def test_a_client_that_is_disconnected_ends_it_in_the_next_cycle() -> None:
    activity = ClientActivity()
    watch = ClientWatch(activity, PERIOD_S, lockstep=False)
    assert not watch.step()
    activity.disconnected = True
    assert watch.step()
    assert watch.problem == "the connection that asked for it was lost"
