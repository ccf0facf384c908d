"""The page with a stub for a machine, as a process of its own.

`python -m tests.browser.stub_server PORT OUT [ACCESS CERTIFICATE KEY]`. The test controls the stub by
routes that the real page does not have.
"""

import sys
import time
from pathlib import Path
from typing import Any, cast

from nicegui import app

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from patient_pages import make_pages_patient
from stub_link import StubLink

from servo_ctrl.commands.local_codec import from_plain, to_plain
from servo_ctrl.commands.local_messages import Hello, LocalAnswer
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.access.admission import load_access
from servo_ctrl.hmi.access.control_right import ControlRight
from servo_ctrl.hmi.app import serve
from servo_ctrl.hmi.diagnosis import diagnoses
from servo_ctrl.hmi.shell.open_page import PageServices
from servo_ctrl.hmi.tuning import page_tunings


def steer(link: StubLink, control: ControlRight) -> None:
    """Add the routes; asynchronous ones, because the link belongs to the thread of the loop."""

    @app.get("/stub/requests")
    async def requests() -> list[dict[str, Any]]:
        return [request.model_dump(exclude_none=True) for request in link.requests]

    @app.post("/stub/status")
    async def status(fields: dict[str, Any]) -> int:
        whole = from_plain(MachineStatus, {**to_plain(link.status), **fields})
        link.change(**{name: getattr(whole, name) for name in fields})
        return link.status.cycles

    @app.post("/stub/link")
    async def change(fields: dict[str, Any]) -> None:
        if fields.get("reset"):
            fresh = StubLink()
            link.connected, link.hello, link.answers = True, fresh.hello, {}
            link.change(**fresh.status._asdict() | {"cycles": link.status.cycles})
            holder = control.holder(time.monotonic())
            if holder is not None:
                control.release(holder.browser, time.monotonic())
        link.connected = fields.get("connected", link.connected)
        link.hello = from_plain(Hello, {**to_plain(link.hello), **fields.get("hello", {})})
        for name, answer in fields.get("answers", {}).items():
            link.answers[name] = from_plain(LocalAnswer, {"id": 0, **answer})


if __name__ == "__main__":
    port, out = int(sys.argv[1]), Path(sys.argv[2])
    access, certificate, key = [Path(name) for name in sys.argv[3:]] or [None, None, None]
    here = Path(__file__)
    diagnoses.installed_command = lambda: (sys.executable, str(here.with_name("diagnosis_stand_in.py")))
    real, stand_in = Path(sys.executable).with_name("servo-ctrl"), here.with_name("tuning_stand_in.py")
    page_tunings.installed_command = lambda: (sys.executable, str(stand_in), str(real))
    stub = StubLink()
    right = ControlRight()
    steer(stub, right)
    make_pages_patient()
    visitors = load_access("127.0.0.1", access, certificate, key)
    services = PageServices(cast("Any", stub), visitors, right, out)
    serve(services, "127.0.0.1", port, certificate, key)
