"""A fleet as it is run for real: Dask's scheduler, two workers, one of which is killed, and a dataset on S3.

Everything is a process of its own from an environment of its own (OUT/environment): s3fs wants an older
python-dateutil than the pins of this project. The S3 server is moto's, on loopback. Prints what was seen.
`--machines 500` measures 1,000 axes, and 100,000 are simulated with their task times; `--json` keeps it.
"""

import argparse
import contextlib
import json
import os
import resource
import signal
import socket
import statistics
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.campaigns.environments import environment
from tests.campaigns.fleet.scheduling import Fleet, simulated
from tests.support.free_port import free_tcp_port

ROOT = Path(__file__).parents[3]
PACKAGES = ("s3fs==2026.9.0", "moto[s3,server]==5.2.5")
MACHINES, AXES = 3, ("x", "y")
ROWS, STEP_S = 1000, 2.5e-3
"""A short recording: 1,000 axes are to be measured in minutes."""
LIMIT_S = 7200.0
CLUSTERS = (100, 400, 1000)
LONG_S = 12.3
"""Processor time of an axis with one recording of 25 s at 1 kHz (`make bench-fleet`, docs/fleets.md)."""
MODEL = """[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
"""
FILL = """
import sys
import numpy as np, pyarrow as pa, pyarrow.parquet as pq, s3fs
store = s3fs.S3FileSystem()
store.mkdir("fleet")
t = np.arange(int(sys.argv[2])) * float(sys.argv[3])
x = 0.02 * np.sin(2 * np.pi * 0.7 * t) + 0.008 * np.sin(2 * np.pi * 2.13 * t + 1)
v = np.gradient(x, t)
for machine in range(int(sys.argv[1])):
    for place, axis in enumerate(sys.argv[4:]):
        noise = np.random.default_rng(10 * machine + place).normal(0, 0.3, t.size)
        force = 50 * np.gradient(v, t) + 100 * v + 12 * np.sign(v) + noise
        force += 3 * place * np.sin(2 * np.pi * x / 5e-3)  # y has cogging, x has nothing
        table = pa.table({"time_s": t, "motor_position_m": x, "motor_force_n": force})
        with store.open(f"fleet/machine=mill-{machine}/axis={axis}/run.parquet", "wb") as file:
            pq.write_table(table, file)
"""
READ = """
import json, sys, pyarrow.parquet as pq
rows = pq.read_table(sys.argv[1]).to_pylist()
names = lambda row: [effect["effect"] for effect in row["effects"]]
print(json.dumps([[r["machine"], r["axis"], r["status"], names(r), r["seconds"]] for r in rows]))
"""


@contextlib.contextmanager
def started(command: list[str], environment: dict[str, str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Keep a program running; it is killed at the end."""
    with log.open("wb") as output:
        process = subprocess.Popen(command, env=environment, stdout=output, stderr=output)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        process.wait(30.0)


def wait_for_port(port: int) -> None:
    """Wait until somebody listens. Raises TimeoutError."""
    deadline = time.monotonic() + 120.0
    while time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise TimeoutError(f"nobody listens on {port}")


def processor_s(pid: int) -> float:
    """Return the processor time that a process has had."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def trial(out: Path, binaries: Path, machines: int) -> dict[str, Any]:
    """Run the fleet and kill one of two workers when half of the axes are done. Raises SystemExit."""
    s3, dask = free_tcp_port(), free_tcp_port()
    address, python = f"tcp://127.0.0.1:{dask}", str(binaries / "python")
    variables = {
        **{name: value for name, value in os.environ.items() if not name.startswith("AWS_")},
        "AWS_ACCESS_KEY_ID": "nobody",
        "AWS_SECRET_ACCESS_KEY": "nothing",
        "AWS_DEFAULT_REGION": "us-east-1",
        "FSSPEC_S3_ENDPOINT_URL": f"http://127.0.0.1:{s3}",
        "OMP_NUM_THREADS": "1",
        "NUMBA_NUM_THREADS": "1",
    }
    models, results = out / "models", out / "fleet"
    models.mkdir(parents=True, exist_ok=True)
    (models / "default.toml").write_text(MODEL, encoding="utf-8")
    scheduler = [str(binaries / "dask"), "scheduler", "--host", "127.0.0.1", "--port", str(dask)]
    worker = [str(binaries / "dask"), "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    fleet = [str(binaries / "reconcile"), "fleet", "s3://fleet", "--model-dir", str(models)]
    with contextlib.ExitStack() as stack:

        def begin(name: str, command: list[str]) -> subprocess.Popen[bytes]:
            return stack.enter_context(started(command, variables, out / f"{name}.log"))

        begin("s3", [str(binaries / "moto_server"), "-H", "127.0.0.1", "-p", str(s3)])
        begin("scheduler", [*scheduler, "--no-dashboard"])
        wait_for_port(s3)
        wait_for_port(dask)
        filled = [python, "-c", FILL, str(machines), str(ROWS), str(STEP_S), *AXES]
        subprocess.run(filled, env=variables, check=True, timeout=LIMIT_S)
        workers = [begin(f"worker-{number}", worker) for number in (1, 2)]
        start_s, others = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
        run = begin("fleet", [*fleet, "--out", str(results), "--scheduler", address])
        while len(list(results.glob("axes/*/*/result.json"))) < machines:
            if run.poll() is not None or time.monotonic() - start_s > LIMIT_S:
                raise SystemExit((out / "fleet.log").read_text(encoding="utf-8"))
            time.sleep(0.1)
        worked_s = processor_s(workers[0].pid)
        workers[0].send_signal(signal.SIGKILL)
        done_before = len(list(results.glob("axes/*/*/result.json")))
        code = run.wait(LIMIT_S)
        took_s, ended = time.monotonic() - start_s, resource.getrusage(resource.RUSAGE_CHILDREN)
        worked_s += processor_s(workers[1].pid)
        client_s = ended.ru_utime + ended.ru_stime - others.ru_utime - others.ru_stime
    table = [python, "-c", READ, str(results / "results.parquet")]
    rows = json.loads(subprocess.run(table, check=True, capture_output=True, text=True).stdout)
    return {
        "exit": code,
        "done when a worker was killed": done_before,
        "seconds": round(took_s),
        "processor time of the workers, s": round(worked_s, 1),
        "processor time of the client, s": round(client_s, 1),
        "rows": rows,
    }


def projected(task_s: list[float], client_s: float) -> list[dict[str, Any]]:
    """Return what 100,000 axes take on so many workers."""
    found = []
    for workers in CLUSTERS:
        done = simulated(Fleet(100_000, workers, client_s, losses_an_hour=0.01), task_s)
        found.append({"workers": workers, **{key: round(value, 3) for key, value in done._asdict().items()}})
    return found


def scaled(task_s: list[float], mean_s: float) -> list[float]:
    """Return the measured times with another mean: a busy computer lengthens them, and recordings differ."""
    factor = mean_s / statistics.fmean(task_s)
    return [factor * one for one in task_s]


def figures(seen: dict[str, Any], machines: int) -> dict[str, Any]:
    """Return the figures of the page, and those of a simulation of the very run that was measured."""
    task_s = [row[4] for row in seen["rows"]]
    axes = len(task_s)
    client_s = seen["processor time of the client, s"] / axes
    worked_s = seen["processor time of the workers, s"]
    done = seen["done when a worker was killed"]
    halves = simulated(Fleet(done, 2, client_s), task_s), simulated(Fleet(axes - done, 1, client_s), task_s)
    return {
        "machines": machines,
        "axes": axes,
        "status": Counter(row[2] for row in seen["rows"]),
        "cogging named where it is": sum(row[3] == ["cogging"] for row in seen["rows"] if row[1] == "y"),
        "anything named where nothing is": sum(bool(row[3]) for row in seen["rows"] if row[1] == "x"),
        **{key: value for key, value in seen.items() if key != "rows"},
        "a task, s": {
            "median": round(statistics.median(task_s), 3),
            "mean": round(statistics.fmean(task_s), 3),
            "largest": round(max(task_s), 3),
        },
        "client, ms a task": round(1e3 * client_s, 1),
        "simulated s for the run that was measured": round(3600.0 * sum(half.hours for half in halves)),
        "100,000 such axes": projected(scaled(task_s, worked_s / axes), client_s),
        "100,000 axes of 25 s at 1 kHz": projected(scaled(task_s, LONG_S), client_s),
        "load": os.getloadavg(),
    }


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/test-fleet"))
    parser.add_argument("--environment", type=Path, help="an environment that has all of it")
    parser.add_argument("--machines", type=int, default=MACHINES, help="each has two axes")
    parser.add_argument("--json", type=Path, help="where the figures go")
    asked = parser.parse_args()
    out = asked.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    packages = (f"{ROOT}[fleet]", *PACKAGES)
    binaries = asked.environment / "bin" if asked.environment else environment(out / "environment", packages)
    seen = trial(out, binaries, asked.machines)
    found = figures(seen, asked.machines)
    print(json.dumps(found, indent=1))
    if asked.json:
        asked.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    wrong = [row for row in seen["rows"] if row[2:4] != ["diagnosed", ["cogging"] if row[1] == "y" else []]]
    print("\n".join(map(str, wrong[:10])))
    whole = len(seen["rows"]) == asked.machines * len(AXES)
    sys.exit(0 if seen["exit"] == 0 and whole and not wrong else 1)


if __name__ == "__main__":
    main()
