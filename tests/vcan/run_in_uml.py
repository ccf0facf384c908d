"""Run the tests on real SocketCAN where the host's kernel has none.

    python tests/vcan/run_in_uml.py [PYTEST ARGUMENTS]

Debian's user-mode Linux is a whole kernel in one program. It boots on the host's own files without
privileges, loads the CAN modules, makes vcan0 and runs pytest with this interpreter. It has one processor,
so without arguments as many are booted as the host has, each with files of its own. The exit status is
pytest's. Where a program is missing it is 0 with a line `SKIPPED: ...`; as root, who could install it, and
in CI (CI=true) it is 1. Numba's cache is the host's: the processor and the files are the same.
"""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MODULES = (
    "net/can/can",
    "net/can/can-raw",
    "net/can/can-bcm",
    "drivers/net/can/dev/can-dev",
    "drivers/net/can/vcan",
)
MEMORY = "1G"
TIMEOUT_S = 2700.0
# In user-mode Linux a system call costs 40 us or more, so the tests there run in lockstep, and slowly.
PYTEST = ["-m", "pytest", "-m", "vcan", "-o", "timeout=1200", "--durations=0", "--durations-min=1"]
PASSED_ON = ("HOSTILE_FRAMES", "CI", "CANOPENDEMO")
"""Variables of the host's that tests read."""
PROCESSOR = Path("/proc/cpuinfo")
WHOLE_REGISTERS = Path(__file__).with_name("whole_registers.c")
SEARCH_PATH = f"{os.environ.get('PATH', '')}:/usr/local/sbin:/usr/sbin:/sbin"


def main(pytest_arguments: list[str]) -> int:
    """Boot, run, report; the exit status."""
    needed = ["linux.uml", "insmod", "ip", *(["gcc"] if has_amx() else [])]
    programs = {name: shutil.which(name, path=SEARCH_PATH) for name in needed}
    missing = [name for name, path in programs.items() if path is None]
    kernels = sorted(Path("/usr/lib/uml/modules").glob("*/kernel"))
    if missing or not kernels:
        names = ", ".join(missing or ["modules of linux.uml"])
        must_run = os.geteuid() == 0 or os.environ.get("CI") == "true"
        verdict = "FAILED" if must_run else "SKIPPED"
        print(f"{verdict}: the tests on vcan0, {names} missing (apt: user-mode-linux, kmod, iproute2, gcc)")
        return int(must_run)
    runs = [pytest_arguments] if pytest_arguments else shares(len(os.sched_getaffinity(0)))
    with ThreadPoolExecutor(len(runs)) as pool:
        done = pool.map(lambda arguments: run(str(programs["linux.uml"]), kernels[-1], arguments), runs)
        return max(done)


def shares(count: int) -> list[list[str]]:
    """The files with tests that need vcan0, in at most `count` parts of about as many tests."""
    files = sorted(Path(__file__).parent.glob("test_*.py"))
    texts = {path: path.read_text(encoding="utf-8") for path in files}
    marked = {path: text for path, text in texts.items() if "mark.vcan" in text or "bus_spec: str" in text}
    tests = {path: text.count("\ndef test_") for path, text in marked.items()}
    parts: list[list[Path]] = [[] for _ in range(min(count, len(tests)))]
    for path in sorted(tests, key=tests.__getitem__, reverse=True):
        min(parts, key=lambda part: sum(tests[other] for other in part)).append(path)
    return [[str(path.relative_to(ROOT)) for path in part] for part in parts]


def run(linux: str, kernel: Path, pytest_arguments: list[str]) -> int:
    """One kernel with its tests; their exit status."""
    with tempfile.TemporaryDirectory(prefix="vcan") as directory:
        status_file = Path(directory, "status")
        init = Path(directory, "init")
        # a folder of our own: in there we are root, but the host's files may belong to another user's run
        arguments = [*PYTEST, "--basetemp", f"{directory}/pytest", *pytest_arguments]
        init.write_text(init_script(kernel, status_file, arguments))
        init.chmod(0o700)
        boot(linux, init)
        if not status_file.exists():
            print("FAILED: user-mode Linux ended before the tests did", file=sys.stderr)
            return 1
        return int(status_file.read_text())


def init_script(kernel: Path, status_file: Path, arguments: list[str]) -> str:
    """Shell script that is process 1: devices, modules, vcan0, tests, status, power off."""
    insmod = "\n".join(f"insmod {kernel}/{module}.ko" for module in MODULES)
    environment = {
        "PATH": SEARCH_PATH,
        "HOME": os.environ.get("HOME", "/"),
        "LANG": os.environ.get("LANG", "C.UTF-8"),
        "PYTHONUNBUFFERED": "1",
        "VCAN_REQUIRED": "1",
        **{name: os.environ[name] for name in PASSED_ON if name in os.environ},
    }
    exports = "\n".join(f"export {name}={shlex.quote(value)}" for name, value in environment.items())
    return f"""#!/bin/sh
{exports}
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t tmpfs tmpfs /dev
mknod -m 666 /dev/null c 1 3
mknod -m 666 /dev/zero c 1 5
mknod -m 666 /dev/random c 1 8
mknod -m 666 /dev/urandom c 1 9
ln -s /proc/self/fd /dev/fd
mkdir -m 1777 /dev/shm
mount -t tmpfs tmpfs /dev/shm
{insmod}
ip link set lo up
ip link add dev vcan0 type vcan
ip link set vcan0 up
cd {shlex.quote(str(ROOT))}
{shlex.join([sys.executable, *arguments])}
echo $? >{shlex.quote(str(status_file))}
echo o >/proc/sysrq-trigger
sleep 60
"""


def has_amx() -> bool:
    """Whether the processor has registers that user-mode Linux 6.1 cannot restore; see whole_registers.c."""
    return bool(re.search(r"^flags.*\bamx_tile\b", PROCESSOR.read_text("ascii"), re.MULTILINE))


def registers_added(folder: Path) -> dict[str, str]:
    """Environment in which the kernel restores all registers; empty where it does so by itself."""
    if not has_amx():
        return {}
    library = folder / "whole_registers.so"
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", library, WHOLE_REGISTERS], check=True)
    return {"LD_PRELOAD": str(library)}


def boot(linux: str, init: Path) -> None:
    """Run the kernel `linux` with `init`, print its console as it comes, and end it after `TIMEOUT_S`."""
    options = [f"mem={MEMORY}", "rootfstype=hostfs", "rootflags=/", "rw", f"init={init}", "quiet"]
    consoles = ["con=null", "con0=fd:0,fd:1"]
    with subprocess.Popen(
        [linux, *options, *consoles],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
        env=os.environ | registers_added(init.parent),
    ) as kernel:
        watchdog = threading.Timer(TIMEOUT_S, os.killpg, (kernel.pid, signal.SIGKILL))
        watchdog.start()
        try:
            for line in kernel.stdout or ():
                print(line.rstrip("\r\n"), flush=True)
        finally:
            watchdog.cancel()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
