"""Ports of a drive, and the parameters that each port carries."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.errors import NotAllowed
from drivers.link import Address, Link, LinkTraits
from drivers.texts.message import Text, profile_text, text
from profiles.schema import LinkSpec, Parameter

#: Addresses per call for register links, which admit a write between two requests of a batch. As
#: neighbouring registers share a request, a long batch splits fewer of them.
REGISTER_BATCH = 64


@dataclass(frozen=True, slots=True)
class Port:
    """One way to reach a drive."""

    link: Link
    station: int
    spec: LinkSpec | None

    def batches(self, parameters: Sequence[Parameter]) -> list[list[Parameter]]:
        """Batches to read in one call each; parameters of one object stay together where needed."""
        if self.link.traits.whole_objects:
            return _whole_objects(parameters, self.link.traits.batch)
        size, ordered = self.link.traits.batch, list(parameters)
        if self.spec and self.spec.max_registers:
            size = REGISTER_BATCH
            ordered.sort(key=lambda p: p.modbus_register or 0)
        return [ordered[at : at + size] for at in range(0, len(ordered), size)]

    def carries(self, parameter: Parameter) -> bool:
        """Whether this port can transport the parameter."""
        return carries(self.link.traits, parameter) and self.why_not(parameter) is None

    def why_not(self, parameter: Parameter) -> Text | None:
        """Why the link does not carry a parameter that its bus could carry; None where it does."""
        return self.link.unreachable(self.station, address_of(parameter))


def _whole_objects(parameters: Sequence[Parameter], size: int) -> list[list[Parameter]]:
    parts: list[list[Parameter]] = []
    ordered = sorted(parameters, key=lambda p: p.index or 0)
    for _, members in itertools.groupby(ordered, key=lambda p: p.index):
        if not parts or len(parts[-1]) >= size:
            parts.append([])
        parts[-1].extend(members)
    return parts


def carries(traits: LinkTraits, parameter: Parameter) -> bool:
    """Whether a port of this kind of bus can transport the parameter."""
    return (parameter.modbus_register if traits.registers else parameter.index) is not None


def address_of(parameter: Parameter) -> Address:
    """Bus address of a parameter."""
    return Address(
        index=parameter.index,
        subindex=parameter.subindex or 0,
        type=parameter.type,
        register=parameter.modbus_register,
    )


def port_for(drive: str, family: str, ports: Sequence[Port], parameter: Parameter) -> Port:
    """The first port that can carry the parameter of the drive of this name.

    Raises:
        NotAllowed: none can; the message states which link would.
    """
    for port in ports:
        if port.carries(parameter):
            return port
    raise NotAllowed(
        "drive.object-cannot-be-reached",
        drive=drive,
        parameter=parameter.key,
        name=profile_text(family, parameter.name),
        why=unreachable_why(ports, parameter),
    )


def unreachable_why(ports: Sequence[Port], parameter: Parameter) -> Text | None:
    """Why no port carries the parameter; None where one does."""
    if any(port.carries(parameter) for port in ports):
        return None
    for port in ports:
        if carries(port.link.traits, parameter):
            return port.why_not(parameter)
    kinds = sorted({port.link.kind for port in ports})
    needed = "Modbus" if parameter.index is None else "CANopen"
    return text("drive.exists-only-over", needed=needed, kinds=", ".join(kinds) or "—")
