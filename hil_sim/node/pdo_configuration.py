"""Objects 1400h to 1BFFh: checks of the remapping sequence, and the PDOs compiled from them.

Sequence of CiA 301: switch the PDO off (bit 31 of the COB-ID), number of entries to 0, write the entries,
write the number, switch it on.
"""

import logging
from collections.abc import Callable, Iterator
from functools import partial

from hil_sim.node.dictionary import Dictionary, limits_of
from hil_sim.node.identifiers import check_identifier
from hil_sim.node.pdo import MappedObject, PdoSettings, Rpdo, Tpdo
from hil_sim.node.pdo_kinds import tpdo_of
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

logger = logging.getLogger(__name__)

SYNC, EMCY = 0x1005, 0x1014
SWITCHED_OFF = 0x8000_0000
NOT_ON_REQUEST = 0x4000_0000
"""Bit of a TPDO's COB-ID: no remote frame is answered."""
RPDO, TPDO = 0x1400, 0x1800
MAPPING = 0x200  # distance of a mapping parameter from its communication parameter
SPAN = 0x200  # of the communication parameters of one direction
RESERVED_TYPES = {RPDO: range(241, 254), TPDO: range(241, 252)}
"""Transmission types by direction: 241-251 are reserved, 252 and 253 send a TPDO on request."""
INHIBIT_TIME, SYNC_START = 3, 6
LARGEST_SYNC_START = 240
RECEIVED_ACCESS = {"rw", "rww", "wo"}
TRANSMITTED_ACCESS = {"ro", "rw", "rwr", "const"}


class PdoConfiguration:
    """PDOs of one node; calls `on_change` when their set may have changed."""

    def __init__(self, dictionary: Dictionary, on_change: Callable[[], None]) -> None:
        self._dictionary = dictionary
        self._received = [index for index in dictionary.indices if RPDO <= index < RPDO + SPAN]
        self._transmitted = [index for index in dictionary.indices if TPDO <= index < TPDO + SPAN]
        for index in self._received + self._transmitted:
            dictionary.checks[index] = partial(self._check_communication, index)
            dictionary.checks[index + MAPPING] = partial(self._check_mapping, index)
            dictionary.followers[index] = dictionary.followers[index + MAPPING] = lambda _sub: on_change()

    def rpdos(self, on_length: Callable[[int, int, int], None]) -> list[Rpdo]:
        """Compile the enabled RPDOs; `on_length(number, size, expected)` is called at wrong lengths."""
        objects = self._dictionary.objects
        return [
            Rpdo(settings, mapping, objects, partial(on_length, number))
            for number, index in enumerate(self._received, 1)
            for settings, mapping in self._enabled(index)
        ]

    def tpdos(
        self, send: Callable[[int, bytes], None], sync_counter: Callable[[], int] | None = None
    ) -> list[Tpdo]:
        """Compile the enabled TPDOs; `sync_counter`: see `tpdo_of`."""
        objects = self._dictionary.objects
        return [
            tpdo_of(settings, mapping, objects, send, sync_counter)
            for index in self._transmitted
            for settings, mapping in self._enabled(index)
        ]

    def _is_on(self, index: int) -> bool:
        return not self._dictionary.value(index, 1) & SWITCHED_OFF

    def _enabled(self, index: int) -> Iterator[tuple[PdoSettings, list[MappedObject]]]:
        """Settings and mapping of the PDO at `index`, if it is on and maps anything."""
        mapping = self._usable_mapping(index)
        if not mapping or not self._is_on(index):
            return
        value, variables = self._dictionary.value, self._dictionary.variables
        inhibit_us = 100 * value(index, INHIBIT_TIME) if (index, INHIBIT_TIME) in variables else 0
        event_timer_us = 1000 * value(index, 5) if (index, 5) in variables else 0
        sync_start = value(index, SYNC_START) if (index, SYNC_START) in variables else 0
        cob_id, remote = value(index, 1) & 0x7FF, not value(index, 1) & NOT_ON_REQUEST
        yield (
            PdoSettings(
                cob_id=cob_id,
                transmission_type=value(index, 2),
                inhibit_us=inhibit_us,
                event_timer_us=event_timer_us,
                sync_start=sync_start,
                remote=remote,
            ),
            mapping,
        )

    def _usable_mapping(self, index: int) -> list[MappedObject]:
        """The mapping; empty if an entry of a stored one is no longer in the EDS."""
        entries = self._entries(index, self._dictionary.value(index + MAPPING, 0))
        try:
            return [self._mapped(index, entry) for entry in entries]
        except SdoAbort:
            node_id = self._dictionary.node_id
            logger.warning("node %d: PDO %04Xh stays off, its mapping does not fit the EDS", node_id, index)
            return []

    def _taken(self, index: int) -> set[int]:
        """Identifiers that the PDO at `index` cannot have: of SYNC and EMCY, of another TPDO if it is one."""
        value = self._dictionary.value
        taken = {value(service) & 0x7FF for service in (SYNC, EMCY) if service in self._dictionary.indices}
        if index >= TPDO:
            others = (other for other in self._transmitted if other != index and self._is_on(other))
            taken |= {value(other, 1) & 0x7FF for other in others}
        return taken

    def _entries(self, index: int, count: int) -> list[int]:
        return [self._dictionary.value(index + MAPPING, sub) for sub in range(1, count + 1)]

    def _mapped(self, index: int, entry: int) -> MappedObject:
        """Resolve one mapping entry. Raises SdoAbort for what cannot be mapped there."""
        mapped, subindex, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
        variable = self._dictionary.variable(mapped, subindex)
        received = index < TPDO
        if mapped < 0x20:
            fits = received  # dummy entries fill gaps in RPDOs only
        else:
            access = RECEIVED_ACCESS if received else TRANSMITTED_ACCESS
            fits = variable.pdo_mappable and variable.access_type in access
        if not fits or bits != len(variable):
            raise SdoAbort(AbortCode.CANNOT_BE_MAPPED)
        name = self._dictionary.attributes.get((mapped, subindex))
        return MappedObject(name, variable.data_type, *limits_of(variable))

    def _check_communication(self, index: int, subindex: int, value: int) -> None:
        if subindex == 1:
            check_identifier(value)
            present = self._dictionary.value(index, 1)
            if not value & SWITCHED_OFF and value & 0x7FF in self._taken(index):
                raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)
            if self._is_on(index) and not value & SWITCHED_OFF and (value ^ present) & 0x7FF:
                raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
        elif subindex == 2:
            if value in RESERVED_TYPES[RPDO if index < TPDO else TPDO]:
                raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
        elif subindex == SYNC_START and value > LARGEST_SYNC_START:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
        elif subindex in {INHIBIT_TIME, SYNC_START} and self._is_on(index):
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)

    def _check_mapping(self, index: int, subindex: int, value: int) -> None:
        if self._is_on(index):
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
        count = self._dictionary.value(index + MAPPING, 0)
        if subindex:
            if count:
                raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
            if value:
                self._mapped(index, value)
            return
        if value > 8:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
        entries = self._entries(index, value)
        for entry in entries:
            self._mapped(index, entry)
        if sum(entry & 0xFF for entry in entries) > 64:
            raise SdoAbort(AbortCode.PDO_LENGTH_EXCEEDED)
