"""Profiles from manufacturers' description files (ESI, EDS, DCF) or a drive's own dictionary."""

from profiles.importer.build import ImportedProfile, build_profile
from profiles.importer.description import DescribedEntry, DescribedPdo, Description
from profiles.importer.dictionary import describe_dictionary
from profiles.importer.eds.dcf import (
    ConfiguredValue,
    is_dcf,
    read_dcf_identity,
    read_dcf_values,
)
from profiles.importer.eds.eds import read_eds
from profiles.importer.esi.esi import EsiDevice, open_esi, read_device
from profiles.importer.export.eds import export_dcf, export_eds, holds
from profiles.importer.export.esi import export_esi
from profiles.importer.files import import_file, write_profile
from profiles.importer.report import Finding, ImportFailed, ImportReport
from profiles.importer.texts import decode_text, decode_xml

__all__ = [
    "ConfiguredValue",
    "DescribedEntry",
    "DescribedPdo",
    "Description",
    "EsiDevice",
    "Finding",
    "ImportFailed",
    "ImportReport",
    "ImportedProfile",
    "build_profile",
    "decode_text",
    "decode_xml",
    "describe_dictionary",
    "export_dcf",
    "export_eds",
    "export_esi",
    "holds",
    "import_file",
    "is_dcf",
    "open_esi",
    "read_dcf_identity",
    "read_dcf_values",
    "read_device",
    "read_eds",
    "write_profile",
]
