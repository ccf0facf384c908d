"""The page with a stub for a machine, as a process of its own.

`python tests/browser/stub_server.py PORT OUT [ACCESS CERTIFICATE KEY]`. The test steers the stub by routes
that the real page does not have.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any, cast

from nicegui import app

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from stub_link import StubLink

from servo_ctrl.config.local_messages import Answer, Hello
from servo_ctrl.config.local_status import Status
from servo_ctrl.hmi import reconcile_room
from servo_ctrl.hmi.admission import admission
from servo_ctrl.hmi.app import Listening, serve
from servo_ctrl.hmi.bench import Bench, Directories
from servo_ctrl.hmi.control_right import ControlRight


def steer(link: StubLink, control: ControlRight) -> None:
    """The routes; asynchronous ones, for the link is of the loop's thread."""

    @app.get("/stub/requests")
    async def requests() -> list[dict[str, Any]]:
        return [request.model_dump(exclude_none=True) for request in link.requests]

    @app.post("/stub/status")
    async def status(fields: dict[str, Any]) -> None:
        whole = Status.model_validate({**link.status.model_dump(), **fields})
        link.change(**{name: getattr(whole, name) for name in fields})

    @app.post("/stub/link")
    async def change(fields: dict[str, Any]) -> None:
        if fields.get("reset"):
            fresh = StubLink()
            link.connected, link.hello, link.answers = True, fresh.hello, {}
            link.change(**dict(fresh.status) | {"cycles": link.status.cycles})
            holder = control.holder(time.monotonic())
            if holder is not None:
                control.release(holder.browser, time.monotonic())
        link.connected = fields.get("connected", link.connected)
        link.hello = Hello.model_validate({**link.hello.model_dump(), **fields.get("hello", {})})
        for name, answer in fields.get("answers", {}).items():
            link.answers[name] = Answer.model_validate({"id": 0, **answer})


if __name__ == "__main__":
    port, out = int(sys.argv[1]), Path(sys.argv[2])
    access, certificate, key = [Path(name) for name in sys.argv[3:]] or [None, None, None]
    reconcile_room.COMMAND = (sys.executable, str(Path(__file__).with_name("diagnosis_stand_in.py")))
    stub = StubLink()
    right = ControlRight()
    steer(stub, right)
    known = admission("127.0.0.1", access, certificate, key)
    serve(
        Bench(cast("Any", stub), known, right, Directories(out)),
        Listening("127.0.0.1", port, certificate, key),
    )
