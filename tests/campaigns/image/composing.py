"""podman-compose on this computer's podman, whatever runtime of it can start a process here."""

import contextlib
import json
import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from tests.campaigns.environments import environment
from tests.campaigns.image.building import ENVIRONMENT, IMAGE

PACKAGE = "podman-compose==1.6.0"
CONFINED = """[containers]
default_ulimits = ["nofile=1024:1024", "nproc=1000:1000"]
[engine]
runtime = "runc"
cgroup_manager = "cgroupfs"
events_logger = "file"
"""
"""Inside a confined host: no limit is raised, and runc takes both versions of cgroups at once."""


def podman(
    *words: str, environment: dict[str, str], limit_s: float = 300.0
) -> subprocess.CompletedProcess[str]:
    """Run podman to its end; what it prints is in the result."""
    return subprocess.run(
        ["podman", *words], env=environment, capture_output=True, text=True, check=False, timeout=limit_s
    )


def engine(place: Path) -> dict[str, str]:
    """Return an environment in which podman starts a process. Raises SystemExit."""
    configuration = place / "containers.conf"
    configuration.write_text(CONFINED, encoding="utf-8")
    output = []
    for variables in (ENVIRONMENT, ENVIRONMENT | {"CONTAINERS_CONF": str(configuration)}):
        done = podman("run", "--rm", "--network", "host", IMAGE, "true", environment=variables)
        if done.returncode == 0:
            return variables
        output.append(done.stderr)
    raise SystemExit("podman starts no process here:\n" + "\n".join(output))


class Bench(NamedTuple):
    """The services of docker-compose.yml in the directory `project`."""

    project: Path
    program: Path
    environment: dict[str, str]
    files: tuple[str, ...]

    def compose(self, *words: str, limit_s: float = 600.0) -> str:
        """Run podman-compose and return what it printed. Raises SystemExit."""
        files = [word for file in self.files for word in ("-f", file)]
        done = subprocess.run(
            [str(self.program), *files, *words],
            cwd=self.project, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, check=False, timeout=limit_s,
        )  # fmt: skip
        if done.returncode != 0:
            raise SystemExit(f"podman-compose {' '.join(words)}: {done.stdout[-4000:]}")
        return done.stdout

    def inside(self, service: str, *words: str, user: str | None = None) -> subprocess.CompletedProcess[str]:
        """Run a command in a service that is up."""
        who = ["--user", user] if user else []
        return podman("exec", *who, f"servo_{service}_1", *words, environment=self.environment)

    def state(self, service: str) -> dict[str, Any]:
        """What podman knows of a service."""
        done = podman("inspect", f"servo_{service}_1", environment=self.environment)
        if done.returncode != 0:
            raise SystemExit(done.stderr)
        found: dict[str, Any] = json.loads(done.stdout)[0]
        return found

    def log(self, service: str) -> str:
        """The last lines that a service has printed."""
        output = podman("logs", "--tail", "40", f"servo_{service}_1", environment=self.environment)
        return output.stdout + output.stderr

    def healthy_after_s(self, service: str, bound_s: float) -> float:
        """Run the health check as podman's timer would, which needs systemd. Raises SystemExit."""
        start_s = time.monotonic()
        name = f"servo_{service}_1"
        while podman("healthcheck", "run", name, environment=self.environment).returncode != 0:
            if time.monotonic() - start_s > bound_s or self.state(service)["State"]["Status"] == "exited":
                raise SystemExit(f"{service} does not become healthy: {self.log(service)}")
            time.sleep(0.5)
        return round(time.monotonic() - start_s, 1)


@contextlib.contextmanager
def bench(place: Path, project: Path, files: tuple[str, ...], **variables: str) -> Iterator[Bench]:
    """Have podman-compose in an environment of its own; what is up at the end is removed with its volumes."""
    binaries = environment(place / "environment", (PACKAGE,))
    path = f"{binaries}{os.pathsep}{os.environ['PATH']}"
    found = Bench(project, binaries / "podman-compose", {**engine(place), **variables, "PATH": path}, files)
    try:
        yield found
    finally:
        with contextlib.suppress(SystemExit):
            found.compose("down", "--volumes", "--timeout", "10")
