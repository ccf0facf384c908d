"""What the Bus page shows."""

import pytest
from stub_status import first_status

from servo_ctrl.config.local_status import Histogram
from servo_ctrl.hmi.bus_view import (
    bin_names,
    cycle_figure,
    cycle_summary,
    emcy_rows,
    figures,
    node_rows,
    register_text,
)

FIRST = first_status()
TIMES = Histogram(edges_us=(900.0, 1000.0, 1100.0), counts=(0, 480, 519, 1))


def test_every_bin_has_a_name_and_a_bar() -> None:
    assert len(bin_names(TIMES.edges_us)) == len(TIMES.counts)
    figure = cycle_figure(TIMES, 1e-3, dark=False)
    low, high = figure["layout"]["yaxis"]["range"]
    assert 10.0**low < min(filter(None, TIMES.counts))  # a single cycle has a bar that can be seen
    assert 10.0**high > max(TIMES.counts)
    bars = figure["data"][0]
    assert dict(zip(bars["x"], bars["y"], strict=True)) == {
        "< 900": None,  # there is no zero on a logarithmic axis
        "900\N{EN DASH}1000": 480,
        "1000\N{EN DASH}1100": 519,
        "≥ 1100": 1,
    }


def test_the_histogram_in_words_names_most_and_slowest() -> None:
    said = cycle_summary(TIMES)
    assert said == "1000 cycles; 51.9 % took 1000\N{EN DASH}1100 µs; the slowest 1 took ≥ 1100 µs."
    assert cycle_summary(Histogram(edges_us=(), counts=(0,))) == "No cycle was timed yet."
    assert cycle_summary(Histogram(edges_us=(), counts=(3,))).startswith("3 cycles")


@pytest.mark.parametrize(
    ("field", "value", "key"),
    [("load", 0.81, "load"), ("missed_ticks", 1, "missed-ticks"), ("missing_inputs", 2, "missing-inputs")],
)
def test_what_is_out_of_the_ordinary_is_worth_a_look(field: str, value: float, key: str) -> None:
    assert not any(figure.worth_a_look for figure in figures(FIRST.bus))
    changed = figures(FIRST.bus.model_copy(update={field: value}))
    assert [figure.key for figure in changed if figure.worth_a_look] == [key]


@pytest.mark.parametrize(
    ("state", "age_s", "odd", "heartbeat"),
    [
        ("operational", 0.05, False, "0.05 s ago"),
        ("operational", None, False, "none heard"),
        ("operational", 2.5, True, "2.50 s ago"),
        ("pre_operational", 0.1, True, "0.10 s ago"),
        ("unknown", None, True, "none heard"),
    ],
)
def test_a_node_that_is_not_well_is_worth_a_look(
    state: str, age_s: float | None, odd: bool, heartbeat: str
) -> None:
    node = FIRST.nodes[0].model_copy(update={"nmt_state": state, "heartbeat_age_s": age_s})
    (row,) = node_rows([node])
    assert (row.worth_a_look, row.heartbeat) == (odd, heartbeat)


def test_emergencies_come_newest_first_with_their_register_in_words() -> None:
    entry = FIRST.emcy[0]
    later = entry.model_copy(update={"code": 0x3210, "error_register": 0b101})
    rows = emcy_rows([entry, later])
    assert [row.code for row in rows] == ["3210h", "8611h"]
    assert rows[0].register == "generic, voltage"
    assert register_text(0) == "no error"
