"""Objects 1400h to 1BFFh: checks of the remapping sequence, and the PDOs compiled from them.

Sequence of CiA 301: switch the PDO off (bit 31 of the COB-ID), number of entries to 0, write the entries,
write the number, switch it on.
"""

import logging
from collections.abc import Callable
from typing import Any

from canopen.sdo.exceptions import SdoAbortedError

from hil_sim.node import abort_codes
from hil_sim.node.abort_codes import abort
from hil_sim.node.dictionary import Dictionary, limits_of
from hil_sim.node.identifiers import check_identifier
from hil_sim.node.pdo import MappedObject, PdoSettings, Rpdo, Tpdo

logger = logging.getLogger(__name__)

SWITCHED_OFF = 0x8000_0000
RPDO, TPDO = 0x1400, 0x1800
MAPPING = 0x200  # distance of a mapping parameter from its communication parameter
COMMUNICATION_SPAN = 0x200
RESERVED_TYPES = range(241, 254)  # 241-251 reserved, 252 and 253 are for remote frames
RECEIVED_ACCESS = {"rw", "rww", "wo"}
TRANSMITTED_ACCESS = {"ro", "rw", "rwr", "const"}


class PdoConfiguration:
    """PDOs of one node; calls `on_change` when their set may have changed."""

    def __init__(self, dictionary: Dictionary, on_change: Callable[[], None]) -> None:
        self._dictionary = dictionary
        self._node_id = dictionary.node_id
        self._on_change = on_change
        present = list(dictionary.object_dictionary)
        self._received = [index for index in present if RPDO <= index < RPDO + COMMUNICATION_SPAN]
        self._transmitted = [index for index in present if TPDO <= index < TPDO + COMMUNICATION_SPAN]
        for index in self._received + self._transmitted:
            self._watch(index)

    def _watch(self, index: int) -> None:
        dictionary = self._dictionary
        dictionary.checks[index] = lambda sub, value: self._check_communication(index, sub, value)
        dictionary.checks[index + MAPPING] = lambda sub, value: self._check_mapping(index, sub, value)
        dictionary.followers[index] = lambda _sub: self._on_change()
        dictionary.followers[index + MAPPING] = lambda _sub: self._on_change()

    def rpdos(self, on_length: Callable[[int, int, int], None]) -> list[Rpdo]:
        """Compile the enabled RPDOs; `on_length(number, size, expected)` is called at wrong lengths."""
        compiled = []
        for number, index in enumerate(self._received, 1):
            settings, mapping = self._settings(index), self._usable_mapping(index)
            if settings is not None and mapping:

                def wrong(size: int, expected: int, number: int = number) -> None:
                    on_length(number, size, expected)

                compiled.append(Rpdo(settings, mapping, self._dictionary.objects, wrong))
        return compiled

    def tpdos(self, send: Callable[[int, bytes], None]) -> list[Tpdo]:
        """Compile the enabled TPDOs."""
        compiled = []
        for index in self._transmitted:
            settings, mapping = self._settings(index), self._usable_mapping(index)
            if settings is not None and mapping:
                compiled.append(Tpdo(settings, mapping, self._dictionary.objects, send))
        return compiled

    def _is_on(self, index: int) -> bool:
        return not self._dictionary.value(index, 1) & SWITCHED_OFF

    def _settings(self, index: int) -> PdoSettings | None:
        if not self._is_on(index):
            return None
        value = self._dictionary.value
        record: Any = self._dictionary.object_dictionary[index]
        inhibit_us = 100 * value(index, 3) if 3 in record else 0
        event_timer_us = 1000 * value(index, 5) if 5 in record else 0
        return PdoSettings(value(index, 1) & 0x7FF, value(index, 2), inhibit_us, event_timer_us)

    def _usable_mapping(self, index: int) -> list[MappedObject]:
        """The mapping; empty if an entry of a stored one is no longer in the EDS."""
        count = self._dictionary.value(index + MAPPING, 0)
        entries = [self._dictionary.value(index + MAPPING, sub) for sub in range(1, count + 1)]
        try:
            return [self._mapped(index, entry) for entry in entries]
        except SdoAbortedError:
            logger.warning(
                "node %d: PDO %04Xh stays off, its mapping does not fit the EDS", self._node_id, index
            )
            return []

    def _mapped(self, index: int, entry: int) -> MappedObject:
        """Resolve one mapping entry. Raises SdoAbortedError for what cannot be mapped there."""
        mapped, subindex, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
        variable = self._dictionary.variable(mapped, subindex)
        received = index < TPDO
        if mapped < 0x20:
            fits = received  # dummy entries fill gaps in RPDOs only
        else:
            access = RECEIVED_ACCESS if received else TRANSMITTED_ACCESS
            fits = variable.pdo_mappable and variable.access_type in access
        if not fits or bits != len(variable):
            raise abort(abort_codes.CANNOT_BE_MAPPED)
        name = self._dictionary.attributes.get((mapped, subindex))
        return MappedObject(name, variable.data_type, *limits_of(variable))

    def _check_communication(self, index: int, subindex: int, value: int) -> None:
        if subindex == 1:
            check_identifier(value)
            present = self._dictionary.value(index, 1)
            if self._is_on(index) and not value & SWITCHED_OFF and (value ^ present) & 0x7FF:
                raise abort(abort_codes.WRONG_DEVICE_STATE)
        elif subindex == 2:
            if value in RESERVED_TYPES:
                raise abort(abort_codes.VALUE_OUT_OF_RANGE)
        elif subindex == 3 and self._is_on(index):
            raise abort(abort_codes.WRONG_DEVICE_STATE)

    def _check_mapping(self, index: int, subindex: int, value: int) -> None:
        if self._is_on(index):
            raise abort(abort_codes.WRONG_DEVICE_STATE)
        count = self._dictionary.value(index + MAPPING, 0)
        if subindex:
            if count:
                raise abort(abort_codes.WRONG_DEVICE_STATE)
            if value:
                self._mapped(index, value)
            return
        if value > 8:
            raise abort(abort_codes.VALUE_OUT_OF_RANGE)
        entries = [self._dictionary.value(index + MAPPING, sub) for sub in range(1, value + 1)]
        for entry in entries:
            self._mapped(index, entry)
        if sum(entry & 0xFF for entry in entries) > 64:
            raise abort(abort_codes.PDO_LENGTH_EXCEEDED)
