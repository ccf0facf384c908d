"""Access rights and limits come from the EDS; every writable entry has a handler."""

from pathlib import Path

import pytest
from controller_node_bench import NODE_ID, OWN_EDS, ControllerNodeBench

from servo_ctrl.canopen.dictionary import Dictionary
from servo_ctrl.canopen.errors import AbortCode, SdoAbort
from servo_ctrl.canopen.stack import Eds, EdsVariable, load_eds


def made_of(*variables: EdsVariable) -> Dictionary:
    return Dictionary(Eds(Path("made.eds"), {(v.index, v.subindex): v for v in variables}))


def test_write_only_objects_cannot_be_read() -> None:
    dictionary = made_of(EdsVariable("key", 0x2500, 0, 0x6, "wo", pdo_mappable=False, default=None))
    taken: list[int] = []
    dictionary.writers[0x2500] = lambda _sub, value: taken.append(value)
    with pytest.raises(SdoAbort) as refused:
        dictionary.read(0x2500, 0)
    assert refused.value.code is AbortCode.READ_OF_WRITE_ONLY
    assert dictionary.writable_size(0x2500, 0) == 2
    dictionary.write(0x2500, 0, b"\x34\x12")
    assert taken == [0x1234]


def test_limits_of_signed_numbers() -> None:
    variable = EdsVariable("set", 0x2500, 0, 0x2, "rw", pdo_mappable=False, default=0, low=-5, high=5)
    dictionary = made_of(variable)
    taken: list[int] = []
    dictionary.writers[0x2500] = lambda _sub, value: taken.append(value)
    for byte, code in ((0x06, AbortCode.VALUE_TOO_HIGH), (0xFA, AbortCode.VALUE_TOO_LOW)):
        with pytest.raises(SdoAbort) as refused:
            dictionary.write(0x2500, 0, bytes((byte,)))
        assert refused.value.code is code
    dictionary.write(0x2500, 0, b"\xfb")
    assert taken == [-5]


def test_a_text_that_is_not_ascii_still_travels() -> None:
    dictionary = made_of(EdsVariable("why", 0x2500, 0, 0x9, "ro", pdo_mappable=False, default=""))
    dictionary.readers[0x2500] = lambda _sub: "zu gro\u00df"
    assert dictionary.read(0x2500, 0) == b"zu gro?"


def refusal(answer: str) -> int:
    """The abort code of an answer, 0 without."""
    frame = bytes.fromhex(answer)
    return int.from_bytes(frame[4:], "little") if frame[0] == 0x80 else 0


def test_every_entry_of_the_eds_can_be_read_and_only_writable_ones_written() -> None:
    bench = ControllerNodeBench()
    bench.node.boot_up()
    for (index, subindex), variable in load_eds(OWN_EDS, NODE_ID).variables.items():
        address = index.to_bytes(2, "little").hex() + f"{subindex:02x}"
        (answer,) = bench.ask(f"40 {address} 00000000")
        there = {0, AbortCode.NO_DATA}
        if index >= 0x2120 and index & 0xF > 2:  # the table has two axes
            there = {AbortCode.NO_SUCH_OBJECT}
        elif index in {0x2102, 0x2103, 0x2107, 0x2108} and subindex > 2:
            there = {AbortCode.NO_SUCH_SUBINDEX}
        assert refusal(answer) in there, variable
        (answer,) = bench.ask(f"22 {address} 00000000")
        read_only = variable.access in {"ro", "const"}
        assert (refusal(answer) == AbortCode.WRITE_OF_READ_ONLY) == read_only, variable
