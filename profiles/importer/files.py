"""From a description file to a profile, and from a profile to a folder for the loader."""

from __future__ import annotations

import gc
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import yaml

from profiles.importer.build import ImportedProfile, build_profile
from profiles.importer.eds.eds import read_eds
from profiles.importer.esi.esi import EsiDevice, EsiFile, esi_devices, open_esi, read_device
from profiles.importer.report import ImportFailed, ImportReport
from profiles.loader import CLASS_FIELDS
from profiles.replacing import move_into_place
from profiles.schema import Profile

#: libyaml's writer if PyYAML was built with it; ten times as fast.
_SafeDumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


class _PlainDumper(_SafeDumper):  # type: ignore[misc, valid-type]
    """YAML dumper for model data: mostly texts and mappings, and no shared objects."""

    def represent_data(self, data: object) -> yaml.Node:
        if type(data) is str:
            return yaml.ScalarNode("tag:yaml.org,2002:str", data)
        if type(data) is dict:
            pairs = [(self.represent_data(k), self.represent_data(v)) for k, v in data.items()]
            return yaml.MappingNode("tag:yaml.org,2002:map", pairs, flow_style=False)
        node: yaml.Node = super().represent_data(data)
        return node


@contextmanager
def _without_collection() -> Iterator[None]:
    """Disable garbage collection: scanning the million objects of a large file takes 25 %."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


@_without_collection()
def import_file(
    data: bytes,
    name: str,
    *,
    drive: str | None = None,
    product_code: int | None = None,
    revision: int | None = None,
) -> ImportedProfile:
    """Create a profile from an ESI, EDS or DCF file, distinguished by their contents.

    From an ESI file with several devices the one with ``product_code`` (and ``revision``) is used;
    without them the newest revision of the first product that has 6040h. The result lists the
    others.

    Raises:
        ImportFailed: not such a file, or nothing usable in it.
    """
    report = ImportReport()
    _refuse_what_is_known(data, name)
    if is_xml(data):
        file = open_esi(data, name, report)
        chosen, others = _choose(file, report, product_code, revision)
        imported = build_profile(read_device(file, chosen.number), report, drive=drive)
        return replace(imported, others=others)
    return build_profile(read_eds(data, name, report), report, drive=drive)


#: Beginnings of other files that users submit by mistake, and the message for each.
_OTHER_FILES = (
    (rb"PK\x03\x04|\x1f\x8b|Rar!|7z\xbc\xaf", "description.archive"),
    (rb"%PDF", "description.pdf"),
    (rb"(?is)\s*(<!doctype html|<html)", "description.web-page"),
    (rb"(?s).{0,600}<ISO15745ProfileContainer", "description.xdd"),
)


def _refuse_what_is_known(data: bytes, name: str) -> None:
    for begins, code in _OTHER_FILES:
        if re.match(begins, data[:1000].lstrip(b"\xef\xbb\xbf")):
            raise ImportFailed(code, file=name)


def is_xml(data: bytes) -> bool:
    """Return whether a file is to be read as ESI rather than as EDS."""
    start = data[:400].lstrip(b"\xef\xbb\xbf\xff\xfe\0 \t\r\n")
    return start.startswith((b"<", b"\0<"))


def _choose(
    file: EsiFile, report: ImportReport, product_code: int | None, revision: int | None
) -> tuple[EsiDevice, tuple[EsiDevice, ...]]:
    """Return the device to be read, and the others of the file.

    Raises:
        ImportFailed: none has this product code.
    """
    devices = esi_devices(file)
    of_product = [d for d in devices if product_code in (None, d.product_code)]
    if not of_product:
        known = ", ".join(_named(d) for d in devices[:10])
        raise ImportFailed(
            "description.no-product", file=file.name, product=product_code or 0, known=known
        )
    matching = [d for d in of_product if revision in (None, d.revision)]
    if not matching and product_code is None:
        known = ", ".join(_named(d) for d in devices[:10])
        raise ImportFailed(
            "description.no-revision", file=file.name, revision=revision or 0, known=known
        )
    # The newest revision of the right product is closer than any other product.
    chosen = _newest(matching or of_product)
    others = tuple(d for d in devices if d.number != chosen.number)
    if not matching:
        report.noted(
            file.name, "description.other-revision", revision=revision or 0, used=_named(chosen)
        )
    elif len(matching) > 1:
        offered = ", ".join(_named(d) for d in matching if d.number != chosen.number)
        report.noted(
            file.name, "description.others-in-file", used=_named(chosen), others=offered[:400]
        )
    return chosen, others


def _newest(devices: list[EsiDevice]) -> EsiDevice:
    """Return the newest revision of the first product with a control word, else of the first."""
    drives = [d for d in devices if d.has_control_word] or devices
    same = [d for d in drives if d.product_code == drives[0].product_code]
    return max(same, key=lambda d: -1 if d.revision is None else d.revision)


def _named(device: EsiDevice) -> str:
    """Return the device with its numbers, under their names in the file, for any language."""
    product, revision = device.product_code or 0, device.revision or 0
    return f"{device.name} (ProductCode {product:#x}, RevisionNo {revision:#x})"


@_without_collection()
def write_profile(imported: Profile, folder: Path) -> Path:
    """Write ``folder/DRIVE/profile.yaml``, to be edited like any other profile.

    Raises:
        ImportFailed: the folder already has a profile of this name; nothing is overwritten.
    """
    target = folder / imported.drive / "profile.yaml"
    if target.exists():
        raise ImportFailed("description.profile-file-exists", path=str(target))
    text = profile_yaml(imported)
    target.parent.mkdir(parents=True, exist_ok=True)
    # Written completely or not at all: a partial profile would fail to load at every start.
    part = target.with_suffix(".part")
    try:
        part.write_text(text, "utf-8")
        move_into_place(part, target)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    return target


def profile_yaml(profile: Profile) -> str:
    """Return the profile as YAML with one parameter per line group, defaults left out."""
    data = profile.model_dump(
        mode="json", exclude_defaults=True, exclude={"parameters": {"__all__": set(CLASS_FIELDS)}}
    )
    return str(yaml.dump(data, Dumper=_PlainDumper, allow_unicode=True, sort_keys=False, width=100))
