from __future__ import annotations

from collections.abc import Iterator

import pytest

from drivers.virtual.wires.netns import Namespace, unavailable


@pytest.fixture(scope="session")
def namespace() -> Iterator[Namespace]:
    reason = unavailable()
    if reason is not None:
        pytest.skip(reason)
    with Namespace.create() as made:
        yield made
