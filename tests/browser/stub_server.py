"""The page with a stub for a machine, as a process: `python tests/browser/stub_server.py PORT OUT [access certificate key]`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, cast

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from stub_link import StubLink

from servo_ctrl.hmi.__main__ import admission
from servo_ctrl.hmi.app import Listening, serve
from servo_ctrl.hmi.bench import Bench, Directories
from servo_ctrl.hmi.control_right import ControlRight

if __name__ == "__main__":
    port, out = int(sys.argv[1]), Path(sys.argv[2])
    files = [Path(name) for name in sys.argv[3:]] or [None, None, None]
    access, certificate, key = files
    bench = Bench(
        cast("Any", StubLink()),
        admission("127.0.0.1", access, certificate, key),
        ControlRight(),
        Directories(out),
    )
    serve(bench, Listening("127.0.0.1", port, certificate, key))
