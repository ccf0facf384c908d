"""Build the image with buildah, on a base from a registry or, without one, of debootstrap."""

import json
import os
import subprocess
import tarfile
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
OFFICIAL = "docker.io/library/python:3.11.13-slim-bookworm"
OWN_BASE = "localhost/servo-python-base"
IMAGE = "localhost/servo-ctrl:local"
CERTIFICATES = Path("/etc/ssl/certs")
ENVIRONMENT = {**os.environ, "STORAGE_DRIVER": os.environ.get("STORAGE_DRIVER", "vfs")}
"""vfs needs no privilege of the kernel; it is slower than overlay."""


def buildah(*words: str, quiet: bool = False) -> str:
    """Run buildah and return what it printed. Raises CalledProcessError."""
    done = subprocess.run(
        ["buildah", *words], check=True, text=True, env=ENVIRONMENT, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL if quiet else None,
    )  # fmt: skip
    return done.stdout.strip()


def base_image() -> str:
    """Return the base: the official one where a registry has it, else one of debootstrap."""
    try:
        return buildah("pull", OFFICIAL, quiet=True) and OFFICIAL
    except subprocess.CalledProcessError:
        print("no registry is reached: the base is made by debootstrap", flush=True)
    try:
        buildah("inspect", "--type", "image", OWN_BASE, quiet=True)
    except subprocess.CalledProcessError:
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


def build(base: str) -> None:
    """Build the image from the committed files of this tree."""
    with tempfile.TemporaryDirectory(prefix="servo-context-") as context:
        archive = Path(context).with_suffix(".tar")
        subprocess.run(["git", "-C", str(ROOT), "archive", "-o", str(archive), "HEAD"], check=True)
        with tarfile.open(archive) as packed:
            packed.extractall(context, filter="data")
        archive.unlink()
        buildah(
            *("bud", "--isolation=chroot", "--network", "host", "--build-arg", f"BASE={base}"),
            *("-v", f"{CERTIFICATES}:{CERTIFICATES}:ro", "-f", "deploy/Dockerfile", "-t", IMAGE, context),
        )


def configuration() -> dict[str, Any]:
    """Return user, environment and working directory of the image, and its size as a text."""
    found = json.loads(buildah("inspect", "--type", "image", IMAGE))
    (size,) = (entry["size"] for entry in json.loads(buildah("images", "--json", IMAGE)))
    return {**found["OCIv1"]["config"], "size": size}
