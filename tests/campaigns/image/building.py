"""Build the images with buildah, on a base from a registry or, without one, of debootstrap."""

import json
import os
import subprocess
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[3]
OFFICIAL = "docker.io/library/python:3.11.13-slim-bookworm"
OWN_BASE = "localhost/servo-python-base"
IMAGE = "localhost/servo-ctrl:local"
CERTIFICATES = Path("/etc/ssl/certs")
ENVIRONMENT = {**os.environ, "STORAGE_DRIVER": os.environ.get("STORAGE_DRIVER", "vfs")}
"""vfs needs no privilege of the kernel; it is slower than overlay."""
BROKER_OF_DEBIAN = """ARG BASE
FROM ${BASE}
RUN apt-get update && apt-get install --yes --no-install-recommends mosquitto mosquitto-clients
ENV PATH=/usr/sbin:/usr/bin:/sbin:/bin
USER mosquitto
"""
"""Instead of the broker's own image, where no registry is reached: the same program, in Debian's version."""


def buildah(*words: str, quiet: bool = False) -> str:
    """Run buildah and return what it printed. Raises CalledProcessError."""
    done = subprocess.run(
        ["buildah", *words], check=True, text=True, env=ENVIRONMENT, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL if quiet else None,
    )  # fmt: skip
    return done.stdout.strip()


def is_there(image: str) -> bool:
    """Whether an image is in the store of this computer."""
    try:
        return bool(buildah("inspect", "--type", "image", image, quiet=True))
    except subprocess.CalledProcessError:
        return False


def pulled(image: str) -> bool:
    """Whether a registry gave an image."""
    try:
        return bool(buildah("pull", image, quiet=True))
    except subprocess.CalledProcessError:
        return False


def base_image() -> str:
    """Return the base: the official one where a registry has it, else one of debootstrap."""
    if pulled(OFFICIAL):
        return OFFICIAL
    print("no registry is reached: the base is made by debootstrap", flush=True)
    if not is_there(OWN_BASE):
        _debootstrap()
    return OWN_BASE


def _debootstrap() -> None:
    with tempfile.TemporaryDirectory(prefix="servo-base-") as name:
        root = Path(name) / "root"
        packages = "python3,python3-pip,ca-certificates"
        command = ["debootstrap", "--variant=minbase", f"--include={packages}", "bookworm", str(root)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        for marker in root.glob("usr/lib/python3*/EXTERNALLY-MANAGED"):
            marker.unlink()  # in an image pip manages what it likes
        (root / "usr/bin/python").symlink_to("python3")
        with tarfile.open(Path(name) / "base.tar", "w") as archive:
            archive.add(root, arcname=".")
        (Path(name) / "Dockerfile").write_text("FROM scratch\nADD base.tar /\n", encoding="utf-8")
        buildah("bud", "--isolation=chroot", "--ignorefile=/dev/null", "-t", OWN_BASE, name)


def committed(place: Path) -> None:
    """Write the committed files of this tree to `place`."""
    archive = place.with_suffix(".tar")
    subprocess.run(["git", "-C", str(ROOT), "archive", "-o", str(archive), "HEAD"], check=True)
    with tarfile.open(archive) as packed:
        packed.extractall(place, filter="data")
    archive.unlink()


def build(base: str, context: Path) -> None:
    """Build our image of the files in `context`."""
    _built(base, context / "deploy" / "Dockerfile", IMAGE, context)


def broker(image: str, base: str) -> bool:
    """Have the broker's image by its name in compose; whether it is its own, not one of Debian's packages."""
    if pulled(image):
        return True
    with tempfile.TemporaryDirectory(prefix="servo-broker-") as name:
        recipe = Path(name) / "Dockerfile"
        recipe.write_text(BROKER_OF_DEBIAN, encoding="utf-8")
        _built(base, recipe, f"docker.io/library/{image}", Path(name))
    return False


def _built(base: str, recipe: Path, image: str, context: Path) -> None:
    buildah(
        *("bud", "--isolation=chroot", "--network", "host", "--build-arg", f"BASE={base}"),
        *("-v", f"{CERTIFICATES}:{CERTIFICATES}:ro", "-f", str(recipe), "-t", image, str(context)),
    )


def size_of(image: str) -> str:
    """Return the size of an image as a text."""
    (size,) = (entry["size"] for entry in json.loads(buildah("images", "--json", image)))
    return str(size)
