"""`cyclictest` (package rt-tests) as the yardstick: what a C program gets of this kernel."""

import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Mapping

HISTOGRAM_US = 20_000
PRIORITY = 80
_BIN = re.compile(r"^(\d{6}) (\d{6,})$", re.MULTILINE)
_OVERFLOWS = re.compile(r"^# Histogram Overflows: (\d+)$", re.MULTILINE)


def available() -> bool:
    """Whether it is installed."""
    return shutil.which("cyclictest") is not None


def run(ticks: int, period_us: int, *, fifo: bool) -> Counter[int]:
    """Lateness in whole microseconds -> number of ticks; what is later than the histogram counts as its end.

    Raises:
        subprocess.SubprocessError: it failed, as it does where SCHED_FIFO is not permitted.

    """
    policy = ["--priority", str(PRIORITY), "--mlockall"] if fifo else ["--policy", "other"]
    histogram = ["--histogram", str(HISTOGRAM_US)]
    command = [
        "cyclictest",
        "--quiet",
        "--interval",
        str(period_us),
        "--loops",
        str(ticks),
        *histogram,
        *policy,
    ]
    done = subprocess.run(
        command, check=True, capture_output=True, text=True, timeout=10.0 + 4e-6 * ticks * period_us
    )
    return histogram_of(done.stdout)


def histogram_of(printed: str) -> Counter[int]:
    """The histogram that `--histogram` prints."""
    counts = Counter({int(late_us): int(ticks) for late_us, ticks in _BIN.findall(printed) if int(ticks)})
    for overflows in _OVERFLOWS.findall(printed):
        counts[HISTOGRAM_US] += int(overflows)
    return counts


def percentile_us(counts: Mapping[int, int], share: float) -> float:
    """The lateness that this share (0..1) of the ticks does not exceed, microseconds."""
    wanted, seen = share * sum(counts.values()), 0
    for late_us in sorted(counts):
        seen += counts[late_us]
        if seen >= wanted:
            return float(late_us)
    raise ValueError("an empty histogram")
