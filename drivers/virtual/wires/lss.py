"""A slave of the layer setting services (CiA 305), without I/O: takes frames, returns answers."""

from __future__ import annotations

import struct

from drivers.canopen.lss import codes
from drivers.canopen.lss.codes import LssIdentity

_NODE_OUT_OF_RANGE, _RATE_NOT_SUPPORTED = 1, 1
_FIRST_ERROR = 1


class LssSlave:
    """States and pending values. ``node_id`` 255 is none; stored values survive power cycles."""

    def __init__(self, identity: LssIdentity, node_id: int, rate_index: int | None = None) -> None:
        self.identity = identity
        self.pending_node = self.stored_node = node_id
        self.active_node = node_id
        self.pending_rate = self.stored_rate = self.active_rate = rate_index
        self.can_store = True
        self.rates = frozenset(codes.BIT_RATES_KBIT.values())
        self._configuring = False
        self._matched = 0
        self._position = 0

    @property
    def unconfigured(self) -> bool:
        """Whether it has no node-ID and therefore serves only LSS."""
        return self.active_node == codes.NO_NODE_ID

    def power_on(self) -> None:
        """Activate the stored values."""
        self.pending_node = self.active_node = self.stored_node
        self.pending_rate = self.active_rate = self.stored_rate
        self._configuring, self._matched, self._position = False, 0, 0

    def take(self, data: bytes) -> bytes | None:
        """Process a request; return the answer, if any."""
        if len(data) != 8:
            return None
        command = data[0]
        if command == codes.SWITCH_ALL:
            self._configuring = data[1] == codes.CONFIGURATION
            return None
        if command in codes.SELECT:
            return self._select(codes.SELECT.index(command), codes.number_of(data))
        if command == codes.FASTSCAN:
            return self._scan(*struct.unpack("<IBBB", data[1:]))
        if command == codes.IDENTIFY_UNCONFIGURED:
            return codes.frame(codes.UNCONFIGURED) if self.unconfigured else None
        return self._configure(command, data) if self._configuring else None

    def _select(self, part: int, number: int) -> bytes | None:
        matches = number == self.identity[part] and part in (0, self._matched)
        self._matched = part + 1 if matches and not self._configuring else 0
        if self._matched < len(codes.SELECT):
            return None
        self._matched, self._configuring = 0, True
        return codes.frame(codes.SELECTED)

    def _scan(self, number: int, bit: int, part: int, following: int) -> bytes | None:
        if self._configuring or not self.unconfigured:
            return None
        if bit == codes.RESET_SCAN:
            self._position = 0
            return codes.frame(codes.IDENTIFIED)
        if part != self._position or bit > 31 or part > 3:
            return None
        if (self.identity[part] ^ number) >> bit:
            return None
        if bit == 0 and following != part:
            if following < part:
                self._configuring = True
            self._position = following
        return codes.frame(codes.IDENTIFIED)

    def _configure(self, command: int, data: bytes) -> bytes | None:
        if command == codes.NODE_ID:
            right = 1 <= data[1] <= 127 or data[1] == codes.NO_NODE_ID
            if right:
                self.pending_node = data[1]
            return codes.frame(command, 0 if right else _NODE_OUT_OF_RANGE)
        if command == codes.BIT_TIMING:
            right = data[1] == 0 and data[2] in self.rates
            if right:
                self.pending_rate = data[2]
            return codes.frame(command, 0 if right else _RATE_NOT_SUPPORTED)
        if command == codes.STORE:
            if not self.can_store:
                return codes.frame(command, _FIRST_ERROR)
            self.stored_node, self.stored_rate = self.pending_node, self.pending_rate
            return codes.frame(command, 0)
        if command in codes.INQUIRE:
            return codes.with_number(command, self.identity[codes.INQUIRE.index(command)])
        if command == codes.INQUIRE_NODE_ID:
            return codes.frame(command, self.pending_node)
        return None
