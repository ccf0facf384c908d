"""Files as instruments and scripts write them: preambles, JSON, folders, patterns, of a clean motion."""

import json
from pathlib import Path

import numpy as np
import pytest
from axis_motion import Axis, clean

from reconcile.errors import ReconcileError
from reconcile.formats.files import recordings_of
from reconcile.formats.mapping import parse_mapping
from reconcile.recording.recording import AxisRecording, load_recordings

MODEL = {"x": Axis()}
CLEAN = clean(1.0)
MAP = "time=t,position=q,force=F"
COLUMNS = {"t": CLEAN.time_s, "q": CLEAN.motor_m, "F": CLEAN.force_n}


def rows(delimiter: str = ",", decimal: str = ".", end: str = "") -> str:
    lines = [
        delimiter.join(f"{value:.10g}" for value in row) + end for row in zip(*COLUMNS.values(), strict=True)
    ]
    return "\n".join(lines).replace(".", decimal) + "\n"


def is_clean(recording: AxisRecording) -> bool:
    position = np.allclose(recording.motor_m, CLEAN.motor_m, rtol=1e-8, atol=1e-11)
    return position and np.allclose(recording.force_n, CLEAN.force_n, rtol=1e-8, atol=1e-8)


SCOPE = "Instrument;SCOPE 3000\nSerial;12345\nRate;1000;Hz\n\n[Data]\n"
PREAMBLES = {
    "pairs of a semicolon file": (SCOPE + "t;q;F\ns;m;N\n" + rows(";", ",")).encode(),
    "names in a comment": ("# made by a script\n# t q F\n# t,q,F\n" + rows()).encode(),
    "brackets round the units": ("Trace 1\nt,q,F\n[s],[m],[N]\n" + rows()).encode(),
    "a delimiter at each end": ("t,q,F,\n" + rows(end=",")).encode(),
    "comments among the rows": ("t,q,F\n" + rows() + "# end of trace\n").encode(),
    "windows": ("t\tq\tF\r\n" + rows("\t").replace("\n", "\r\n")).encode("utf-16"),
    "latin-1": ("Achse: Schlitten \xfc\nt,q,F\n" + rows()).encode("latin-1"),
}


@pytest.mark.parametrize("content", PREAMBLES.values(), ids=PREAMBLES.keys())
def test_what_instruments_write_round_the_rows_is_skipped(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "trace.csv").write_bytes(content)
    (recording,) = load_recordings([tmp_path / "trace.csv"], MODEL, parse_mapping([MAP]))
    assert is_clean(recording)


def test_units_below_the_names_of_a_preamble_hold(tmp_path: Path) -> None:
    scaled = SCOPE + "t;q;F\nms;µm;kN\n"
    for row in zip(CLEAN.time_s * 1e3, CLEAN.motor_m * 1e6, CLEAN.force_n * 1e-3, strict=True):
        scaled += ";".join(f"{value:.10g}" for value in row) + "\n"
    (tmp_path / "trace.csv").write_text(scaled)
    (recording,) = load_recordings([tmp_path / "trace.csv"], MODEL, parse_mapping([MAP]))
    assert is_clean(recording)


def test_dates_of_the_rows_are_their_time(tmp_path: Path) -> None:
    text = "t,q,F\n"
    for row in zip(*COLUMNS.values(), strict=True):
        text += f"2026-03-01 12:00:{row[0] + 10.0:06.3f},{row[1]:.10g},{row[2]:.10g}\n"
    (tmp_path / "trace.csv").write_text(text)
    (recording,) = load_recordings([tmp_path / "trace.csv"], MODEL, parse_mapping([MAP]))
    assert recording.period_s == pytest.approx(1e-3)
    assert is_clean(recording)


def test_rows_of_another_width_than_the_names_are_refused(tmp_path: Path) -> None:
    (tmp_path / "trace.csv").write_text("made by me\nt,q\n" + rows())
    with pytest.raises(ReconcileError, match=r"line 2: has 2 names, the rows below it have 3 values"):
        load_recordings([tmp_path / "trace.csv"], MODEL, parse_mapping([MAP]))


LISTS = {name: values.tolist() for name, values in COLUMNS.items()}
RECORDS = [dict(zip(LISTS, row, strict=True)) for row in zip(*LISTS.values(), strict=True)]
JSON_FILES = {
    "columns.json": json.dumps(LISTS),
    "records.json": json.dumps(RECORDS),
    "wrapped.json": json.dumps({"device": "scope", "rate": 1000, "data": RECORDS}),
    "lines.jsonl": "\n".join(map(json.dumps, RECORDS)),
    "table.json": json.dumps([list(LISTS), *map(list, zip(*LISTS.values(), strict=True))]),
    "split.json": json.dumps({"columns": list(LISTS), "data": [*zip(*LISTS.values(), strict=True)]}),
    "units.json": json.dumps(
        {
            "channels": {
                "t": {"values": LISTS["t"], "unit": "s"},
                "q": {"values": (CLEAN.motor_m * 1e3).tolist(), "unit": "mm"},
                "F": {"values": LISTS["F"], "unit": "N"},
            }
        }
    ),
}


@pytest.mark.parametrize("name", JSON_FILES)
def test_json_of_columns_or_records_is_read(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(JSON_FILES[name])
    (recording,) = load_recordings([tmp_path / name], MODEL, parse_mapping([MAP]))
    assert is_clean(recording)


def test_a_missing_value_of_a_record_is_filled_in_and_noted(tmp_path: Path) -> None:
    records = [dict(record) for record in RECORDS]
    records[500]["F"] = None
    del records[501]["F"]
    (tmp_path / "r.json").write_text(json.dumps(records))
    (recording,) = load_recordings([tmp_path / "r.json"], MODEL, parse_mapping([MAP]))
    assert [finding.check for finding in recording.findings] == ["hole"]
    assert len(recording.force_n) == len(CLEAN.force_n)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[1, 2", "is not a readable JSON file"),
        ('{"device": "scope"}', "holds no columns of numbers"),
        (f'{{"t": [1, {"9" * 400}]}}', "column 't': holds no usable number"),
        ("[]", "holds no columns of numbers"),
    ],
)
def test_json_without_a_recording_is_refused(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "r.json").write_text(text)
    with pytest.raises(ReconcileError, match=reason):
        load_recordings([tmp_path / "r.json"], MODEL, parse_mapping([MAP]))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("b.csv", "a.csv", "deeper/c.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("t,q,F\n" + rows())
    (tmp_path / "notes.md").write_text("no recording")
    return tmp_path


def test_a_folder_and_a_pattern_stand_for_their_recordings(folder: Path) -> None:
    assert [path.name for path in recordings_of([folder])] == ["a.csv", "b.csv"]
    assert [path.name for path in recordings_of([folder / "[b-z]*.csv"])] == ["b.csv"]
    assert [path.name for path in recordings_of([folder / "**" / "*.csv"])] == ["a.csv", "b.csv", "c.csv"]
    assert recordings_of([folder / "a.csv", folder]) == [folder / "a.csv", folder / "b.csv"]
    with pytest.raises(ReconcileError, match=r"\*\.mat: matches no recording"):
        recordings_of([folder / "*.mat"])


def test_a_file_of_a_folder_that_cannot_be_read_is_set_aside_by_name(folder: Path) -> None:
    (folder / "b.csv").write_text("torn")
    (recording,) = load_recordings([folder], MODEL, parse_mapping([MAP]))
    assert recording.source.endswith("a.csv")
    [aside] = [finding for finding in recording.findings if finding.check == "unreadable"]
    assert aside.severity == "warning"
    assert "b.csv: the recording is set aside: line 1: has no two names" in str(aside)
