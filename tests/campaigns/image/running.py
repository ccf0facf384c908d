"""Run commands in the image without an OCI runtime: files read-only, volumes and /tmp writable, its own user.

A namespace of mounts of its own (`unshare --mount`) and chroot do what `read_only: true` and the volumes of
compose do.
"""

import contextlib
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

MOUNTED = """
set -e
mount --bind "$1" "$1"
mount -o remount,bind,ro "$1"
mount --bind "$2/state" "$1/var/lib/servo"
mount --bind "$2/cache" "$1/var/cache/servo"
mount --bind "$2/tmp" "$1/tmp"
mount --rbind /dev "$1/dev"
mount -t proc proc "$1/proc"
shift 2
exec "$@"
"""


class Container(NamedTuple):
    """The files of the image, mounted at `root`, and the directories behind its volumes."""

    root: Path
    volumes: Path
    config: dict[str, Any]

    def command(self, words: list[str]) -> list[str]:
        """Return the command line that runs `words` inside."""
        inside = f'cd {self.config["WorkingDir"]} && exec "$@"'
        user = ["--userspec", f"{self.config['User']}:{self.config['User']}"]
        run = ["chroot", *user, str(self.root), "env", "-i", *self.config["Env"], "sh", "-c", inside, "sh"]
        mounts = ["unshare", "--mount", "sh", "-c", MOUNTED, "sh", str(self.root), str(self.volumes)]
        return [*mounts, *run, *words]

    def run(self, words: list[str], limit_s: float = 300.0) -> subprocess.CompletedProcess[str]:
        """Run a command to its end."""
        return subprocess.run(
            self.command(words), capture_output=True, text=True, check=False, timeout=limit_s
        )

    @contextlib.contextmanager
    def running(self, words: list[str]) -> Iterator[subprocess.Popen[str]]:
        """Keep a command running; it gets SIGTERM at the end, as `docker stop` sends it."""
        with subprocess.Popen(self.command(words), text=True, start_new_session=True) as process:
            try:
                yield process
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGTERM)
                process.wait(120.0)
