"""Processor time of processes, from /proc: where a cycle's microseconds are spent."""

import os
from pathlib import Path


def children(pid: int | None = None) -> list[int]:
    """Process ids of the children of `pid` (default: ours), of all its threads."""
    tasks = Path(f"/proc/{pid or os.getpid()}/task").glob("*/children")
    return sorted(int(child) for task in tasks for child in task.read_text().split())


def command_line(pid: int) -> str:
    """The command of a process, blanks between its arguments."""
    return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()


def processor_s(pid: int) -> float:
    """Seconds on a processor so far, all threads that still exist."""
    tasks = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(task.read_text().split()[0]) for task in tasks) * 1e-9


def stolen_s() -> float:
    """Seconds since the boot in which the host ran something else on our processors; proc(5), `steal`."""
    fields = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()
    return int(fields[8]) / os.sysconf("SC_CLK_TCK")
