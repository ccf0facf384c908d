"""The first cycles measure the round trip; no drive gets power before that is over."""

import pytest
from cycle_dialogue import A, B, CycleDialogue, Rx

from servo_ctrl.daemon.run.round_trip import RoundTrip, verdict
from servo_ctrl.io.clock import Lateness

PERIOD_S = 0.5
CYCLES = 4


class Watch:
    """A clock that is moved by hand."""

    now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


def trial_of(notes: list[str]) -> tuple[RoundTrip, Watch]:
    watch = Watch()
    return RoundTrip(PERIOD_S, notes.append, now_ns=watch), watch


def test_inputs_before_the_next_sync_are_held() -> None:
    notes: list[str] = []
    trial, watch = trial_of(notes)
    for cycle in range(CYCLES):
        trial.sync_sent()
        watch.now_ns += 9_000_000
        assert not trial.over
        assert trial.cycle_complete([A, B]) == (cycle < CYCLES - 1)
    assert trial.over
    assert notes == []


def test_inputs_after_the_next_sync_are_reported() -> None:
    notes: list[str] = []
    trial, watch = trial_of(notes)
    for inputs in ([A, B], [A, None], [None, None], [A, B]):
        trial.sync_sent()
        watch.now_ns += 9_000_000
        trial.cycle_complete(inputs)
    assert len(notes) == 1
    expected = "of 4 cycles 2 lacked inputs at the next SYNC; the longest other round trip took 9.0"
    assert notes[0].startswith(f"this computer and its bus do not keep a period of 500 ms: {expected} ms;")


@pytest.mark.parametrize(("late", "held"), [(2, True), (3, False)])
def test_one_cycle_of_a_thousand_may_be_late(late: int, held: bool) -> None:
    times = Lateness()
    for _ in range(2000 - late):
        times.add(300_000)
    assert (verdict(1.0, times, late) == "") == held


def test_a_bus_without_any_answer_is_reported_without_a_measured_round_trip() -> None:
    text = verdict(1.0, Lateness(), 2000)
    assert "of 2000 cycles 2000 lacked inputs at the next SYNC; give it less" in text


def test_a_cycle_shows_its_trial_each_sync_and_lets_it_go() -> None:
    seen: list[object] = []

    class Twice:
        def sync_sent(self) -> None:
            seen.append("sync")

        def cycle_complete(self, inputs: object) -> bool:
            seen.append(inputs)
            return len(seen) < 4

    dialogue = CycleDialogue(lockstep=False, give_up_after=3)
    dialogue.cycle.trial = Twice()
    dialogue.cycle.begin(1)
    dialogue.receive(Rx(0, A), Rx(1, B))
    dialogue.cycle.begin(1)
    dialogue.receive(Rx(0, A))
    dialogue.cycle.begin(1)  # settles the open one without the other node
    dialogue.receive(Rx(0, A), Rx(1, B))
    assert [what == "sync" for what in seen] == [True, False, True, False]
    assert None in seen[3]  # type: ignore[operator]  # a list
    assert dialogue.cycle.trial is None
