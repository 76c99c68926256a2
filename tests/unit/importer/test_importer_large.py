"""A file of 5 MB, as makers put whole series into one: at most 3 s and 300 MB."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

BYTES = 5_000_000
MOST_S, MOST_MB = 3.0, 300
_MEASURE = """
import json, sys, time
from pathlib import Path
from profiles.importer import import_file, write_profile
before = time.process_time()
imported = import_file(Path(sys.argv[1]).read_bytes(), "large.xml", drive="large")
write_profile(imported.profile, Path(sys.argv[2]))
# The figure of getrusage begins with what the parent held when it forked.
status = Path("/proc/self/status").read_text().splitlines()
peak = next(line for line in status if line.startswith("VmHWM"))
print(json.dumps({
    "cpu_s": time.process_time() - before,
    "memory_mb": int(peak.split()[1]) / 1024,
    "parameters": len(imported.profile.parameters),
    "product": imported.profile.identity.product_code,
}))
"""


def row(index: int, name: str, kind: str = "UINT", bits: int = 16) -> str:
    return (
        f"<Object><Index>#x{index:04X}</Index><Name>{name}</Name><Type>{kind}</Type>"
        f"<BitSize>{bits}</BitSize><Info><DefaultData>0100</DefaultData></Info><Flags>"
        f"<Access>rw</Access><Category>o</Category></Flags></Object>"
    )


def device(product: int, objects: int) -> str:
    rows = row(0x6040, "Controlword") + row(0x6041, "Statusword")
    rows += "".join(row(0x2000 + n, f"Parameter number {n} of the drive") for n in range(objects))
    return (
        f'<Device><Type ProductCode="#x{product:X}" RevisionNo="#x1">Drive</Type>'
        f"<Name>Drive {product}</Name><Profile><Dictionary><Objects>{rows}</Objects></Dictionary>"
        "</Profile></Device>"
    )


def large(objects: int) -> bytes:
    """So many devices with so many objects each that the file has 5 MB."""
    one = device(1, objects)
    devices = "".join(device(n, objects) for n in range(1, BYTES // len(one) + 2))
    return (
        "<EtherCATInfo><Vendor><Id>1</Id><Name>Maker</Name></Vendor><Descriptions><Devices>"
        f"{devices}</Devices></Descriptions></EtherCATInfo>"
    ).encode()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("objects", [500, 16_000])
def test_time_and_memory_of_a_large_file(tmp_path: Path, objects: int) -> None:
    """A series of drives, and one drive with as many objects as the maker's range holds."""
    file = tmp_path / "large.xml"
    file.write_bytes(large(objects))
    assert file.stat().st_size >= BYTES
    done = subprocess.run(
        [sys.executable, "-c", _MEASURE, str(file), str(tmp_path / "profiles")],
        capture_output=True,
        text=True,
        check=True,
    )
    measured = json.loads(done.stdout)
    print(measured)
    assert measured["parameters"] >= objects
    # Processor time: others may use this computer at the same time.
    assert measured["cpu_s"] <= MOST_S, measured
    assert measured["memory_mb"] <= MOST_MB, measured
