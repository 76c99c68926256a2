"""Rights, and which role has which. A closed vocabulary: a route needs exactly one of these."""

from __future__ import annotations

from enum import StrEnum


class Right(StrEnum):
    """What somebody may do on this station."""

    LOOK = "look"
    """See states, values, files and people."""
    FILES = "files"
    """Store, change and delete sets, recordings, measurements and reports."""
    PARAMETERS = "parameters"
    """Write parameters of a drive."""
    MEASURE = "measure"
    """Measurements that move an axis, and what they suggest."""
    MOTION = "motion"
    """Move an axis, enable it, carry out procedures."""
    STATION = "station"
    """Buses, drives, profiles: what the station is made of."""
    INVITE = "invite"
    """Invite a guest, grant and withdraw control, hold the enabling button."""
    ADMINISTER = "administer"
    """People and settings; take control from somebody who does not give it."""


class Role(StrEnum):
    """What somebody is on this station."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ADMINISTRATOR = "administrator"
    GUEST = "guest"
    """Somebody far away, by invitation; has no account."""


_OPERATOR = frozenset(Right) - {Right.ADMINISTER}

#: A guest looks; more only by a grant of the person on site (see `backend.people.support`).
RIGHTS: dict[Role, frozenset[Right]] = {
    Role.VIEWER: frozenset({Right.LOOK}),
    Role.OPERATOR: _OPERATOR,
    Role.ADMINISTRATOR: frozenset(Right),
    Role.GUEST: frozenset({Right.LOOK}),
}

#: What an invitation may allow beyond looking.
GRANTABLE = frozenset({Right.PARAMETERS, Right.MEASURE, Right.MOTION})
#: Rights that move metal: a guest needs the enabling button for them.
MOVING = frozenset({Right.MEASURE, Right.MOTION})
#: Roles that an account may have.
ACCOUNT_ROLES = (Role.VIEWER, Role.OPERATOR, Role.ADMINISTRATOR)
