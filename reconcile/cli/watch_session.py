"""A session of `reconcile watch`: read new recordings, print and publish the changes."""

import time
from pathlib import Path

import typer
from rich.console import Console
from rich.markup import escape

from reconcile.errors import ReconcileError
from reconcile.watch.publisher import ChangePublisher
from reconcile.watch.recording_folder import COMPLETE_AFTER_S
from reconcile.watch.watch import FILE, PAGE, Watch
from servo_ctrl.errors import ServoCtrlError


class WatchSession:
    """A watched folder, the console, and a broker, given by its address or by the machine.

    Raises ReconcileError and typer.BadParameter where the options of the broker cannot be used.
    """

    def __init__(self, watched: Watch, broker: str | None, machine: Path | None) -> None:
        self._watched = watched
        self._console = Console()
        self._publisher: ChangePublisher | None = None
        try:
            if broker or machine:
                self._publisher = ChangePublisher(broker, machine, watched.recording_folder.machine_name())
        except ServoCtrlError as error:
            raise ReconcileError("--machine", "", str(error)) from None
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--mqtt") from None

    def read_new(self, *, wait_for_unfinished: bool = False) -> None:
        """Read the new recordings; `wait_for_unfinished`: again when unfinished ones may be complete."""
        self._read()
        if wait_for_unfinished and self._watched.recording_folder.unfinished:
            time.sleep(1.1 * COMPLETE_AFTER_S)
            self._read()

    def print_summary(self, out: Path) -> None:
        """Print how many recordings and changes there are, what is still being written, and the files."""
        changes = len(self._watched.history.document["changes"])
        recordings = len(self._watched.history.document["recordings"])
        self._print(f"{recordings} recordings, {changes or 'no'} change{'s' * (changes != 1)}")
        for name in self._watched.recording_folder.unfinished:
            self._print(f"{name}: is still being written, and was not read")
        self._print(f"{out / FILE}\n{out / PAGE}")

    def follow(self, folder: Path, poll_s: float) -> None:
        """Read new recordings every `poll_s` until Ctrl-C."""
        self._print(f"waiting for new recordings in {folder}; Ctrl-C ends")
        while True:
            try:
                time.sleep(poll_s)
            except KeyboardInterrupt:
                return
            self._read()

    def _print(self, text: str) -> None:
        self._console.print(text, soft_wrap=True, highlight=False)

    def _read(self) -> None:
        """Read the new recordings; print and publish the changes."""
        with self._console.status("looking") as status:

            def show(text: str, *, lasting: bool) -> None:
                if lasting or not self._console.is_terminal:
                    self._console.print(text, soft_wrap=True, highlight=False, markup=False)
                else:
                    status.update(escape(text))

            self._watched.read_new(show)
            if self._publisher is None:
                return
            result = self._publisher.publish(self._watched.history)
            if result.published:
                self._watched.write_history()
            elif result.problem:
                show(result.problem, lasting=True)
