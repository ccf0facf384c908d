"""The commands and health checks of docker-compose.yml, run as they are."""

import contextlib
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

pytestmark = pytest.mark.vcan

ROOT = Path(__file__).resolve().parents[2]
HEALTH_TIMEOUT_S = 400.0
STOP_TIMEOUT_S = 240.0
# In the image, as here, `python`, `hil-sim` and `servo-ctrl` are those of one environment.
ENVIRONMENT = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}


def service(name: str) -> dict[str, Any]:
    text = re.sub(r"\$\{\w+:-([^}]*)\}", r"\1", (ROOT / "docker-compose.yml").read_text())  # the defaults
    document = yaml.safe_load(text)
    return dict(document["services"][name])


def command_of(name: str) -> list[str]:
    return shlex.split(service(name)["command"])


@contextlib.contextmanager
def running(name: str) -> Iterator[subprocess.Popen[str]]:
    """The service's command, until the end of the block at most."""
    with subprocess.Popen(command_of(name), cwd=ROOT, env=ENVIRONMENT, text=True) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.wait(STOP_TIMEOUT_S)


def healthy(name: str) -> bool:
    """Outcome of the service's health check, once."""
    test = [word.replace("$$", "$") for word in service(name)["healthcheck"]["test"][1:]]
    return (
        subprocess.run(test, cwd=ROOT, env=ENVIRONMENT, check=False, timeout=HEALTH_TIMEOUT_S).returncode == 0
    )


def wait_until_healthy(name: str, process: subprocess.Popen[str]) -> None:
    deadline_s = time.monotonic() + HEALTH_TIMEOUT_S
    while not healthy(name):
        assert process.poll() is None, f"{name} ended"
        assert time.monotonic() < deadline_s, f"{name} does not become healthy"


def test_the_interface_is_set_up_once_and_for_all() -> None:
    subprocess.run(["ip", "link", "delete", "vcan0"], check=True)
    for _ in range(2):
        subprocess.run(command_of("vcan"), cwd=ROOT, check=True, timeout=60)
        assert int(Path("/sys/class/net/vcan0/flags").read_text(), 16) & 1  # IFF_UP


def test_simulator_and_controller_come_up_healthy_and_stop_in_order() -> None:
    assert not healthy("hil-sim")
    with running("hil-sim") as simulator:
        wait_until_healthy("hil-sim", simulator)
        assert not healthy("servo-ctrl")
        with running("servo-ctrl") as controller:
            wait_until_healthy("servo-ctrl", controller)
            assert healthy("hil-sim")
            controller.send_signal(getattr(signal, service("servo-ctrl")["stop_signal"]))
            assert controller.wait(STOP_TIMEOUT_S) == 128 + signal.SIGTERM
        assert simulator.poll() is None
    assert simulator.returncode == 0


@pytest.mark.skipif(
    shutil.which("mosquitto") is None or shutil.which("mosquitto_sub") is None,
    reason="mosquitto or mosquitto-clients is missing",
)
def test_the_broker_comes_up_healthy() -> None:
    with running("mosquitto") as broker:
        wait_until_healthy("mosquitto", broker)
