"""Remote support: invitations, guests, grants for minutes, and the enabling button on site.

Nothing here outlives the server: a restart ends every invitation. A guest looks; more only while
a grant of the person on site runs, and nothing that moves metal unless that person holds the
enabling button at that moment.
"""

from __future__ import annotations

import secrets
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from backend.people.credentials import checked_person, digest, new_secret, same_code, spoken_code
from backend.people.elapsed import elapsed_s
from backend.people.errors import Forbidden, NoSuchPerson, NotLoggedIn, TooOften
from backend.people.identity import Identity
from backend.people.rights import GRANTABLE, MOVING, RIGHTS, Right, Role
from backend.people.throttle import Throttle
from drivers.errors import NotAllowed
from drivers.texts import limits
from drivers.texts.message import Text, text

#: The enabling button counts as released this long after the last sign of life. With the 20 ms
#: between looks (`backend.api.live.watch`) a silent page stops the motion within 200 ms.
ENABLING_TIMEOUT_S = 0.17
LONGEST_INVITATION_S = 24 * 3600.0
LONGEST_GRANT_S = 8 * 3600.0
#: Wrong codes that end an invitation.
CODE_TRIES = 5
MOST_OPEN = 20
CHAT_KEPT = 200
CHAT_LENGTH = 500

State = Literal["open", "joined", "ended"]


@dataclass(frozen=True, slots=True)
class Grant:
    """What a guest may do beyond looking, until when (`elapsed_s`), and on which axis.

    ``drive`` None is every axis.
    """

    rights: frozenset[Right]
    until: float
    drive: str | None
    by: str


@dataclass(slots=True)
class Invitation:
    """One guest. ``expires`` by `elapsed_s`; ``allowed`` bounds what grants may give."""

    id: str
    guest: str
    allowed: frozenset[Right]
    by: str
    created: float
    expires: float
    code: str
    link: str
    """Hash of the secret in the link."""
    state: State = "open"
    session: str = ""
    """Hash of the guest's cookie, once joined."""
    grant: Grant | None = None
    tries: int = 0
    why_ended: Text | None = None


@dataclass(frozen=True, slots=True)
class Said:
    """A line of the chat; epoch seconds."""

    number: int
    time: float
    person: str
    guest: bool
    text: str


class Support:
    """Invitations of a station. ``ticks`` counts seconds that pass, whatever clocks are set to."""

    def __init__(self, ticks: Callable[[], float] = elapsed_s) -> None:
        self._ticks = ticks
        self._invitations: dict[str, Invitation] = {}
        self._throttle = Throttle(10, ticks)
        #: Invitation to the on-site connection that holds the button, and when it was last heard.
        self._holds: dict[str, tuple[str, float]] = {}
        self._chat: deque[Said] = deque(maxlen=CHAT_KEPT)
        self._said = 0
        #: Called after any change that a list of invitations shows.
        self.on_change: list[Callable[[], None]] = []
        #: Called with a guest's session when it is over, and when their grant or hold is.
        self.on_ended: list[Callable[[str], None]] = []
        self.on_disabled: list[Callable[[Invitation, Text], None]] = []

    # --- invitations ------------------------------------------------------------------

    def all(self) -> list[Invitation]:
        """Invitations of this session of the server, newest first."""
        return sorted(self._invitations.values(), key=lambda i: i.created, reverse=True)

    def find(self, invitation_id: str) -> Invitation:
        """The invitation of this id.

        Raises:
            NoSuchPerson: there is none.
        """
        found = self._invitations.get(invitation_id)
        if found is None:
            raise NoSuchPerson("people.no-invitation", value=invitation_id)
        return found

    def invite(
        self, by: str, guest: str, allowed: frozenset[Right], lifetime_s: float
    ) -> tuple[str, Invitation]:
        """A new invitation. Returns the secret of its link, which is not kept.

        Raises:
            NotAllowed: too long a life, something that no guest may do, or too many are open.
        """
        guest = checked_person(guest)
        if not 60.0 <= lifetime_s <= LONGEST_INVITATION_S:
            raise NotAllowed(
                "people.invitation-lasts-minute-day",
                value=lifetime_s,
                limit=limits.between(60, LONGEST_INVITATION_S, "s"),
            )
        if beyond := allowed - GRANTABLE:
            raise NotAllowed(
                "people.no-guest-may",
                limit=", ".join(sorted(GRANTABLE)),
                beyond=", ".join(sorted(beyond)),
            )
        if sum(i.state != "ended" for i in self._invitations.values()) >= MOST_OPEN:
            raise NotAllowed("people.invitations-open", most_open=MOST_OPEN)
        secret = new_secret()
        made = Invitation(
            id=secrets.token_hex(6),
            guest=guest,
            allowed=allowed,
            by=by,
            created=time.time(),
            expires=self._ticks() + lifetime_s,
            code=spoken_code(2),
            link=digest(secret),
        )
        self._invitations[made.id] = made
        self._drop_old()
        self._changed()
        return secret, made

    def join(self, link: str, code: str, address: str) -> tuple[str, Invitation]:
        """Come in by a link and its code. Returns the cookie and the invitation.

        Raises:
            NotLoggedIn: link or code is wrong, used or over. TooOften: too many tries.
        """
        wait = self._throttle.wait_s(address)
        if wait > 0:
            raise TooOften("people.too-many-wrong-tries", wait)
        self.tick()
        hashed = digest(link)
        found = next((i for i in self._invitations.values() if i.link == hashed), None)
        if found is None or found.state != "open":
            self._throttle.failed(address)
            raise NotLoggedIn("people.invitation-not-valid-used")
        if not same_code(code, found.code):
            self._throttle.failed(address)
            found.tries += 1
            if found.tries >= CODE_TRIES:
                self._end(found, text("people.end-too-many-codes"))
            raise NotLoggedIn("people.code-wrong-ask-person")
        secret = new_secret()
        found.state, found.session = "joined", digest(secret)
        self._changed()
        return secret, found

    def revoke(self, invitation_id: str, why: Text) -> Invitation:
        """End an invitation; its guest is out at once."""
        found = self.find(invitation_id)
        self._end(found, why)
        return found

    # --- guests -----------------------------------------------------------------------

    def guest(self, secret: str) -> Identity | None:
        """Who has this cookie, with the rights of this moment."""
        found = self.of_session(digest(secret))
        return None if found is None else self.identity(found)

    def of_session(self, session: str) -> Invitation | None:
        """The joined invitation of a guest's session, None once it is over."""
        return next(
            (
                i
                for i in self._invitations.values()
                if i.session == session and i.state == "joined" and self._ticks() < i.expires
            ),
            None,
        )

    def identity(self, found: Invitation) -> Identity:
        """A guest with the rights of this moment; without the button nothing that moves."""
        grant = self.running(found)
        rights = RIGHTS[Role.GUEST] | (grant.rights if grant is not None else frozenset())
        return Identity(f"{found.guest} (guest)", Role.GUEST, "guest", found.session, rights)

    def require(self, identity: Identity, right: Right, drive: str | None) -> None:
        """A guest may do this now: granted, for this axis, and the button held if it moves.

        Raises:
            Forbidden: says what is missing.
        """
        found = self.of_session(identity.session)
        grant = None if found is None else self.running(found)
        if found is None or grant is None or right not in grant.rights:
            raise Forbidden("people.guest-may-not-without", drive=drive, right=right)
        if grant.drive is not None and drive != grant.drive:
            raise Forbidden("people.grant-another-axis", drive=drive)
        if right in MOVING and not self.enabled(found.id):
            raise Forbidden("people.person-site-not-hold", drive=drive)

    # --- grants -----------------------------------------------------------------------

    def grant(
        self,
        invitation_id: str,
        by: str,
        rights: frozenset[Right],
        time_s: float,
        drive: str | None,
    ) -> Invitation:
        """Let a guest do more for a while; replaces an earlier grant.

        One that lacks a right to move or the axis of the earlier one ends what the guest moves.

        Raises:
            NotAllowed: the guest is not here, or the invitation does not allow it.
        """
        found = self.find(invitation_id)
        if found.state != "joined":
            raise NotAllowed("people.not", guest=found.guest)
        if beyond := rights - found.allowed:
            raise NotAllowed(
                "people.invitation-not-allow",
                limit=", ".join(sorted(found.allowed)) or text("limit.look-only"),
                beyond=", ".join(sorted(beyond)),
            )
        if not rights or not 10.0 <= time_s <= LONGEST_GRANT_S:
            raise NotAllowed(
                "people.grant-names-right-lasts",
                value=time_s,
                limit=limits.between(10, LONGEST_GRANT_S, "s"),
            )
        before = self.running(found)
        found.grant = Grant(rights, self._ticks() + time_s, drive, by)
        if before is not None and (
            before.rights & MOVING - rights or drive not in (None, before.drive)
        ):
            # What moves now may be what the new grant does not contain.
            why = text("people.end-grant-replaced")
            if found.id in self._holds:
                self._drop_hold(found.id, why)
            else:
                self._disable(found, why)
        self._changed()
        return found

    def withdraw(self, invitation_id: str, why: Text) -> Invitation:
        """End a grant; what the guest moves is stopped."""
        found = self.find(invitation_id)
        if found.grant is not None:
            found.grant = None
            self._disable(found, why)
            self._changed()
        return found

    def running(self, found: Invitation) -> Grant | None:
        """The grant of this moment, or None."""
        grant = found.grant
        return grant if grant is not None and self._ticks() < grant.until else None

    # --- the enabling button ----------------------------------------------------------

    def press(self, invitation_id: str, connection: str) -> None:
        """The person on site presses the button for this guest.

        Raises:
            NotAllowed: no grant runs that moves something.
        """
        found = self.find(invitation_id)
        grant = self.running(found)
        if grant is None or not grant.rights & MOVING:
            raise NotAllowed("people.no-grant-move-anything", guest=found.guest)
        self._holds[invitation_id] = (connection, self._ticks())
        self._changed()

    def renew(self, invitation_id: str, connection: str) -> None:
        """The button is still held. What has expired is not revived."""
        hold = self._holds.get(invitation_id)
        if hold is not None and hold[0] == connection and self.enabled(invitation_id):
            self._holds[invitation_id] = (connection, self._ticks())

    def release(self, invitation_id: str, connection: str, why: Text) -> None:
        """The button was let go, or what amounts to it."""
        hold = self._holds.get(invitation_id)
        if hold is not None and hold[0] == connection:
            self._drop_hold(invitation_id, why)

    def release_all(self, connection: str, why: Text) -> None:
        """The on-site page is gone."""
        for invitation_id, (holder, _) in list(self._holds.items()):
            if holder == connection:
                self._drop_hold(invitation_id, why)

    def enabled(self, invitation_id: str) -> bool:
        """Whether the button is held at this moment."""
        hold = self._holds.get(invitation_id)
        return hold is not None and self._ticks() - hold[1] <= ENABLING_TIMEOUT_S

    @property
    def any_hold(self) -> bool:
        """Whether a button is held, so that somebody must watch it."""
        return bool(self._holds)

    def watch(self) -> None:
        """Every 20 ms while a button is held: notice that its page has fallen silent."""
        for invitation_id in list(self._holds):
            if not self.enabled(invitation_id):
                self._drop_hold(invitation_id, text("people.end-site-silent"))

    def _drop_hold(self, invitation_id: str, why: Text) -> None:
        if self._holds.pop(invitation_id, None) is not None:
            self._disable(self._invitations[invitation_id], why)
            self._changed()

    # --- chat -------------------------------------------------------------------------

    def say(self, identity: Identity, text: str) -> Said:
        """A line for everybody on the station.

        Raises:
            NotAllowed: nothing, or too long.
        """
        text = text.strip()
        if not 1 <= len(text) <= CHAT_LENGTH:
            raise NotAllowed("people.line-500-signs", limit=limits.signs(CHAT_LENGTH))
        self._said += 1
        said = Said(self._said, time.time(), identity.person, identity.is_guest, text)
        self._chat.append(said)
        return said

    def chat(self) -> list[Said]:
        """The last lines, oldest first."""
        return list(self._chat)

    # --- what ends by itself ----------------------------------------------------------

    def tick(self) -> None:
        """Let invitations and grants end whose time has come."""
        now = self._ticks()
        for found in list(self._invitations.values()):
            if found.state != "ended" and now >= found.expires:
                self._end(found, text("people.end-expired"))
            elif found.grant is not None and now >= found.grant.until:
                self.withdraw(found.id, text("people.end-grant-expired"))

    def _end(self, found: Invitation, why: Text) -> None:
        if found.state == "ended":
            return
        session, found.state, found.why_ended, found.grant = found.session, "ended", why, None
        if self._holds.pop(found.id, None) is not None or session:
            self._disable(found, why)
        if session:
            for listener in self.on_ended:
                listener(session)
        self._changed()

    def _disable(self, found: Invitation, why: Text) -> None:
        for listener in self.on_disabled:
            listener(found, why)

    def _drop_old(self) -> None:
        ended = [i for i in self.all() if i.state == "ended"]
        for old in ended[50:]:
            del self._invitations[old.id]

    def _changed(self) -> None:
        for listener in self.on_change:
            listener()
