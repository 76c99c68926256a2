"""The ways to reach a drive, and which of its parameters go each way."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import cast

from drivers.link import Address, Link, TellsUnreachable
from profiles.schema import LinkKind, LinkSpec, Parameter

#: Addresses per executor call. Small, so that a STOP never waits behind a long batch.
BATCH = 16
#: The same where the link itself lets a write go between two requests of a batch, and where
#: neighbouring registers share a request: those of a long batch are split less often.
REGISTER_BATCH = 64
#: The same on EtherCAT, whose link parts a batch by itself and reads whole objects: one that is
#: cut between two batches would be read entry by entry.
OBJECT_BATCH = 128


@dataclass(frozen=True, slots=True)
class Port:
    """One way to reach a drive."""

    link: Link
    station: int
    spec: LinkSpec | None

    def batches(self, parameters: Sequence[Parameter]) -> list[list[Parameter]]:
        """Parts to ask for in one call each; what is read together stays together."""
        if self.link.kind == "ethercat":
            return _whole_objects(parameters)
        size, ordered = BATCH, list(parameters)
        if self.spec and self.spec.max_registers:
            size = REGISTER_BATCH
            ordered.sort(key=lambda p: p.modbus_register or 0)
        return [ordered[at : at + size] for at in range(0, len(ordered), size)]

    def carries(self, parameter: Parameter) -> bool:
        """Whether this port can transport the parameter."""
        return carries(self.link.kind, parameter) and not self.why_not(parameter)

    def why_not(self, parameter: Parameter) -> str:
        """What the link itself has against a parameter that its kind could carry; else empty."""
        if _tells_unreachable(type(self.link)):
            link = cast("TellsUnreachable", self.link)
            return link.unreachable(self.station, address_of(parameter))
        return ""


@cache
def _tells_unreachable(link: type) -> bool:
    # Asking an object for a protocol is slow, and this is asked for every parameter.
    return issubclass(link, TellsUnreachable)


def _whole_objects(parameters: Sequence[Parameter]) -> list[list[Parameter]]:
    parts: list[list[Parameter]] = []
    ordered = sorted(parameters, key=lambda p: p.index or 0)
    for _, members in itertools.groupby(ordered, key=lambda p: p.index):
        if not parts or len(parts[-1]) >= OBJECT_BATCH:
            parts.append([])
        parts[-1].extend(members)
    return parts


def carries(kind: LinkKind, parameter: Parameter) -> bool:
    """Whether a port of this kind can transport the parameter."""
    if kind == "modbus":
        return parameter.modbus_register is not None
    return parameter.index is not None


def address_of(parameter: Parameter) -> Address:
    """Bus address of a parameter."""
    return Address(
        index=parameter.index,
        subindex=parameter.subindex or 0,
        type=parameter.type,
        register=parameter.modbus_register,
    )
