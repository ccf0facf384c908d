"""Build the image, bring the bench up with podman-compose, use it as an outsider does, and stop it: as root.

Needed: podman, an OCI runtime (crun or runc), buildah; without a registry debootstrap too. The bus is
localcan on a volume, by the variable that docker-compose.yml has for it, so that no CAN kernel is needed.
"""

import argparse
import json
import shutil
import ssl
import subprocess
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path
from typing import Any

import yaml

from tests.campaigns.image.building import IMAGE, base_image, broker, build, committed, size_of
from tests.campaigns.image.composing import Bench, bench

BUS = "localcan:/run/servo/table.sock"
FILES = ("docker-compose.yml", "deploy/compose.page.yml")
HEALTHY_WITHIN_S = 60.0
"""What the compose file's start period promises."""
PAGE = "https://localhost:8443"
CONNECT = "import socket; socket.create_connection(('127.0.0.1', 8443), 2.0)"
STATE = "/var/lib/servo"
LEARN_S = 7200.0
"""Bounds a hang; the strokes take three minutes of machine time."""
QUICK = (
    r"s/^accelerations_mm_s2 = .*/accelerations_mm_s2 = [60.0, 80.0, 100.0, 120.0]/",
    r"s/^radius_mm = 50.0/radius_mm = 10.0/",
    r's/^name = "xy_table"/name = "quick"/',
)
"""With these a copy of the table learns in short strokes: few accelerations, on a small circle."""


def expect(what: object, sentence: str) -> None:
    """Raise SystemExit with the sentence where `what` is false."""
    if not what:
        raise SystemExit(sentence)


def make_certificate(project: Path) -> None:
    """Make certificate and key in `secrets/`, for uid 1000 alone."""
    folder = project / "secrets"
    folder.mkdir(mode=0o700)
    key, certificate = folder / "bench.key", folder / "bench.pem"
    words = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2"]
    names = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    request = ["openssl", "req", "-x509", *words, *names, "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(request, check=True, capture_output=True)
    shutil.chown(folder, 1000, 1000)
    for file in (key, certificate):
        file.chmod(0o600)
        shutil.chown(file, 1000, 1000)


def new_token(here: Bench) -> str:
    """Make a token as docs/containers.md says, into `secrets/access.toml`."""
    where = ["run", "--rm", "--no-deps", "-v", f"{here.project}/secrets:/secrets", "servo-ctrl"]
    command = [
        "python",
        "-m",
        "servo_ctrl.hmi",
        "token",
        "anna",
        "operate",
        "--access",
        "/secrets/access.toml",
    ]
    return max(here.compose(*where, *command).split(), key=len)


def asked(path: str, certificate: Path, form: dict[str, str] | None = None) -> tuple[int, str]:
    """Return status and text of a page; cookies of a log-in are kept while redirects are followed."""
    context = ssl.create_default_context(cafile=str(certificate))
    opener = urllib.request.build_opener(
        urllib.request.HTTPSHandler(context=context), urllib.request.HTTPCookieProcessor()
    )
    data = urllib.parse.urlencode(form).encode() if form else None
    headers = {"Origin": PAGE, "Accept": "text/html"}
    request = urllib.request.Request(PAGE + path, data, headers)  # noqa: S310  # the address is ours
    try:
        with opener.open(request, timeout=60.0) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def page_of(here: Bench, token: str) -> dict[str, Any]:
    """See the page from the host: a client without a token gets the log-in."""
    certificate = here.project / "secrets" / "bench.pem"
    deadline_s = (
        time.monotonic() + HEALTHY_WITHIN_S
    )  # the page is a process that starts behind the controller
    while here.inside("servo-ctrl", "python", "-c", CONNECT).returncode != 0:
        expect(time.monotonic() < deadline_s, f"no page: {here.log('servo-ctrl')}")
    without_token = asked("/", certificate)
    wrong = asked("/login", certificate, {"token": "0" * 43})
    right = asked("/login", certificate, {"token": token})
    expect(
        "token" in without_token[1].lower() and wrong[0] == 401, f"no token, yet in: {without_token} {wrong}"
    )
    expect(right[0] == 200 and "nicegui" in right[1], f"the token is refused: {right}")
    return {"stranger": without_token[0], "wrong token": wrong[0], "token": right[0]}


def confinement(here: Bench, service: str) -> dict[str, Any]:
    """Return the user and what the root file system says to a write."""
    refused = here.inside(service, "touch", "/opt/servo/x")
    expect("Read-only file system" in refused.stderr, f"{service}: {refused.stderr}")
    user = here.inside(service, "id", "-un").stdout.strip()
    expect(user == "servo", f"{service} runs as {user}")
    return {"user": user, "a write to its root": refused.stderr.strip().rpartition(": ")[2]}


def messages(here: Bench) -> dict[str, Any]:
    """Return what the broker has of the controller."""
    listen = ["mosquitto_sub", "-h", "127.0.0.1", "-W", "30", "-C", "1", "-t"]
    online = here.inside("mosquitto", *listen, "servo_ctrl/+/online").stdout.strip()
    state = json.loads(here.inside("mosquitto", *listen, "servo_ctrl/+/state").stdout)
    expect(online == "online", f"the controller is {online!r} by MQTT")
    return {"online": online, "stage": state["stage"], "axes": sorted(state["axis"])}


def learned(here: Bench) -> dict[str, Any]:
    """Learn the friction of x to its end in a container of its own; return what is in the volume then.

    The machine is a copy of the table in the volume, as a user makes one.
    """
    machine = f"{STATE}/quick"
    here.inside("hil-sim", "servo-ctrl", "new-machine", machine, "--from", "xy_table")
    edits = [word for edit in QUICK for word in ("-e", edit)]
    here.inside("hil-sim", "sed", "-i", *edits, f"{machine}/controller.toml")
    command = [*("servo-ctrl", "learn", "--machine", machine, "--axis", "x", "--bus", BUS)]
    command += ["--pacing", "lockstep", "--record", f"{STATE}/learning"]
    start_s = time.monotonic()
    here.compose("run", "--rm", "--no-deps", "servo-ctrl", *command, limit_s=LEARN_S)
    took_s = round(time.monotonic() - start_s)
    kept = here.inside("hil-sim", "find", STATE, "-type", "f").stdout.split()
    names = {Path(path).name for path in kept}
    expect({"active.json", "recording.json"} <= names, f"learning kept only {kept}")
    listed = here.inside("hil-sim", "servo-ctrl", "learned", "list", "--machine", machine).stdout
    versions = [line.split() for line in listed.splitlines() if line.split()[:3] == ["x", "1", "yes"]]
    expect(versions, f"no version is in use: {listed}")
    return {"version": versions[0], "s": took_s, "kept in": sorted({str(Path(path).parent) for path in kept})}


def trial(here: Bench) -> dict[str, Any]:
    """Bring it up, look at it from all sides, stop it in order, learn into the volume. Raises SystemExit."""
    seen: dict[str, Any] = {}
    make_certificate(here.project)
    here.compose("up", "--detach", "--no-build", "vcan", "mosquitto", "hil-sim")
    for service in ("mosquitto", "hil-sim"):
        seen[f"{service} healthy after s"] = here.healthy_after_s(service, HEALTHY_WITHIN_S)
    seen["hil-sim"] = confinement(here, "hil-sim")
    token = new_token(here)
    here.compose("up", "--detach", "--no-build", "servo-ctrl")
    seen["servo-ctrl healthy after s"] = here.healthy_after_s("servo-ctrl", HEALTHY_WITHIN_S)
    seen["servo-ctrl"] = confinement(here, "servo-ctrl")
    seen["MQTT"] = messages(here)
    seen["page"] = page_of(here, token)
    here.compose("stop", "--timeout", "30", "servo-ctrl")
    seen["servo-ctrl exit after stop"] = here.state("servo-ctrl")["State"]["ExitCode"]
    expect(seen["servo-ctrl exit after stop"] == 143, f"stopped with {seen['servo-ctrl exit after stop']}")
    seen["learned"] = learned(here)
    return seen


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/test-image"))
    parser.add_argument("--built", action="store_true", help=f"take {IMAGE} and the broker as they are there")
    wanted = parser.parse_args()
    for program in ("buildah", "podman"):
        if shutil.which(program) is None:
            parser.exit(1, f"{program} is not installed: apt-get install buildah podman runc debootstrap\n")
    out = wanted.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    seen: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="servo-context-") as name:
        project = Path(name)
        committed(project)
        if not wanted.built:
            base = base_image()
            build(base, project)
            services = yaml.safe_load((project / "docker-compose.yml").read_text(encoding="utf-8"))[
                "services"
            ]
            own = broker(services["mosquitto"]["image"], base)
            seen["broker"] = "its own image" if own else "Debian's mosquitto under its image's name"
        seen["image"] = size_of(IMAGE)
        with bench(out, project, FILES, SERVO_BUS=BUS) as here:
            seen |= trial(here)
    print(json.dumps(seen, indent=1))
    if wanted.json:
        wanted.json.write_text(json.dumps(seen, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
