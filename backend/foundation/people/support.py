"""Remote support: invitations, guests, temporary grants, and the enabling button on site.

Nothing here is stored: a restart of the server ends every invitation. A guest may look;
more only during a grant of the person on site, and moving an axis only while that person
holds the enabling button.
"""

from __future__ import annotations

import secrets
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from backend.foundation.people.elapsed import elapsed_s
from backend.foundation.people.errors import Forbidden, NoSuchPerson, NotLoggedIn, TooOften
from backend.foundation.people.identity import Identity
from backend.foundation.people.login.credentials import (
    checked_person,
    digest,
    new_secret,
    same_code,
    spoken_code,
)
from backend.foundation.people.login.throttle import Throttle
from backend.foundation.people.rights import (
    GRANTABLE,
    MOVING,
    RIGHTS,
    Right,
    Role,
    right_text,
    rights_text,
)
from drivers.errors import NotAllowed
from drivers.texts import limits
from drivers.texts.message import Text, text

#: The enabling button counts as released this long [s] after the last message. With the 20 ms
#: between checks (`backend.api.live.watch`) a silent page stops the motion within 200 ms.
ENABLING_TIMEOUT_S = 0.17
LONGEST_INVITATION_S = 24 * 3600.0
LONGEST_GRANT_S = 8 * 3600.0
#: Number of wrong codes after which an invitation ends.
CODE_TRIES = 5
MOST_OPEN = 20
CHAT_KEPT = 200
CHAT_LENGTH = 500

State = Literal["open", "joined", "ended"]


@dataclass(frozen=True, slots=True)
class Grant:
    """Rights of a guest beyond looking, until when (`elapsed_s`), and on which axis.

    ``drive`` None stands for every axis.
    """

    rights: frozenset[Right]
    until: float
    drive: str | None
    by: str


@dataclass(slots=True)
class Invitation:
    """Invitation of one guest. ``expires`` (`elapsed_s`); ``allowed`` are the grantable rights."""

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
    """A line of the chat; ``time`` in epoch seconds."""

    number: int
    time: float
    person: str
    guest: bool
    text: str


class Support:
    """Invitations of a station. ``ticks`` returns monotonic seconds, not the wall clock."""

    def __init__(self, ticks: Callable[[], float] = elapsed_s) -> None:
        self._ticks = ticks
        self._invitations: dict[str, Invitation] = {}
        self._throttle = Throttle(10, ticks)
        #: By invitation: the on-site connection that holds the button, and
        #: time of its last message.
        self._holds: dict[str, tuple[str, float]] = {}
        self._chat: deque[Said] = deque(maxlen=CHAT_KEPT)
        self._said = 0
        #: Called after any change that is shown in a list of invitations.
        self.on_change: list[Callable[[], None]] = []
        #: Called with the id of a guest's session that has ended; the next one with an invitation
        #: whose grant or button hold has ended.
        self.on_ended: list[Callable[[str], None]] = []
        self.on_disabled: list[Callable[[Invitation, Text], None]] = []

    # --- invitations ------------------------------------------------------------------

    def all(self) -> list[Invitation]:
        """Invitations since the start of the server, newest first."""
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
        """Make an invitation. Returns the secret of its link (not stored) and the invitation.

        Raises:
            NotAllowed: the lifetime is out of range, a right is not permitted for guests, or too
            many invitations are open.
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
                limit=rights_text(GRANTABLE),
                beyond=rights_text(beyond),
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
        """Join by a link and its code. Returns the cookie and the invitation.

        Raises:
            NotLoggedIn: the link or the code is wrong, used or expired.
            TooOften: too many tries.
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
        """End an invitation and, at once, its guest's session."""
        found = self.find(invitation_id)
        self._end(found, why)
        return found

    # --- guests -----------------------------------------------------------------------

    def guest(self, secret: str) -> Identity | None:
        """Identity of a guest's cookie, with current rights; None if it is not valid."""
        found = self.of_session(digest(secret))
        return None if found is None else self.identity(found)

    def of_session(self, session: str) -> Invitation | None:
        """The joined invitation of a guest's session; None once it has ended."""
        return next(
            (
                i
                for i in self._invitations.values()
                if i.session == session and i.state == "joined" and self._ticks() < i.expires
            ),
            None,
        )

    def identity(self, found: Invitation) -> Identity:
        """Identity of a guest with the rights of the running grant; `require` checks the button."""
        grant = self.running(found)
        rights = RIGHTS[Role.GUEST] | (grant.rights if grant is not None else frozenset())
        return Identity(f"{found.guest} (guest)", Role.GUEST, "guest", found.session, rights)

    def require(self, identity: Identity, right: Right, drive: str | None) -> None:
        """Check that a guest may do this now: granted, for this axis, button held if it moves.

        Raises:
            Forbidden: states what is missing.
        """
        found = self.of_session(identity.session)
        grant = None if found is None else self.running(found)
        if found is None or grant is None or right not in grant.rights:
            raise Forbidden("people.guest-may-not-without", drive=drive, right=right_text(right))
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
        """Give a guest more rights for a time [s]; replaces an earlier grant.

        The guest's motion is stopped if the new grant lacks a right to move or the
        axis of the earlier one.

        Raises:
            NotAllowed: the guest has not joined, the invitation does not allow a right, no right is
            named, or the time is out of range.
        """
        found = self.find(invitation_id)
        if found.state != "joined":
            raise NotAllowed("people.not", guest=found.guest)
        if beyond := rights - found.allowed:
            raise NotAllowed(
                "people.invitation-not-allow",
                limit=rights_text(found.allowed) if found.allowed else text("limit.look-only"),
                beyond=rights_text(beyond),
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
            # The motion that runs now may not be covered by the new grant.
            why = text("people.end-grant-replaced")
            if found.id in self._holds:
                self._drop_hold(found.id, why)
            else:
                self._disable(found, why)
        self._changed()
        return found

    def withdraw(self, invitation_id: str, why: Text) -> Invitation:
        """End a grant and stop the guest's motion."""
        found = self.find(invitation_id)
        if found.grant is not None:
            found.grant = None
            self._disable(found, why)
            self._changed()
        return found

    def running(self, found: Invitation) -> Grant | None:
        """The grant in force at this moment, or None."""
        grant = found.grant
        return grant if grant is not None and self._ticks() < grant.until else None

    # --- the enabling button ----------------------------------------------------------

    def press(self, invitation_id: str, connection: str) -> None:
        """Press the enabling button on site for this guest.

        Raises:
            NotAllowed: no grant with a right to move is in force.
        """
        found = self.find(invitation_id)
        grant = self.running(found)
        if grant is None or not grant.rights & MOVING:
            raise NotAllowed("people.no-grant-move-anything", guest=found.guest)
        self._holds[invitation_id] = (connection, self._ticks())
        self._changed()

    def renew(self, invitation_id: str, connection: str) -> None:
        """Renew the hold of the button. One that has timed out is not revived."""
        hold = self._holds.get(invitation_id)
        if hold is not None and hold[0] == connection and self.enabled(invitation_id):
            self._holds[invitation_id] = (connection, self._ticks())

    def release(self, invitation_id: str, connection: str, why: Text) -> None:
        """Release the button: it was let go, or another event counts as that."""
        hold = self._holds.get(invitation_id)
        if hold is not None and hold[0] == connection:
            self._drop_hold(invitation_id, why)

    def release_all(self, connection: str, why: Text) -> None:
        """Release the buttons of an on-site page that is gone."""
        for invitation_id, (holder, _) in list(self._holds.items()):
            if holder == connection:
                self._drop_hold(invitation_id, why)

    def enabled(self, invitation_id: str) -> bool:
        """Whether the button is held at this moment."""
        hold = self._holds.get(invitation_id)
        return hold is not None and self._ticks() - hold[1] <= ENABLING_TIMEOUT_S

    @property
    def any_hold(self) -> bool:
        """Whether any button is held, so that `watch` must run."""
        return bool(self._holds)

    def watch(self) -> None:
        """Release buttons whose pages have gone silent; called every 20 ms while one is held."""
        for invitation_id in list(self._holds):
            if not self.enabled(invitation_id):
                self._drop_hold(invitation_id, text("people.end-site-silent"))

    def _drop_hold(self, invitation_id: str, why: Text) -> None:
        if self._holds.pop(invitation_id, None) is not None:
            self._disable(self._invitations[invitation_id], why)
            self._changed()

    # --- chat -------------------------------------------------------------------------

    def say(self, identity: Identity, text: str) -> Said:
        """Add a line to the chat that everybody on the station can read.

        Raises:
            NotAllowed: the line is empty or too long.
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
        """End invitations and grants whose time is over."""
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
