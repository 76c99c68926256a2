"""The profile that a request names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from backend.api.messages.errors import NotFound
from drivers.texts.profile_errors import profile_error_text
from profiles import load_profile
from profiles.loader import ProfileError
from profiles.schema import Profile


@contextmanager
def profile_files(name: str) -> Iterator[None]:
    """Turn errors of a profile's files into the answer 404.

    Raises:
        NotFound: there is no such profile, or it cannot be used; states the reason.
    """
    try:
        yield
    except ProfileError as error:
        raise NotFound(
            profile_error_text(error), value=name, remedy="api-station.see-profiles"
        ) from error


def profile_named(name: str) -> Profile:
    """Load the profile.

    Raises:
        NotFound: there is no such profile, or it cannot be used; states the reason.
    """
    with profile_files(name):
        return load_profile(name)
