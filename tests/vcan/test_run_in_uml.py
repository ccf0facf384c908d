"""Errors of running the tests in user-mode Linux, without booting it."""

import importlib.util
import os
import shutil
from pathlib import Path
from types import ModuleType

import pytest

TESTS = "tests/vcan/test_socketcan.py"


@pytest.fixture
def run_in_uml() -> ModuleType:
    path = Path(__file__).with_name("run_in_uml.py")
    spec = importlib.util.spec_from_file_location("run_in_uml", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def everything(name: str, path: str) -> str:
    return "/bin/true"


def all_but_linux(name: str, path: str) -> str | None:
    return None if name == "linux.uml" else "/bin/true"


def one_kernel(path: Path, pattern: str) -> list[Path]:
    return [Path("/modules/kernel")]


@pytest.mark.parametrize(
    ("user", "ci", "status", "verdict"),
    [(1000, "", 0, "SKIPPED"), (1000, "true", 1, "FAILED"), (0, "", 1, "FAILED"), (0, "true", 1, "FAILED")],
)
def test_what_is_missing_is_named_and_a_failure_for_root_and_in_ci(
    run_in_uml: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    user: int,
    ci: str,
    status: int,
    verdict: str,
) -> None:
    monkeypatch.setattr(shutil, "which", all_but_linux)
    monkeypatch.setattr(os, "geteuid", lambda: user)
    monkeypatch.setenv("CI", ci)
    assert run_in_uml.main([]) == status
    assert capsys.readouterr().out.startswith(f"{verdict}: the tests on vcan0, linux.uml missing")


def test_a_processor_with_amx_has_its_registers_restored(
    run_in_uml: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    processor = tmp_path / "cpuinfo"
    monkeypatch.setattr(run_in_uml, "PROCESSOR", processor)
    processor.write_text("flags\t\t: fpu avx512f\n")
    assert run_in_uml.registers_added(tmp_path) == {}
    processor.write_text("model name: x\nflags\t\t: fpu avx512f amx_tile lm\n")
    assert Path(run_in_uml.registers_added(tmp_path)["LD_PRELOAD"]).exists()


def test_a_kernel_that_ends_early_is_a_failure(
    run_in_uml: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(shutil, "which", everything)
    monkeypatch.setattr(Path, "glob", one_kernel)
    assert run_in_uml.main([TESTS]) == 1
    assert "ended before the tests did" in capsys.readouterr().err


def test_a_kernel_that_hangs_is_ended(
    run_in_uml: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hanging = tmp_path / "linux.uml"
    hanging.write_text("#!/bin/sh\nsleep 600\n")
    hanging.chmod(0o700)
    monkeypatch.setattr(run_in_uml, "TIMEOUT_S", 0.2)
    run_in_uml.boot(str(hanging), tmp_path / "init")


def test_the_exit_status_is_that_of_the_tests(
    run_in_uml: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def boot(linux: str, init: Path) -> None:
        init.with_name("status").write_text("3\n")

    monkeypatch.setattr(shutil, "which", everything)
    monkeypatch.setattr(Path, "glob", one_kernel)
    monkeypatch.setattr(run_in_uml, "boot", boot)
    assert run_in_uml.main([TESTS]) == 3


def test_kernels_share_the_files_and_every_file_has_its_turn(run_in_uml: ModuleType) -> None:
    whole = sorted(path for part in run_in_uml.shares(1) for path in part)
    assert TESTS in whole
    assert Path(__file__).name not in {Path(path).name for path in whole}
    for count in (2, 3, 100):
        parts = run_in_uml.shares(count)
        assert len(parts) == min(count, len(whole))
        assert all(parts)
        assert sorted(path for part in parts for path in part) == whole
