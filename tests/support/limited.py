"""A program with some capabilities and no others, as systemd and container engines start it."""

from __future__ import annotations

from collections.abc import Sequence


def only_with(
    capabilities: Sequence[str], program: Sequence[str], user: Sequence[str] = ()
) -> list[str]:
    """The command line with these capabilities (``CAP_…``) alone; being root gives no others.

    ``user``: options of setpriv (util-linux) that name another user.
    """
    only = ",".join(["-all", *(f"+{name.removeprefix('CAP_').lower()}" for name in capabilities)])
    return [
        "setpriv", *user, "--securebits", "+noroot,+noroot_locked", f"--inh-caps={only}",
        f"--ambient-caps={only}", f"--bounding-set={only}", "--no-new-privs", *program,
    ]  # fmt: skip
