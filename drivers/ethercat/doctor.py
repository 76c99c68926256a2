"""Convert what the host process read from a station to evidence for the doctor."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.doctor.evidence import Counters, Evidence, SyncManagerState
from drivers.errors import DriveError, LinkTimeout, Rejected
from drivers.ethercat.exchange.bring_up import BEFORE_MAPPING, BEFORE_OP, withheld
from drivers.ethercat.process.protocol import Message
from profiles.schema import Profile


def evidence_of(
    facts: Message, profile: Profile | None, refusal: DriveError | None, aliases: Sequence[int]
) -> Evidence:
    """Combine the facts from the host process with those from the profile and the refusal."""
    given = dict(facts)
    given["managers"] = tuple(
        SyncManagerState(number, start, length, control, bool(enabled), expected)
        for number, start, length, control, enabled, expected in facts.get("managers", ())
    )
    given["assigned"] = tuple(facts.get("assigned", ()))
    given["sm_counters"] = Counters(*facts.get("sm_counters", ()))
    given["aliases"] = tuple(aliases)
    given["timed_out"] = isinstance(refusal, LinkTimeout)
    if refusal is not None and refusal.parameter is not None:
        given["refused_key"] = refusal.parameter
        given["refused_code"] = refusal.abort_code if isinstance(refusal, Rejected) else None
        given["from_file"] = _is_init_command(profile, refusal.parameter)
    if profile is not None:
        given["known_vendor"] = profile.identity.vendor_id
        given["known_product"] = profile.identity.product_code
        given["known_revision"] = profile.identity.revision
        sets = profile.pdo.sets if profile.pdo is not None else ()
        given["mandatory"] = tuple(each.index for each in sets if each.mandatory)
    return Evidence(**given)


def _is_init_command(profile: Profile | None, key: str) -> bool:
    rules = profile.bring_up if profile is not None else None
    commands = rules.init_commands if rules is not None else ()
    return any(
        key == f"{each.index:04X}:{each.subindex:02X}"
        and each.transition in (*BEFORE_MAPPING, *BEFORE_OP)
        and not withheld(each)
        for each in commands
    )
