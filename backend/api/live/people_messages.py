"""Messages of the websocket about people: control, guests, pointers and chat."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from backend.api.messages.models import Message
from backend.foundation.people.rights import Right, Role
from backend.tools.moving.jog.release import ReleaseOfPage
from backend.tools.wire_message import MessageInfo

Name = Annotated[str, Field(max_length=100)]
#: Position on a page: 0 at the left and top, 1 at the right and bottom of its content.
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
#: Plots on which cursors are shared. A closed list: other pages keep one position for each of them.
PlotName = Literal[
    "scope", "spectrum", "response", "prediction", "step", "predicted_step", "excitation"
]

# --- page to server -----------------------------------------------------------------


class LeaseAsk(Message):
    """Ask the holder for control of an axis; a free one is taken at once."""

    type: Literal["lease_ask"] = "lease_ask"
    drive: Name


class LeaseAnswer(Message):
    """The holder's answer to a request for control."""

    type: Literal["lease_answer"] = "lease_answer"
    drive: Name
    give: bool


class LeaseHand(Message):
    """Hand control to another connection, permanently or for a time, after which it returns."""

    type: Literal["lease_hand"] = "lease_hand"
    drive: Name
    to: Name
    time_s: float | None = Field(default=None, ge=1, le=28800, allow_inf_nan=False)


class LeaseOverride(Message):
    """Take control from its holder; running motion is stopped first. For administrators.

    Control held by a guest can be taken by everybody who may invite.
    """

    type: Literal["lease_override"] = "lease_override"
    drive: Name


class Where(Message):
    """The page that this person views, as in the address after the #."""

    type: Literal["where"] = "where"
    page: str = Field(max_length=200)


class Pointer(Message):
    """Position at which this person points on their page; null if they do not point."""

    type: Literal["pointer"] = "pointer"
    x: Share | None
    y: Share | None


class PlotCursor(Message):
    """Position at which this person points on a plot; null if they do not point.

    On the scope, its spectrogram and its X-Y plot ``x`` is the time of the samples (``t0_s``),
    which is the same on every page regardless of its zero and range; elsewhere it is the frequency
    [Hz] or the time [s]. ``y`` is the frequency [Hz] on the spectrogram, otherwise null.
    """

    type: Literal["plot_cursor"] = "plot_cursor"
    plot: PlotName
    x: float | None = Field(allow_inf_nan=False)
    y: float | None = Field(default=None, allow_inf_nan=False)


class Chat(Message):
    """A chat line for everybody on the station."""

    type: Literal["chat"] = "chat"
    text: str = Field(min_length=1, max_length=500)


class EnablePress(Message):
    """The person on site presses the enabling button for a guest."""

    type: Literal["enable_press"] = "enable_press"
    invitation: Name


class EnableRenew(Message):
    """The enabling button is still held. Send at 20 Hz or faster."""

    type: Literal["enable_renew"] = "enable_renew"
    invitation: Name


class EnableRelease(Message):
    """The enabling button was released."""

    type: Literal["enable_release"] = "enable_release"
    invitation: Name
    reason: ReleaseOfPage = "released"


PeopleRequest = (
    LeaseAsk
    | LeaseAnswer
    | LeaseHand
    | LeaseOverride
    | Where
    | Pointer
    | PlotCursor
    | Chat
    | EnablePress
    | EnableRenew
    | EnableRelease
)

# --- server to page -----------------------------------------------------------------


class PersonHere(Message):
    """A person whose page is open. ``holds`` are the axes that they control."""

    connection: str
    person: str
    role: Role
    page: str
    since: datetime
    holds: list[str]
    me: bool


class GrantView(Message):
    """Rights of a guest, until when, and on which axis (null: on all)."""

    rights: list[Right]
    until: datetime
    drive: str | None
    by: str


class InvitationView(Message):
    """An invitation. ``code`` is for people who may invite; ``enabled``: the button is held."""

    id: str
    guest: str
    allowed: list[Right]
    by: str
    created: datetime
    expires: datetime
    state: Literal["open", "joined", "ended"]
    why_ended: str = Field(description="empty while it has not ended")
    why_ended_message: MessageInfo | None = Field(
        default=None, description="of why_ended, as code and facts"
    )
    grant: GrantView | None
    enabled: bool
    code: str | None
    mine: bool


class PeopleHere(Message):
    """People who are connected, and invitations. ``rights`` are those of this connection now."""

    type: Literal["people"] = "people"
    people: list[PersonHere]
    invitations: list[InvitationView]
    rights: list[Right]


class LeaseNotice(Message):
    """Notice about control for the person of this connection."""

    type: Literal["lease_notice"] = "lease_notice"
    drive: str
    kind: Literal["asked", "refused", "given", "overridden", "returned", "expired", "lost"]
    person: str


class PointerMoved(Message):
    """Pointer of another person."""

    type: Literal["pointer_moved"] = "pointer_moved"
    connection: str
    person: str
    page: str
    x: float | None
    y: float | None


class CursorMoved(Message):
    """Cursor of another person on a plot."""

    type: Literal["cursor_moved"] = "cursor_moved"
    connection: str
    person: str
    plot: PlotName
    x: float | None
    y: float | None = None


class ChatLine(Message):
    """A line of the chat."""

    type: Literal["chat_said"] = "chat_said"
    number: int
    time: datetime
    person: str
    guest: bool
    text: str


PeopleNews = PeopleHere | LeaseNotice | PointerMoved | CursorMoved | ChatLine
