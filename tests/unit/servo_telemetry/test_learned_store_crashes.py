"""Writing learned functions fails, or the process dies, at every step: the files on disk stay valid."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from learned_examples import LEARNED, table_in

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.learned.store import LearnedStore, StoreError, default_directory


class Killed(BaseException):
    """The process is gone: nothing behind this runs, tidying up neither."""


class Disk:
    """Counts the steps of writing and stops at one of them: a full disk, or a process that is killed."""

    def __init__(self, stop_at: int, *, killed: bool) -> None:
        self.steps = 0
        self._stop_at = stop_at
        self._killed = killed

    def step(self, partly: Callable[[], object] | None = None) -> None:
        """One more; raises at the one chosen and, when killed, at all behind it."""
        here = self.steps
        self.steps += 1
        if here == self._stop_at and partly is not None:
            partly()
        if self._killed and here >= self._stop_at:
            raise Killed
        if here == self._stop_at:
            raise OSError(28, "No space left on device")

    def install(self, patch: pytest.MonkeyPatch) -> None:
        """Stand between pathlib and the file system."""
        write_text, replace, unlink, fsync = Path.write_text, Path.replace, Path.unlink, os.fsync

        def torn(path: Path, text: str, **options: Any) -> int:
            self.step(lambda: write_text(path, text[: len(text) // 2], **options))
            return write_text(path, text, **options)

        def renamed(path: Path, target: Path) -> Path:
            self.step()
            return replace(path, target)

        def synced(descriptor: int) -> None:
            self.step()
            fsync(descriptor)

        def removed(path: Path, missing_ok: bool = False) -> None:
            if self._killed and self.steps > self._stop_at:
                raise Killed
            unlink(path, missing_ok=missing_ok)

        patch.setattr(Path, "write_text", torn)
        patch.setattr(Path, "replace", renamed)
        patch.setattr(Path, "unlink", removed)
        patch.setattr(os, "fsync", synced)


def interrupted(action: Callable[[], object], stop_at: int, *, killed: bool) -> bool:
    """Whether the action was stopped at this step; False when it has fewer."""
    disk = Disk(stop_at, killed=killed)
    with pytest.MonkeyPatch.context() as patch:
        disk.install(patch)
        try:
            action()
        except (StoreError, Killed):
            return True
    assert disk.steps <= stop_at
    return False


@pytest.mark.parametrize("killed", [False, True], ids=["full disk", "killed"])
@pytest.mark.parametrize("action", ["add", "roll_back"])
def test_a_crash_at_any_step_leaves_the_old_or_the_new_version_in_use(
    tmp_path: Path, action: str, killed: bool
) -> None:
    machine = table_in(tmp_path / "table")
    stop_at, stopped = 0, True
    while stopped:
        store = LearnedStore(tmp_path / str(stop_at), machine)
        for strokes in (1, 2):
            store.add("x", LEARNED._replace(strokes=strokes), {})
        act = {
            "add": lambda store=store: store.add("x", LEARNED._replace(strokes=3), {}),
            "roll_back": lambda store=store: store.roll_back("x"),
        }[action]
        stopped = interrupted(act, stop_at, killed=killed)
        active = store.active("x")
        assert active is not None
        wanted = 3 if action == "add" else 1
        assert active.learned.strokes in ({2, wanted} if stopped else {wanted})
        assert [entry.problem for entry in store.versions("x")] == [""] * len(store.versions("x"))
        if not killed:
            assert not list(store.directory.rglob("*.tmp"))
        added = store.add("x", LEARNED, {})
        assert added.version == len(store.versions("x"))
        assert store.active("x") == added
        stop_at += 1
    assert stop_at > {"add": 8, "roll_back": 4}[action]  # there were steps to stop at


@pytest.mark.parametrize("killed", [False, True], ids=["full disk", "killed"])
def test_the_first_version_is_complete_or_absent(tmp_path: Path, killed: bool) -> None:
    machine = table_in(tmp_path / "table")
    stop_at, stopped = 0, True
    while stopped:
        store = LearnedStore(tmp_path / str(stop_at) / "below", machine)
        stopped = interrupted(lambda store=store: store.add("x", LEARNED, {}), stop_at, killed=killed)
        active = store.active("x")
        assert active is None or active.learned == LEARNED
        assert stopped or active is not None
        stop_at += 1


def test_directory_that_cannot_be_made_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("", encoding="utf-8")
    store = LearnedStore(tmp_path / "taken", table_in(tmp_path / "table"))
    with pytest.raises(StoreError, match=r"taken/x: .* cannot be stored: File exists"):
        store.add("x", LEARNED, {})


class StoreMachine(RuleBasedStateMachine):
    """Any sequence of additions, roll-backs, damage and crashes against a model of three lines."""

    machine: MachineConfig
    root: tempfile.TemporaryDirectory[str]

    def __init__(self) -> None:
        super().__init__()
        self.root = tempfile.TemporaryDirectory()
        self.machine = table_in(Path(self.root.name))
        self.store = LearnedStore(default_directory(self.machine), self.machine)
        self.sound: dict[int, int] = {}
        self.damaged: set[int] = set()
        self.in_use = 0

    def teardown(self) -> None:
        self.root.cleanup()

    @rule(strokes=st.integers(0, 1000))
    def add(self, strokes: int) -> None:
        result = self.store.add("x", LEARNED._replace(strokes=strokes), {})
        assert result.version == max([*self.sound, *self.damaged], default=0) + 1
        self.sound[result.version] = strokes
        self.in_use = result.version

    @rule()
    def roll_back(self) -> None:
        result = self.store.roll_back("x")
        self.in_use = max((number for number in self.sound if number < self.in_use), default=0)
        assert (0 if result is None else result.version) == self.in_use

    @precondition(lambda self: self.sound)
    @rule(data=st.data())
    def damage(self, data: st.DataObject) -> None:
        number = data.draw(st.sampled_from(sorted(self.sound)))
        path = self.store.directory / "x" / f"v{number:04d}.json"
        path.write_bytes(path.read_bytes()[:-20])
        del self.sound[number]
        self.damaged.add(number)

    @rule(stop_at=st.integers(0, 9), strokes=st.integers(0, 1000))
    def die_while_adding(self, stop_at: int, strokes: int) -> None:
        learned = LEARNED._replace(strokes=strokes)
        interrupted(lambda: self.store.add("x", learned, {}), stop_at, killed=True)
        new = {entry.version for entry in self.store.versions("x")} - {*self.sound, *self.damaged}
        assert len(new) <= 1
        for number in new:
            self.sound[number] = strokes
            if [entry.in_use for entry in self.store.versions("x") if entry.version == number] == [True]:
                self.in_use = number

    @rule(stop_at=st.integers(0, 4))
    def die_while_rolling_back(self, stop_at: int) -> None:
        interrupted(lambda: self.store.roll_back("x"), stop_at, killed=True)
        before = self.in_use
        now = [entry.version for entry in self.store.versions("x") if entry.in_use]
        self.in_use = now[0] if now else 0
        assert self.in_use in {before, max((n for n in self.sound if n < before), default=0)}

    @invariant()
    def what_is_in_use_is_what_was_stored(self) -> None:
        if self.in_use in self.damaged:
            with pytest.raises(StoreError, match="is damaged"):
                self.store.active("x")
            return
        active = self.store.active("x")
        assert (0 if active is None else active.version) == self.in_use
        if active is not None:
            assert active.learned == LEARNED._replace(strokes=self.sound[self.in_use])

    @invariant()
    def nothing_is_lost(self) -> None:
        entries = self.store.versions("x")
        assert {entry.version for entry in entries if not entry.problem} == set(self.sound)
        assert {entry.version for entry in entries if entry.problem} == self.damaged


TestStore = StoreMachine.TestCase
TestStore.settings = settings(max_examples=25, stateful_step_count=20, deadline=None)
