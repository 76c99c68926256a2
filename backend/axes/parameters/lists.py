"""Parameter lists in formats of other tools, distinguished by contents and name."""

from __future__ import annotations

from datetime import datetime

from backend.axes.drive.drive import Drive
from backend.axes.parameters.csv_list import LeftOut, ParameterList, read_csv, write_csv
from backend.axes.parameters.dcf import read_dcf, write_dcf
from backend.axes.parameters.set_file import ParameterSet, dump
from drivers.link import Found
from drivers.texts.message import text
from profiles.importer import is_dcf, read_dcf_identity
from profiles.schema import Profile

#: Largest number of problems of a list in its notes; the API's answer has as many.
_NOTED = 200


def import_list(
    data: bytes, profile: Profile, name: str, saved: datetime
) -> tuple[bytes, ParameterList]:
    """The file of a parameter set made from a CSV list or a DCF, and the list as read.

    Raises:
        BadSet: not such a list, or nothing in it belongs to ``profile``.
    """
    # A list states no drive, so the set must not name one as its source.
    source = Drive("", f"list {name}", profile, [])
    if is_dcf(data):
        found = read_dcf(data, profile, name)
        vendor, product = read_dcf_identity(data, name)
        if vendor is not None:
            # So loading it warns at a drive of another kind, as for a set of servodeck.
            source.found = Found(0, vendor_id=vendor, product_code=product)
    else:
        found = read_csv(data, profile, name)
    # Texts are slow to make, and the notes hold only the first ones.
    problems = map(str, found.problems[:_NOTED])
    notes = "\n".join(("imported from a list", *problems))[:4000]
    return dump(source, found.readings, author="", notes=notes, saved=saved), found


def export_list(
    content: ParameterSet, profile: Profile, name: str, created: datetime
) -> tuple[bytes, tuple[LeftOut, ...]]:
    """A parameter set as DCF where ``name`` ends in .dcf, else as CSV with a byte order mark.

    With it the rows that are not in that file, each with its reason.
    """
    if not name.lower().endswith(".dcf"):
        bad = [row for row in content.rows if row.raw is None]
        no_value = text("sets.left-out-no-value")
        left_out = [LeftOut(row.key, row.problem or no_value) for row in bad]
        # Without the mark, spreadsheets read a file in their own code page.
        return write_csv(profile, content.rows).encode("utf-8-sig"), tuple(left_out)
    written, missing = write_dcf(
        profile, content.rows, file_name=name, node_name=content.drive_name, created=created
    )
    return written.encode("utf-8"), missing
