"""A DCF of ours, written by the `canopen` package over a serial CAN line, makes the set."""

from __future__ import annotations

import io
import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import canopen
import pytest

from backend.axes.parameters.set_file import ParameterSet
from backend.records.handover.files import files_of
from backend.records.handover.model import AxisHandover, hand_over
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.wires.can_wire import CanWire
from drivers.virtual.wires.canopen import CanopenNode
from drivers.virtual.wires.slcan import SlcanSide
from profiles.schema import Profile, Raw
from tests.support.handed_over import (
    SAVED,
    profile_of,
    set_of_device,
    settings,
    tuned_device,
    values,
)

NODE = 5
FAMILIES = ("ds_c", "maker_b.eds")


class OnCan:
    """A fresh drive as node 5 and other people's client."""

    def __init__(self, profile: Profile, node: CanopenNode, network: canopen.Network) -> None:
        self.profile, self.node, self.network = profile, node, network

    def client(self, dictionary: canopen.ObjectDictionary) -> canopen.RemoteNode:
        client = canopen.RemoteNode(NODE, dictionary)
        client.sdo.RESPONSE_TIMEOUT = 5.0
        self.network.add_node(client)
        return client

    def held(self) -> dict[str, Raw]:
        return values(self.node.device, settings(self.profile))


@contextmanager
def on_can(profile: Profile, folder: Path) -> Iterator[OnCan]:
    path = folder / "ttyCAN"
    device = make_device(profile)
    node = CanopenNode(device, NODE, time.monotonic_ns)
    with CanWire(SlcanSide(path), [node]):
        network = canopen.Network()
        network.NOTIFIER_CYCLE = 0.02
        network.connect(interface="slcan", channel=str(path), bitrate=1_000_000, sleep_after_open=0)
        try:
            yield OnCan(profile, node, network)
        finally:
            network.disconnect()


def given(family: str) -> tuple[Profile, ParameterSet, AxisHandover]:
    profile = profile_of(family)
    content = set_of_device(profile, tuned_device(profile))
    return profile, content, hand_over(content, profile)


def check(held: dict[str, Raw], content: ParameterSet, axis: AxisHandover) -> None:
    wanted = {row.key: row.raw for row in content.rows}
    different = {key for key, raw in held.items() if raw != wanted[key]}
    assert different <= {each.key for each in axis.left_out}


@pytest.mark.parametrize("family", FAMILIES)
def test_the_dcf_is_loaded_by_canopen_into_a_fresh_drive(family: str, tmp_path: Path) -> None:
    profile, content, axis = given(family)
    file = io.StringIO(files_of(axis, "dcf", "list.dcf", SAVED)["list.dcf"].decode())
    file.name = "list.dcf"
    with on_can(profile, tmp_path) as bus:
        before = bus.held()
        bus.client(canopen.import_od(file, NODE)).load_configuration()
        held = bus.held()
    assert before != held
    check(held, content, axis)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_concise_dcf_is_what_a_manager_downloads(family: str, tmp_path: Path) -> None:
    # CiA 302-3: a manager downloads each row of 1F22h as it stands, in Pre-Operational.
    profile, content, axis = given(family)
    data = files_of(axis, "dcf", "list.dcf", SAVED)["list.dcf.1f22.bin"]
    (count,) = struct.unpack_from("<I", data)
    at = 4
    with on_can(profile, tmp_path) as bus:
        client = bus.client(canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        assert bus.node.state == 127
        for _ in range(count):
            index, subindex, size = struct.unpack_from("<HBI", data, at)
            client.sdo.download(index, subindex, data[at + 7 : at + 7 + size])
            at += 7 + size
        held = bus.held()
    assert at == len(data)
    check(held, content, axis)
