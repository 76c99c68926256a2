"""CODESYS's table, IgH's script, ROS 2's files, DCF and the table for people, as they are read."""

from __future__ import annotations

import csv
import io
import re
import struct
from typing import Any

import canopen
import yaml

from tests.support.controllers.consumed import Consumed, Refused, need, unsigned

_SIZES = {"int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "int64": 8,
          "uint64": 8}  # fmt: skip

# --- CODESYS ----------------------------------------------------------------------------

#: Columns of the tab of start-up parameters: techdocs.wago.com/Software/EtherCAT/en-US/
#: 1485404555.html (a tool with CODESYS's own editor).
_CODESYS = ["Line", "Index:Subindex", "Name", "Value", "Bit length", "Abort on error",
            "Jump to line on error", "Next line", "Comment"]  # fmt: skip
_OBJECT = re.compile(r"16#([0-9A-F]{4}):16#([0-9A-F]{2})")


def codesys(data: bytes) -> Consumed:
    """Rows in their order; numbers as IEC 61131-3 writes them."""
    table = csv.DictReader(io.StringIO(data.decode("utf-8-sig")), delimiter=";")
    need(table.fieldnames == _CODESYS, f"columns {table.fieldnames}")
    found = Consumed()
    for number, row in enumerate(table, 1):
        need(int(row["Line"]) == number, f"line {row['Line']}")
        place = _OBJECT.fullmatch(row["Index:Subindex"])
        if place is None:
            raise Refused(f"object {row['Index:Subindex']!r}")
        bits = unsigned(row["Bit length"], 8, "bit length")
        need(bits in (8, 16, 32, 64), f"bit length {bits}")
        need(row["Value"].startswith("16#"), f"value {row['Value']!r}")
        value = unsigned(row["Value"][3:], bits, "value", 16)
        need({row["Abort on error"], row["Jump to line on error"]} <= {"TRUE", "FALSE"}, "flags")
        written = value.to_bytes(bits // 8, "little")
        found.writes.append((int(place[1], 16), int(place[2], 16), written, "PS"))
    return found


# --- IgH --------------------------------------------------------------------------------

#: `ethercat download --help` of the IgH master: options, then index, subindex and value.
_DOWNLOAD = re.compile(
    r'ethercat download -p "\$POS" -t (\w+) 0x([0-9A-F]{4}) 0x([0-9A-F]{2}) -- (-?\d+)'
)


def igh(data: bytes) -> Consumed:
    """The downloads of the script; every other line is a comment or guards them."""
    found = Consumed()
    text = data.decode("ascii", "backslashreplace")
    need(text.startswith("#!/bin/sh\n"), "no shell script")
    for line in text.splitlines():
        if "ethercat download" not in line:
            continue
        words = _DOWNLOAD.fullmatch(line)
        if words is None:
            raise Refused(f"line {line!r}")
        need(words[1] in _SIZES, f"type {words[1]}")
        size, signed = _SIZES[words[1]], not words[1].startswith("u")
        try:
            written = int(words[4]).to_bytes(size, "little", signed=signed)
        except OverflowError as error:
            raise Refused(f"{words[4]} is no {words[1]}") from error
        found.writes.append((int(words[2], 16), int(words[3], 16), written, "PS"))
    return found


# --- ROS 2 ------------------------------------------------------------------------------

#: ethercat_driver_ros2, sphinx/user_guide/config_generic_slave.rst and config_cia402_drive.rst:
#: fields with the types that they have.
_SLAVE = {"vendor_id": int, "product_id": int, "assign_activate": int, "auto_fault_reset": bool,
          "sdo": list, "rpdo": list, "tpdo": list}  # fmt: skip
_SDO = {"index", "sub_index", "type", "value"}
_CHANNEL = {"index": int, "sub_index": int, "type": str, "default": float, "factor": float}


def _yaml(data: bytes) -> dict[str, Any]:
    content = yaml.safe_load(data)
    need(isinstance(content, dict), "no map")
    return dict(content)


def _typed(row: dict[str, Any], field: str, kind: type) -> Any:
    value = row.get(field)
    need(type(value) is kind, f"{field}: {value!r} is no {kind.__name__}")
    return value


def ros2_ethercat(data: bytes) -> Consumed:
    """Slave file of ethercat_driver_ros2, which reads a value as a C++ int and casts it."""
    content = _yaml(data)
    for field in content:
        need(field in _SLAVE, f"field {field}")
        _typed(content, field, _SLAVE[field])
    found = Consumed(identity=(content["vendor_id"], content["product_id"]))
    found.assign_activate = content.get("assign_activate")
    for row in content["sdo"]:
        need(set(row) == _SDO, f"sdo with {set(row)}")
        need(row["type"] in _SIZES, f"sdo type {row['type']}")
        value = _typed(row, "value", int)
        need(-(2**31) <= value < 2**31, f"{value} is no C++ int")
        size = _SIZES[row["type"]]
        written = (value % (1 << 8 * size)).to_bytes(size, "little")
        found.writes.append((_typed(row, "index", int), row["sub_index"], written, "PS"))
    for direction, role in (("rpdo", "command_interface"), ("tpdo", "state_interface")):
        for pdo in content.get(direction, []):
            need(set(pdo) == {"index", "channels"}, f"pdo with {set(pdo)}")
            found.pdos[pdo["index"]] = [_channel(row, role) for row in pdo["channels"]]
    return found


def _channel(row: dict[str, Any], role: str) -> tuple[int, int, int]:
    need(set(row) <= {*_CHANNEL, role}, f"channel with {set(row)}")
    for field in row:
        _typed(row, field, _CHANNEL.get(field, str))
    kind = row["type"]
    if re.fullmatch(r"bit[1-9]\d*", kind):
        return row["index"], row["sub_index"], int(kind[3:])
    need(kind in _SIZES or kind == "bool", f"channel type {kind}")
    return row["index"], row["sub_index"], 1 if kind == "bool" else 8 * _SIZES[kind]


#: ros2_canopen, canopen/sphinx/user-guide/configuration.rst and cia402-driver.rst.
_MASTER = {"node_id", "driver", "package", "sync_period"}
_NODE = {"node_id", "dcf", "driver", "package", "period", "sdo"}


def ros2_canopen(files: dict[str, bytes]) -> Consumed:
    """`bus.yml` with the DCF that it names. A value is packed by the type that the DCF states."""
    first, *_ = files
    content = _yaml(files[first])
    need(set(content) == {"options", "master", "nodes"}, f"sections {set(content)}")
    need(set(content["options"]) == {"dcf_path"}, "options")
    need(set(content["master"]) == _MASTER, f"master with {set(content['master'])}")
    (node,) = content["nodes"].values()
    need(set(node) == _NODE, f"node with {set(node)}")
    need(1 <= node["node_id"] <= 127, "node number")
    need(node["node_id"] != content["master"]["node_id"], "two nodes have one number")
    text = files[node["dcf"]].decode()
    # Lely's dcfgen, which ros2_canopen runs over the file, refuses one without these objects,
    # and a default that is no whole number.
    for section in ("[1000]", "[1001]", "[1018]", "[1018sub1]"):
        need(section in text, f"{section} is missing in the DCF")
    for default in re.findall(r"^DefaultValue=(.+)\r$", text, re.M):
        plain = re.fullmatch(r"(\$NODEID\+)?-?(0x[0-9A-Fa-f]+|\d+)", default)
        need(plain or not re.match(r"[\d.+-]", default), f"default {default!r}")
    dictionary = _dictionary(text, node["dcf"], node["node_id"])
    found = Consumed(cycle_us=content["master"]["sync_period"])
    for row in node["sdo"]:
        need(set(row) == {"index", "sub_index", "value"}, f"sdo with {set(row)}")
        value = _typed(row, "value", int)
        variable = _variable(dictionary, row["index"], row["sub_index"])
        try:
            written = variable.encode_raw(value)
        except (ValueError, struct.error, canopen.objectdictionary.ObjectDictionaryError) as error:
            raise Refused(f"{row}: {error}") from error
        found.writes.append((row["index"], row["sub_index"], written, ""))
    return found


# --- CANopen ----------------------------------------------------------------------------


def _dictionary(text: str, name: str, node: int = 1) -> Any:
    file = io.StringIO(text)
    file.name = name
    return canopen.import_od(file, node)


def _variable(dictionary: Any, index: int, subindex: int) -> Any:
    need(index in dictionary, f"{index:04X}h is not in the DCF")
    entry = dictionary[index]
    if isinstance(entry, canopen.objectdictionary.ODVariable):
        return entry
    need(subindex in entry, f"{index:04X}h:{subindex} is not in the DCF")
    return entry[subindex]


def dcf(data: bytes) -> Consumed:
    """Values that the `canopen` package would write; a DCF has no order."""
    found = Consumed(ordered=False)
    for entry in _dictionary(data.decode(), "list.dcf").values():
        single = isinstance(entry, canopen.objectdictionary.ODVariable)
        for variable in [entry] if single else entry.values():
            if variable.value is None:
                continue
            need(variable.writable, f"{variable.index:04X}h:{variable.subindex} is read only")
            written = variable.encode_raw(variable.value)
            found.writes.append((variable.index, variable.subindex, written, ""))
    return found


def concise(data: bytes) -> Consumed:
    """Contents of 1F22h (CiA 302-3): a number of rows of index, subindex, size and data."""
    (count,) = struct.unpack_from("<I", data)
    found, at = Consumed(), 4
    for _ in range(count):
        index, subindex, size = struct.unpack_from("<HBI", data, at)
        at += 7 + size
        need(at <= len(data), "it is cut short")
        found.writes.append((index, subindex, data[at - size : at], ""))
    need(at == len(data), "something follows the last row")
    return found


def table(data: bytes) -> Consumed:
    """The CSV: bytes and the number next to them say the same."""
    found = Consumed()
    for row in csv.DictReader(io.StringIO(data.decode("utf-8-sig"))):
        written = bytes.fromhex(row["data"])
        need(len(written) == int(row["bytes"]), f"size of {row['key']}")
        if row["type"] == "REAL32":
            need(struct.unpack("<f", written) == (float(row["raw"]),), f"value of {row['key']}")
        else:
            signed = not row["type"].startswith(("U", "B"))
            number = int.from_bytes(written, "little", signed=signed)
            need(number == int(row["raw"]), f"value of {row['key']}")
        place = (
            unsigned(row["index"][2:], 16, "index", 16),
            unsigned(row["subindex"][2:], 8, "subindex", 16),
        )
        need(row["key"] == f"{place[0]:04X}:{place[1]:02X}", f"key {row['key']}")
        found.writes.append((*place, written, row["transition"]))
    return found
