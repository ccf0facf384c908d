"""The controller's settings are stored (1010h), left out where they cannot be, and restored (1011h)."""

from pathlib import Path

import pytest
from controller_node_bench import ControllerNodeBench, abort

from servo_ctrl.canopen.own_settings import FILE, SettingsStoreError, load_settings, write_settings

STORAGE = 0x08000020


def test_settings_are_stored_and_defaults_restored() -> None:
    kept: list[dict[str, int] | None] = []
    bench = ControllerNodeBench(store=kept.append)
    bench.node.boot_up()
    sdo = bench.remote.sdo
    sdo[0x1017].raw, sdo[0x1800][5].raw = 40, 250
    assert bench.ask("23 1010 01 6c6f6164") == abort("101001", STORAGE)
    sdo[0x1010][1].raw = 0x65766173
    assert kept[0] is not None
    assert (kept[0]["heartbeat_ms"], kept[0]["event_timer_ms"]) == (40, 250)
    again = ControllerNodeBench(stored=kept[0], store=kept.append)
    again.node.boot_up()
    assert (again.remote.sdo[0x1017].raw, again.remote.sdo[0x1800][5].raw) == (40, 250)
    again.remote.sdo[0x1011][1].raw = 0x64616F6C
    assert kept[-1] is None
    assert again.remote.sdo[0x1017].raw == 40  # until the next start


def test_stored_settings_that_cannot_be_are_left_out(tmp_path: Path) -> None:
    file = tmp_path / "deep" / FILE
    write_settings(file, {"heartbeat_ms": 40, "cob_id": 0x181, "transmission_type": 255})
    bench = ControllerNodeBench(stored=load_settings(file))
    bench.node.boot_up()
    assert (bench.node.heartbeat_s, bench.remote.sdo[0x1800][1].raw & 0x7FF) == (0.04, 0x1FF)
    file.write_text('{"heartbeat_ms": "x", "event_timer_ms": -1}', encoding="utf-8")
    assert load_settings(file) == {}
    write_settings(file, None)
    assert load_settings(file) == {}
    assert list(file.parent.iterdir()) == []
    with pytest.raises(SettingsStoreError, match="not written"):
        write_settings(Path("/proc/none") / FILE, {})
