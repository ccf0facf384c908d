"""The Bus page of a machine in lockstep: cycles that take as long as they need, and a load near its bound."""

from nicegui import ElementFilter, ui
from page_in_process import PageInProcess

from servo_ctrl.commands.bus_status import CycleHistogram
from servo_ctrl.hmi.bus import page as bus

SLOW = CycleHistogram(edges_us=(900.0, 1000.0, 1100.0), counts=(3, 20, 40, 900))
"""Nearly all cycles take longer than the period of 1,000 us."""
ALARMS = {"warn", "bad"}
"""Tones of a state."""


def tones(page: PageInProcess) -> set[str]:
    """Tones of all states and notes that are shown."""
    assert page.user.client is not None
    with page.user.client.content:
        shown = [label for label in ElementFilter(kind=ui.label) if label.visible]
    return {tone for label in shown for tone in label.classes} & ALARMS


def axis_title(page: PageInProcess) -> str:
    [plot] = page.user.find(kind=ui.plotly, marker="cycle-plot").elements
    figure = plot.figure
    assert isinstance(figure, dict)
    layout = figure["layout"]
    return str(layout["xaxis"]["title"]) if "xaxis" in layout else ""


async def show(page: PageInProcess, *, lockstep: bool) -> None:
    link = page.link
    link.hello = link.hello._replace(lockstep=lockstep)
    link.change(bus=link.status.bus._replace(load=0.79, cycle_us=SLOW))
    await page.show(bus.build)
    await page.until(lambda: page.text("load") == "79.0 %" and "cycle time" in axis_title(page))


async def test_in_lockstep_histogram_and_load_do_not_look_like_alarms(shown_page: PageInProcess) -> None:
    await show(shown_page, lockstep=True)
    assert not tones(shown_page)
    assert not shown_page.shows("\N{WARNING SIGN}")
    assert "nominal" not in axis_title(shown_page)
    assert "none of these times is late" in shown_page.text("cycle-lockstep")
    assert shown_page.shows("fine up to 80 %"), "the load has its threshold beside it"


async def test_in_real_time_cycles_stand_against_their_period_and_a_load_above_its_bound_is_an_alarm(
    shown_page: PageInProcess,
) -> None:
    await show(shown_page, lockstep=False)
    assert "nominal 1000" in axis_title(shown_page)
    assert not shown_page.text("cycle-lockstep")
    shown_page.link.change(bus=shown_page.link.status.bus._replace(load=0.81))
    await shown_page.until(lambda: shown_page.text("load").startswith("\N{WARNING SIGN} 81"))
    assert tones(shown_page) == {"warn"}
