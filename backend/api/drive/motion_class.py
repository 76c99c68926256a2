"""Routes of the motion classes of objects: origin of a class, and changing it."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path

from backend.api.messages.errors import NotFound, message_or_none, words_of
from backend.api.requests.context import Me, TheBench, ThePeople
from backend.api.requests.named_profile import profile_named
from backend.api.security.gate import require_right
from backend.api.station.models_description import PROFILE_NAME, MotionClass, MotionClassRequest
from backend.foundation.people.rights import Right
from backend.records.audit.asked import note_before
from backend.station.bench import Bench
from drivers.errors import NotAllowed
from drivers.texts.message import profile_text, text
from drivers.texts.motion_classes import fixed_text, refusal_text
from profiles import load_profile
from profiles.motion.decisions import CannotClassify, classify, forget
from profiles.schema import Parameter, Profile

router = APIRouter()

ProfileName = Annotated[str, Path(pattern=PROFILE_NAME, description="name of the profile")]
Key = Annotated[str, Path(max_length=20, description="key of the object, for example 2005:01")]
_PATH = "/profiles/{profile}/parameters/{key}/motion"


def _known(profile: str, key: str) -> tuple[Profile, Parameter]:
    known = profile_named(profile)
    parameter = known.parameter(key)
    if parameter is None:
        raise NotFound("api-drive.no-parameter-see-list", parameter=key, known_title=known.title)
    return known, parameter


def _answer(profile: str, key: str) -> MotionClass:
    known, parameter = _known(profile, key)
    why = fixed_text(known, parameter)
    return MotionClass(
        motion=parameter.motion,
        safe_in_motion=parameter.safe_in_motion,
        origin=parameter.motion_origin,
        reason=parameter.motion_reason,
        changeable=why is None,
        fixed_why=words_of(why),
        fixed_why_message=message_or_none(why),
    )


@router.get(_PATH)
async def motion_class(profile: ProfileName, key: Key) -> MotionClass:
    """Read whether writing an object can cause motion, with origin and reason of that class."""
    return await asyncio.to_thread(_answer, profile, key)


@router.put(_PATH)
async def set_motion_class(
    bench: TheBench,
    people: ThePeople,
    me: Me,
    profile: ProfileName,
    key: Key,
    request: MotionClassRequest,
) -> MotionClass:
    """Set the motion class of an object of an imported profile, on one's own responsibility.

    A class other than ``energises`` also requires the right to move.
    """
    if request.motion != "energises":
        # It makes the object writable in the parameter table, so it requires
        # the right to move an axis.
        require_right(people, me, Right.MOTION, None)
    await asyncio.to_thread(_note, profile, key)
    try:
        parameter = await asyncio.to_thread(
            classify,
            profile,
            key,
            request.motion,
            reason=request.reason,
            safe_in_motion=request.safe_in_motion,
        )
    except CannotClassify as error:
        raise _refused(key, error) from error
    return await _changed(bench, profile, parameter)


@router.delete(_PATH)
async def forget_motion_class(bench: TheBench, profile: ProfileName, key: Key) -> MotionClass:
    """Remove a class that a person set: the object counts as energising again."""
    await asyncio.to_thread(_note, profile, key)
    try:
        parameter = await asyncio.to_thread(forget, profile, key)
    except CannotClassify as error:
        raise _refused(key, error) from error
    return await _changed(bench, profile, parameter)


def _note(profile: str, key: str) -> None:
    _, parameter = _known(profile, key)
    note_before(motion=parameter.motion, safe_in_motion=parameter.safe_in_motion)


def _refused(key: str, error: CannotClassify) -> NotAllowed:
    return NotAllowed(
        refusal_text(error),
        parameter=key,
        limit=text("limit.imported-objects"),
        remedy="api-drive.use-page-of-function",
    )


async def _changed(bench: Bench, profile: str, parameter: Parameter) -> MotionClass:
    """Apply the new class to the drives on the bench at once."""
    known = await asyncio.to_thread(load_profile, profile)
    for connected in bench.connected_drives.values():
        if connected.drive.profile.drive == profile:
            connected.drive.profile = known
    bench.journal.add(
        text(
            "journal.motion-class",
            title=known.title,
            key=parameter.key,
            name=profile_text(profile, parameter.name),
            motion=parameter.motion,
        )
    )
    return _answer(profile, parameter.key)
