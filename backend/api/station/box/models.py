"""Messages about the name and the network ports of the station."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from backend.api.messages.models import Message

PortName = Annotated[str, Field(max_length=15)]


class BoxPort(Message):
    """A network port of this computer."""

    name: str
    up: bool
    wired: bool
    addresses: list[str] = Field(description="IPv4 addresses that it has now")
    here: bool = Field(description="this request came by it")


class BoxInfo(Message):
    """Current settings, and the ports that can be chosen."""

    configured: bool
    name: str
    ethercat: str = Field(description="port of the drives; empty: any but the office's")
    office: str = Field(description="port of people; no EtherCAT is allowed there")
    ports: list[BoxPort]


class BoxChange(Message):
    """New settings. The name takes effect at the next start of the server, the ports at once."""

    name: Annotated[str, Field(min_length=1, max_length=63)]
    ethercat: PortName = ""
    office: PortName = ""
