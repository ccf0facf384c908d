"""Events: the first and the newest are kept for weeks, and repetitions do not hide them."""

from servo_ctrl.daemon.cycle.event_log import FIRST_KEPT, NEWEST_KEPT, EventLog


def test_first_and_newest_events_are_kept_and_all_are_counted() -> None:
    log = EventLog(again_cycles=1000)
    texts = [f"event {number}" for number in range(1000)]
    for cycle, text in enumerate(texts):
        log.add(text, cycle)
    assert log.kept == texts[:FIRST_KEPT] + texts[-NEWEST_KEPT:]
    assert log.count == 1000
    assert log.kept_cycles == [int(text.removeprefix("event ")) for text in log.kept]


def test_an_event_repeated_every_cycle_is_logged_once() -> None:
    log = EventLog(again_cycles=1000)
    for cycle in range(10_000):
        log.add("another controller sends SYNC", cycle)
        log.add("another controller sends heartbeats", cycle)
    assert log.kept == ["another controller sends SYNC", "another controller sends heartbeats"]


def test_an_event_that_recurs_later_is_logged_again() -> None:
    log = EventLog(again_cycles=1000)
    for cycle in (0, 5000, 5500, 7000):
        log.add("learning is due", cycle)
    assert log.kept == ["learning is due"] * 3


def test_its_memory_is_bounded() -> None:
    log = EventLog(again_cycles=10)
    for cycle in range(20_000):
        log.add(f"event {cycle * 7 % 3001}", cycle)
    assert len(log.kept) == FIRST_KEPT + NEWEST_KEPT
    assert len(log._last_cycle) <= FIRST_KEPT + NEWEST_KEPT
