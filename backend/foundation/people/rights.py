"""Rights, and the rights of each role. The set is closed: every route needs exactly one right."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum

from drivers.texts.message import Text, joined, text


class Right(StrEnum):
    """A permission on this station."""

    LOOK = "look"
    """See states, values, files and people."""
    FILES = "files"
    """Store, change and delete sets, recordings, measurements and reports."""
    PARAMETERS = "parameters"
    """Write parameters of a drive."""
    MEASURE = "measure"
    """Measure with motion of an axis, and apply the results that are suggested."""
    MOTION = "motion"
    """Move an axis, enable it, carry out procedures."""
    STATION = "station"
    """Change buses, drives and profiles of the station."""
    INVITE = "invite"
    """Invite a guest, give and withdraw grants, hold the enabling button."""
    ADMINISTER = "administer"
    """Manage people and settings; take control from a holder who does not give it."""


class Role(StrEnum):
    """Role of a person on this station."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ADMINISTRATOR = "administrator"
    GUEST = "guest"
    """A remote person, by invitation; has no account."""


_OPERATOR = frozenset(Right) - {Right.ADMINISTER}

#: A guest may look; more only by a grant of the person on site (see `support`).
RIGHTS: dict[Role, frozenset[Right]] = {
    Role.VIEWER: frozenset({Right.LOOK}),
    Role.OPERATOR: _OPERATOR,
    Role.ADMINISTRATOR: frozenset(Right),
    Role.GUEST: frozenset({Right.LOOK}),
}

#: Rights that an invitation may allow beyond looking.
GRANTABLE = frozenset({Right.PARAMETERS, Right.MEASURE, Right.MOTION})
#: Rights to move axes: a guest needs the enabling button for them.
MOVING = frozenset({Right.MEASURE, Right.MOTION})
#: Roles that an account may have.
ACCOUNT_ROLES = (Role.VIEWER, Role.OPERATOR, Role.ADMINISTRATOR)

_ROLE_NAMES: Mapping[Role, Text] = {
    Role.VIEWER: text("people.role-viewer"),
    Role.OPERATOR: text("people.role-operator"),
    Role.ADMINISTRATOR: text("people.role-administrator"),
    Role.GUEST: text("people.role-guest"),
}
_RIGHT_NAMES: Mapping[Right, Text] = {
    Right.LOOK: text("people.right-look"),
    Right.FILES: text("people.right-files"),
    Right.PARAMETERS: text("people.right-parameters"),
    Right.MEASURE: text("people.right-measure"),
    Right.MOTION: text("people.right-motion"),
    Right.STATION: text("people.right-station"),
    Right.INVITE: text("people.right-invite"),
    Right.ADMINISTER: text("people.right-administer"),
}


def role_text(role: Role) -> Text:
    """Return the name of a role."""
    return _ROLE_NAMES[role]


def right_text(right: Right) -> Text:
    """Return the name of a right."""
    return _RIGHT_NAMES[right]


def rights_text(rights: Iterable[Right]) -> Text:
    """Return the names of several rights."""
    return joined((right_text(each) for each in sorted(rights)), ", ")
