"""The ESI file that a maker of a virtual drive would give out: its controller as it is built."""

from __future__ import annotations

from drivers.virtual.wires.ethercat.slave import MAILBOXES
from profiles.schema import Profile


def esi_of(profile: Profile, vendor: int, product: int, revision: int) -> bytes:
    """Mailboxes and sync managers of `drivers.virtual.wires.ethercat.slave`."""
    out, back = MAILBOXES
    remappable = int(profile.pdo is not None and profile.pdo.remappable)
    clock = profile.pdo is not None and "DC-synchronous" in profile.pdo.sync_modes
    mode = "<Dc><OpMode><AssignActivate>#x0300</AssignActivate></OpMode></Dc>" if clock else ""
    return f"""<?xml version="1.0"?><EtherCATInfo><Vendor><Id>{vendor}</Id></Vendor>
<Descriptions><Devices><Device Physics="YY">
<Type ProductCode="#x{product:08X}" RevisionNo="#x{revision:08X}">V</Type><Name>Virtual</Name>
<Sm DefaultSize="{out}" StartAddress="#x1000" ControlByte="#x26" Enable="1">MBoxOut</Sm>
<Sm DefaultSize="{back}" StartAddress="#x1100" ControlByte="#x22" Enable="1">MBoxIn</Sm>
<Sm StartAddress="#x1200" ControlByte="#x64" Enable="1">Outputs</Sm>
<Sm StartAddress="#x1500" ControlByte="#x20" Enable="1">Inputs</Sm>
<Mailbox><CoE PdoAssign="1" PdoConfig="{remappable}"/></Mailbox>{mode}
</Device></Devices></Descriptions></EtherCATInfo>""".encode()
