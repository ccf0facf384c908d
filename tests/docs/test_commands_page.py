"""docs/commands.md, object by object against the EDS, and its dialogues against the controller node."""

import re

import pytest
from controller_node_bench import NODE_ID, OWN_EDS, REPOSITORY, ControllerNodeBench

from servo_ctrl.canopen.errors import AbortCode
from servo_ctrl.canopen.stack import EdsVariable, load_eds
from servo_ctrl.commands.command import Command
from servo_ctrl.commands.tables import files

PAGE = (REPOSITORY / "docs" / "commands.md").read_text(encoding="utf-8")
TYPES = {"u8": 0x5, "u16": 0x6, "u32": 0x7, "i8": 0x2, "i32": 0x4, "text": 0x9, "table": 0xF}
OBJECTS = re.compile(
    r"<!-- (?:objects|(?:commands|status): made by commands\.tables) -->\n(.*?)<!-- end -->", re.DOTALL
)
DIALOGUES = re.compile(r"<!-- dialogue -->\n```\n(.*?)```", re.DOTALL)
ABORTS = re.compile(r"<!-- aborts -->\n(.*?)<!-- end -->", re.DOTALL)
ADDRESS = re.compile(r"`([0-9A-F]{4})h(?::([0-9A-F]{2}))?`")


def rows(table: str) -> list[list[str]]:
    lines = [line for line in table.splitlines() if line.startswith("| `")]
    return [[cell.strip() for cell in line[1:-1].split("|")] for line in lines]


def addresses(cell: str) -> list[tuple[int, int]]:
    """One address, a range of subindices (`2102h:01` ... `08`), or one of indices."""
    first, _, last = cell.partition(" ... ")
    found = ADDRESS.fullmatch(first)
    assert found, cell
    index, subindex = int(found[1], 16), int(found[2] or "0", 16)
    if not last:
        return [(index, subindex)]
    if re.fullmatch("`[0-9A-F]{2}`", last):
        return [(index, sub) for sub in range(subindex, int(last[1:3], 16) + 1)]
    end = ADDRESS.fullmatch(last)
    assert end, cell
    assert end[2] == found[2], cell
    return [(i, subindex) for i in range(index, int(end[1], 16) + 1)]


def documented() -> dict[tuple[int, int], list[str]]:
    found: dict[tuple[int, int], list[str]] = {}
    for table in OBJECTS.findall(PAGE):
        for row in rows(table):
            for number, address in enumerate(addresses(row[0]), 1):
                assert address not in found, row
                found[address] = [row[1].replace("1 ... 8", str(number)), *row[2:]]
    return found


def wanted() -> dict[tuple[int, int], EdsVariable]:
    """Our own objects and the parameters of the status PDO, without the subindex counts of records."""
    variables = load_eds(OWN_EDS, NODE_ID).variables
    return {
        (index, sub): variable
        for (index, sub), variable in variables.items()
        if (index == 0x1800 or index >= 0x2000)
        and (sub or index in {0x2102, 0x2103, 0x2107, 0x2108} or (index, 1) not in variables)
    }


def test_the_eds_and_the_tables_are_those_of_the_declarations() -> None:
    for path, text in files(REPOSITORY).items():
        assert path.read_text(encoding="utf-8") == text, "python -m servo_ctrl.commands.tables writes it"


def test_every_command_is_on_the_page() -> None:
    listed = PAGE.split("## Commands")[0]
    assert [command.word for command in Command if f"`{command.word}`" not in listed] == []


def test_every_object_of_the_eds_is_on_the_page_and_no_other() -> None:
    assert sorted(documented()) == sorted(wanted())


def test_every_object_agrees_with_the_eds() -> None:
    listed, kinds = documented(), {code: name for name, code in TYPES.items()}
    for address, variable in wanted().items():
        limits = f"{variable.low} to {variable.high}" if variable.high is not None else ""
        name, *rest, _meaning = listed[address]
        assert (name.lower().replace(" ", "_"), *rest) == (
            variable.name.split(".")[-1],
            kinds[variable.data_type],
            variable.access,
            limits,
        ), address


def test_bytes_of_the_status_pdo_are_those_of_the_mapping() -> None:
    variables = load_eds(OWN_EDS, NODE_ID).variables
    mapped, byte = [], 0
    for subindex in range(1, 7):
        entry = variables[0x1A00, subindex].default
        assert isinstance(entry, int)
        size = (entry & 0xFF) // 8
        mapped.append((", ".join(str(byte + n) for n in range(size)), entry >> 16, entry >> 8 & 0xFF))
        byte += size
    table = PAGE.split("## Status PDO")[1].split("<!-- objects -->", maxsplit=1)[0]
    listed = re.findall(r"^\| ([0-7](?:, [0-7])?) \| (`[^`]*`) \|", table, re.MULTILINE)
    assert [(place, *addresses(cell)[0]) for place, cell in listed] == mapped


@pytest.mark.parametrize("dialogue", DIALOGUES.findall(PAGE))
def test_dialogue_runs_as_written(dialogue: str) -> None:
    bench = ControllerNodeBench()
    bench.node.boot_up()
    bench.frames.clear()
    expected = []
    for line in dialogue.splitlines():
        can_id, payload = line.split("  #")[0].split()[-1].split("#")
        if line.startswith("cansend vcan0 "):
            bench.put(int(can_id, 16), bytes.fromhex(payload))
        else:
            expected.append((int(can_id, 16), bytes.fromhex(payload)))
    assert bench.frames == expected


def test_every_abort_code_is_on_the_page() -> None:
    (table,) = ABORTS.findall(PAGE)
    listed = [int(row[0].strip("`h").replace(" ", ""), 16) for row in rows(table)]
    assert listed == sorted(AbortCode)
