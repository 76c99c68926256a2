"""Fresh virtual drives on a line without a wire, and lists that are brought to them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from xml.etree.ElementTree import Element, SubElement

from defusedxml.ElementTree import fromstring

from backend.records.handover.eni import eni
from backend.records.handover.esi import controller_of
from backend.records.handover.model import OVERWRITTEN, AxisHandover, hand_over
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.wires.ethercat.segment import Segment
from drivers.virtual.wires.ethercat.slave import Slave
from profiles.schema import Profile, Raw
from tests.support.controllers.consumed import Consumed
from tests.support.eni_master import EniMaster
from tests.support.esi_of_virtual import esi_of
from tests.support.handed_over import (
    profile_of,
    set_of_device,
    settings,
    tuned_device,
    values,
)
from tests.wire.ethercat_slave.frames import ManualClock


def with_esi(family: str) -> AxisHandover:
    """A tuned drive's hand-over with the ESI file of its virtual drive."""
    profile = profile_of(family)
    device = tuned_device(profile)
    content = set_of_device(profile, device)
    # The identity is that in the EEPROM, which a master compares.
    slave = Slave(make_device(profile), ManualClock())
    image = slave.controller.eeprom.image
    vendor, product, revision = (
        int.from_bytes(image[at : at + 4], "little") for at in (0x10, 0x14, 0x18)
    )
    axis = hand_over(
        replace(content, vendor_id=vendor, product_code=product, revision=revision), profile
    )
    source = esi_of(profile, vendor, product, revision)
    controller = controller_of(source, "v.xml", vendor, product, revision)
    return replace(axis, controller=controller)


class Rig:
    """Fresh drives on a line without a wire; time passes with every frame."""

    def __init__(self, *profiles: Profile) -> None:
        self.clock = ManualClock()
        self.profiles = profiles
        self.devices = [make_device(profile) for profile in profiles]
        self.segment = Segment([Slave(d, self.clock) for d in self.devices], self.clock)

    def exchange(self, sent: bytes) -> bytes:
        self.clock.time_ns += 250_000
        back = self.segment.process_frame(sent)
        assert back is not None
        return bytes(back)

    def check(self, axes: list[AxisHandover]) -> None:
        for axis, profile, device in zip(axes, self.profiles, self.devices, strict=True):
            now = values(device, settings(profile))
            different = {w.key for w in axis.writes if now[w.key] != w.raw}
            # What is mapped takes the controller's cyclic values, and the hand-over says so.
            named = {
                key
                for note in axis.notes
                if note.code == OVERWRITTEN
                for key in different
                if key in str(note.params["keys"])
            }
            assert different == named


def bring_up(axis: AxisHandover, taken: Consumed) -> tuple[list[int], dict[str, Raw]]:
    """A fresh drive to Operational with the list's own writes in their transitions, no others.

    The master has mailboxes, registers and frames of the drive's ENI; the start-up commands in it
    are replaced by those of the list. Returns the AL states at the end, and what the drive holds.
    """
    rig = Rig(axis.profile)
    root = fromstring(eni([axis]))
    commands = root.find("Config/Slave/Mailbox/CoE/InitCmds")
    assert commands is not None
    for command in commands.findall("InitCmd"):
        if command.get("Fixed") != "1":
            commands.remove(command)
    commands.extend(_commands(taken.writes))
    master = EniMaster(root, rig.exchange)
    master.start()
    for _ in range(5):
        master.cycle("OP")
    return master.states(), values(rig.devices[0], settings(axis.profile))


def _commands(writes: Iterable[tuple[int, int, bytes, str]]) -> Iterable[Element]:
    for index, subindex, data, transition in writes:
        command = Element("InitCmd")
        # A format that states no transition is written before process data flow.
        SubElement(command, "Transition").text = transition or "PS"
        SubElement(command, "Index").text = str(index)
        SubElement(command, "SubIndex").text = str(subindex)
        SubElement(command, "Data").text = data.hex()
        yield command


def in_every_cycle(axis: AxisHandover) -> set[str]:
    """Keys that process data overwrite, as the hand-over names them."""
    notes = [note for note in axis.notes if note.code == OVERWRITTEN]
    return {
        write.key
        for write in axis.writes
        if any(write.key in str(note.params["keys"]) for note in notes)
    }
