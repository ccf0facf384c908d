"""Memory of the recorder's library: with --fifo all of it is locked."""

import subprocess
import sys
from pathlib import Path

PROGRAM = """
import sys
from pathlib import Path
import numpy as np
from servo_ctrl.recording.channels import Channel
from servo_ctrl.files.arrow import read_parts, write_part
def mib():
    return int(Path("/proc/self/statm").read_text().split()[0]) * 4096 / 2**20
before = mib()
part = Path(sys.argv[1])
write_part(part, [Channel("m", "a", name="a")], np.zeros((2000, 1)))
read_parts([part])
print(mib() - before)
"""


def test_recorder_reserves_no_gigabyte(tmp_path: Path) -> None:
    command = [sys.executable, "-c", PROGRAM, str(tmp_path / "part.parquet")]
    grown = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert float(grown.stdout) < 700.0
