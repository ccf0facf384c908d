"""A fleet as it is run for real: Dask's scheduler, two workers, one of which is killed, and a dataset on S3.

Everything is a process of its own from an environment of its own (OUT/environment): s3fs wants an older
python-dateutil than the pins of this project. The S3 server is moto's, on loopback. Prints what was seen.
"""

import argparse
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
import venv
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[3]
PACKAGES = ("s3fs==2026.9.0", "moto[s3,server]==5.2.5")
MACHINES, AXES = 3, ("x", "y")
LIMIT_S = 1800.0
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
t = np.arange(8_000) * 1e-3
x = 0.02 * np.sin(2 * np.pi * 0.31 * t) + 0.008 * np.sin(2 * np.pi * 1.13 * t + 1)
v = np.gradient(x, t)
for machine in range(int(sys.argv[1])):
    for place, axis in enumerate(sys.argv[2:]):
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
print(json.dumps([[r["machine"], r["axis"], r["status"], [e["effect"] for e in r["effects"]]] for r in rows]))
"""


def free_port() -> int:
    """Return a port of loopback that nobody has now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def programs(place: Path) -> Path:
    """Return `bin` of an environment with our package, s3fs and moto; made once."""
    if not (place / "bin" / "moto_server").exists():
        venv.create(place, with_pip=True)
        command = [str(place / "bin" / "pip"), "install", "--quiet", f"{ROOT}[fleet]", *PACKAGES]
        subprocess.run(command, check=True)
    return place / "bin"


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


def trial(out: Path, binaries: Path) -> dict[str, object]:
    """Run the fleet and kill a worker when the first axis is done. Raises SystemExit."""
    s3, dask = free_port(), free_port()
    address, python = f"tcp://127.0.0.1:{dask}", str(binaries / "python")
    environment = {
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
            return stack.enter_context(started(command, environment, out / f"{name}.log"))

        begin("s3", [str(binaries / "moto_server"), "-H", "127.0.0.1", "-p", str(s3)])
        begin("scheduler", [*scheduler, "--no-dashboard"])
        wait_for_port(s3)
        wait_for_port(dask)
        filled = [python, "-c", FILL, str(MACHINES), *AXES]
        subprocess.run(filled, env=environment, check=True, timeout=LIMIT_S)
        workers = [begin(f"worker-{number}", worker) for number in (1, 2)]
        start_s = time.monotonic()
        run = begin("fleet", [*fleet, "--out", str(results), "--scheduler", address])
        while not list(results.glob("axes/*/*/result.json")):
            if run.poll() is not None or time.monotonic() - start_s > LIMIT_S:
                raise SystemExit((out / "fleet.log").read_text(encoding="utf-8"))
            time.sleep(0.1)
        workers[0].send_signal(signal.SIGKILL)
        done_before = len(list(results.glob("axes/*/*/result.json")))
        code = run.wait(LIMIT_S)
        took_s = time.monotonic() - start_s
    table = [python, "-c", READ, str(results / "results.parquet")]
    rows = json.loads(subprocess.run(table, check=True, capture_output=True, text=True).stdout)
    return {
        "exit": code,
        "done when a worker was killed": done_before,
        "seconds": round(took_s),
        "rows": rows,
    }


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/test-fleet"))
    parser.add_argument("--environment", type=Path, help="an environment that has all of it")
    asked = parser.parse_args()
    out = asked.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    seen = trial(out, programs(asked.environment or out / "environment"))
    print(json.dumps(seen, indent=1))
    rows = seen["rows"]
    wanted = [
        [f"mill-{machine}", axis, "diagnosed", ["cogging"] if axis == "y" else []]
        for machine in range(MACHINES)
        for axis in AXES
    ]
    sys.exit(0 if seen["exit"] == 0 and rows == wanted else 1)


if __name__ == "__main__":
    main()
