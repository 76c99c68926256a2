"""Rights that the messages of the live websocket need. A message that is not listed is refused."""

from __future__ import annotations

from typing import Literal

from backend.api.live import messages as live
from backend.api.live import people_messages as people_live
from backend.api.live.control import require_control
from backend.api.messages.models import Message
from backend.api.security.gate import require_right
from backend.foundation.people.errors import Forbidden
from backend.foundation.people.identity import Identity
from backend.foundation.people.rights import Right
from backend.foundation.people.station import People

#: ``always``: everybody with a connection, including viewers and just after the session has ended.
#: ``control``: everybody who may control this axis now.
MessageNeed = Right | Literal["always", "control"]

MESSAGES: dict[type[Message], MessageNeed] = {
    live.StopAll: "always",
    live.JogStop: "always",
    live.Ping: "always",
    live.WatchState: Right.LOOK,
    live.WatchValues: Right.LOOK,
    live.ScopeStart: Right.LOOK,
    live.ScopeStop: Right.LOOK,
    # Only continues what `JogStart` of the same connection was allowed to begin.
    live.JogRenew: Right.LOOK,
    live.JogStart: Right.MOTION,
    live.LeaseTake: "control",
    people_live.LeaseAsk: "control",
    people_live.LeaseOverride: "control",
    # The leases themselves check that the sender is the holder.
    people_live.LeaseAnswer: Right.LOOK,
    people_live.LeaseHand: Right.LOOK,
    people_live.Where: Right.LOOK,
    people_live.Pointer: Right.LOOK,
    people_live.PlotCursor: Right.LOOK,
    people_live.Chat: Right.LOOK,
    people_live.EnablePress: Right.INVITE,
    people_live.EnableRenew: Right.INVITE,
    people_live.EnableRelease: "always",
}


def require_message(people: People, identity: Identity, message: Message) -> None:
    """Check that this person may send this message now.

    Raises:
        Forbidden: they may not, and why.
    """
    need = MESSAGES.get(type(message))
    if need is None:
        raise Forbidden("api-security.nobody-may-send", name=type(message).__name__)
    if need == "always":
        return
    named = getattr(message, "drive", None)
    drive = named if isinstance(named, str) else None
    if need == "control":
        if isinstance(message, live.LeaseTake) and not message.take:
            return
        require_control(people, identity, drive or "")
    else:
        require_right(people, identity, need, drive)
