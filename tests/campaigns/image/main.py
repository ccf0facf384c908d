"""Build the image, and run each service of docker-compose.yml in it with its health check.

No CAN kernel and no OCI runtime are needed: `localcan` on /tmp takes the place of vcan0. As root.
"""

import argparse
import json
import shlex
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

from tests.campaigns.image.building import IMAGE, ROOT, base_image, build, buildah, configuration
from tests.campaigns.image.running import Container

BUS = "localcan:/tmp/table.sock"
HEALTHY_WITHIN_S = 60.0
"""What the compose file's start period promises."""
LEARN = f"servo-ctrl learn --machine xy_table --bus {BUS} --pacing lockstep --record /var/lib/servo/learning"


def services() -> dict[str, Any]:
    """Return the services of the compose file."""
    document = yaml.safe_load((ROOT / "docker-compose.yml").read_text(encoding="utf-8"))
    return dict(document["services"])


def words_of(text: str | list[str]) -> list[str]:
    """Return a command on the bus of this trial, without the broker, which is an image of others."""
    words = shlex.split(text) if isinstance(text, str) else text[1:]
    words = [word.replace("socketcan:vcan0", BUS) for word in words]
    if "--mqtt" in words:
        place = words.index("--mqtt")
        del words[place : place + 2]
    return words


def wait_healthy(container: Container, name: str) -> float:
    """Return the seconds until the health check of a service passes. Raises SystemExit."""
    start_s = time.monotonic()
    while container.run(words_of(services()[name]["healthcheck"]["test"])).returncode != 0:
        if time.monotonic() - start_s > 10 * HEALTHY_WITHIN_S:
            raise SystemExit(f"{name} does not become healthy")
    return time.monotonic() - start_s


def trial(container: Container) -> dict[str, Any]:
    """Run both services, stop them, learn for a moment; return what was seen. Raises SystemExit."""
    seen: dict[str, Any] = {}
    refused = container.run(["touch", "/opt/servo/x"])
    if "Read-only file system" not in refused.stderr:
        raise SystemExit(f"the root file system is not read-only: {refused.stderr}")
    seen["user"] = container.run(["id", "-un"]).stdout.strip()
    with container.running(words_of(services()["hil-sim"]["command"])):
        seen["hil-sim healthy after s"] = round(wait_healthy(container, "hil-sim"), 1)
        with container.running(words_of(services()["servo-ctrl"]["command"])) as controller:
            seen["servo-ctrl healthy after s"] = round(wait_healthy(container, "servo-ctrl"), 1)
            time.sleep(5.0)
            if controller.poll() is not None:
                raise SystemExit("the controller did not go on serving")
        seen["servo-ctrl exit"] = controller.returncode
        page = container.run(["python", "-c", "import nicegui; print(nicegui.__version__)"])
        seen["page"] = page.stdout.strip()
        learning = ["timeout", "--signal=INT", "40", *shlex.split(LEARN)]
        done = container.run(learning)
        if "ermission" in done.stderr + done.stdout or "ead-only" in done.stderr + done.stdout:
            raise SystemExit(done.stdout + done.stderr)
    kept = sorted(path for path in (container.volumes / "state").rglob("*") if path.is_file())
    seen["kept in the volume"] = [str(path.relative_to(container.volumes / "state")) for path in kept]
    if not [path for path in kept if path.name == "journal.jsonl"]:
        raise SystemExit(
            f"learning wrote nothing into the volume: {done.stdout[-2000:]}{done.stderr[-2000:]}"
        )
    return seen


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--built", action="store_true", help=f"take {IMAGE} as it is there")
    asked = parser.parse_args()
    if shutil.which("buildah") is None:
        parser.exit(1, "buildah is not installed: apt-get install buildah debootstrap\n")
    if not asked.built:
        build(base_image())
    name = buildah("from", "--pull-never", IMAGE)
    config = configuration()
    with tempfile.TemporaryDirectory(prefix="servo-volumes-") as place:
        root, volumes = Path(buildah("mount", name)), Path(place)
        volumes.chmod(0o755)
        for volume, inside in (("state", "var/lib/servo"), ("cache", "var/cache/servo"), ("tmp", "")):
            target = volumes / volume  # a new volume gets what the image has there
            if inside:
                subprocess.run(["cp", "-a", str(root / inside), str(target)], check=True)
            else:
                target.mkdir(mode=0o1777)
                target.chmod(0o1777)
        try:
            seen = {"image": config["size"]} | trial(Container(root, volumes, config))
        finally:
            buildah("umount", name)
            buildah("rm", name)
    print(json.dumps(seen, indent=1))
    if asked.json:
        asked.json.write_text(json.dumps(seen, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
