"""The contents of the Bus page."""

import math

import pytest
from stub_status import first_status

from servo_ctrl.commands.bus_status import CycleHistogram
from servo_ctrl.hmi.bus.page import (
    bin_names,
    cycle_figure,
    cycle_summary,
    emcy_rows,
    node_rows,
    register_text,
    traffic_figures,
)
from servo_ctrl.hmi.shell.plots import LIGHT

FIRST = first_status()
TIMES = CycleHistogram(edges_us=(900.0, 1000.0, 1100.0), counts=(0, 480, 519, 1))


def test_every_bin_has_a_name_and_a_bar() -> None:
    assert len(bin_names(TIMES.edges_us)) == len(TIMES.counts)
    in_lockstep = cycle_figure(TIMES, None, LIGHT)
    assert "nominal" not in str(in_lockstep["layout"]["xaxis"])
    figure = cycle_figure(TIMES, 1e-3, LIGHT)
    assert "nominal 1000" in str(figure["layout"]["xaxis"])
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


def test_the_summary_names_the_most_frequent_and_the_slowest_bin() -> None:
    summary = cycle_summary(TIMES)
    assert summary == "1000 cycles; 51.9 % took 1000\N{EN DASH}1100 µs; the slowest 1 took ≥ 1100 µs."
    assert cycle_summary(CycleHistogram(edges_us=(), counts=(0,))) == "No cycle was timed yet."
    assert cycle_summary(CycleHistogram(edges_us=(), counts=(3,))).startswith("3 cycles")


@pytest.mark.parametrize(
    ("field", "value", "key"),
    [("load", 0.81, "load"), ("missed_ticks", 1, "missed-ticks"), ("missing_inputs", 2, "missing-inputs")],
)
def test_an_unusual_figure_is_notable(field: str, value: float, key: str) -> None:
    assert not any(figure.notable for figure in traffic_figures(FIRST.bus))
    assert traffic_figures(FIRST.bus)[0].name == "load of 1 Mbit/s, fine up to 80 %"
    changed = traffic_figures(FIRST.bus._replace(**{field: value}))
    assert [figure.key for figure in changed if figure.notable] == [key]


@pytest.mark.parametrize(
    ("state", "age_s", "odd", "heartbeat"),
    [
        ("operational", 0.05, False, "0.05 s ago"),
        ("operational", math.nan, False, "none received"),
        ("operational", 2.5, True, "2.50 s ago"),
        ("pre_operational", 0.1, True, "0.10 s ago"),
        ("unknown", math.nan, True, "none received"),
    ],
)
def test_a_node_that_is_not_operational_or_late_is_marked(
    state: str, age_s: float, odd: bool, heartbeat: str
) -> None:
    node = FIRST.nodes[0]._replace(nmt_state=state, heartbeat_age_s=age_s)
    (row,) = node_rows([node])
    sign = "\N{WARNING SIGN}" if odd else "\N{CHECK MARK}"
    assert row[2].startswith(sign)
    assert row[3] == heartbeat


def test_emergencies_are_listed_newest_first_with_their_register_as_text() -> None:
    entry = FIRST.emcy[0]
    later = entry._replace(code=0x3210, error_register=0b101)
    rows = emcy_rows([entry, later])
    assert [row[2] for row in rows] == ["3210h", "8611h"]
    assert rows[0][3] == "generic, voltage"
    assert register_text(0) == "no error"
