"""Pages that keep the connection of a browser that is silent for long, beside other work."""

from functools import cache, partial

from nicegui import app, core, ui

LONGEST_SILENCE_S = 120.0
"""Of a browser or a page, which wait for a processor; on a machine it is 6 s, and the websocket's 20 s.

What is typed without a connection reaches nobody, and after 15 s a page is loaded again, in the middle of
what a test does with it.
"""


def _be_patient() -> None:
    core.sio.eio.ping_timeout = LONGEST_SILENCE_S


@cache
def make_pages_patient() -> None:
    """Have the pages that this process and its forks will serve keep their connections."""
    app.on_startup(_be_patient)
    ui.run = partial(ui.run, ws_ping_timeout=LONGEST_SILENCE_S)
