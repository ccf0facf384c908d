"""Memory of the recorder's library: with --fifo all of it is locked."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from servo_ctrl.files.arrow import read_parts, write_part
from servo_ctrl.recording.channels import Channel

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
pandas = "pandas" in sys.modules
read_parts([part])
print(mib() - before, pandas)
"""
DTYPES = ("float64", "int64", "int32", "uint16")


def test_recorder_reserves_no_gigabyte(tmp_path: Path) -> None:
    command = [sys.executable, "-c", PROGRAM, str(tmp_path / "part.parquet")]
    grown = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    mib, pandas = grown.stdout.split()
    assert float(mib) < 700.0
    assert pandas == "False"  # 45 MB, and 0.3 s of the run that writes its first part


def test_every_type_of_a_channel_is_read_as_it_was_written(tmp_path: Path) -> None:
    rows = np.arange(4.0 * len(DTYPES)).reshape(4, -1)
    rows[1, 0] = np.nan
    channels = [Channel("m", "", dtype, dtype) for dtype in DTYPES]
    write_part(tmp_path / "part.parquet", channels, rows)
    columns = read_parts([tmp_path / "part.parquet"])
    for place, dtype in enumerate(DTYPES):
        assert columns[dtype].dtype == dtype
        np.testing.assert_array_equal(columns[dtype], rows[:, place])
