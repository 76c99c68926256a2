"""``servodeck people …``: accounts from the machine's terminal, also when all are locked out."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from datetime import timedelta
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.base.printing import print_text
from backend.commands.base.session import run
from backend.commands.base.state import state_folder
from backend.foundation.people.accounts import Accounts
from backend.foundation.people.records import Account
from backend.foundation.people.rights import Right, Role, role_text
from backend.foundation.people.station import People
from drivers.errors import NotAllowed

app = typer.Typer(help="Accounts of this station.", no_args_is_help=True)

Config = Annotated[Path | None, typer.Option(help="folder of drives and parameter sets")]
Name = Annotated[str, typer.Argument(help="name of the account")]
NewPassword = Annotated[
    str,
    typer.Option(
        prompt=True,
        hide_input=True,
        confirmation_prompt=True,
        envvar="SERVODECK_PASSWORD",
        help="asked for where it is not given",
    ),
]


def _with(config: Path | None, work: Callable[[Accounts], Awaitable[None]]) -> None:
    async def doing() -> None:
        people = People(state_folder(config), accounts_needed=True)
        try:
            # Whoever has access to the computer's terminal may deliberately set up accounts again.
            await people.open(recovering=True)
            await work(people.accounts)
            await people.mark()
        finally:
            people.close()

    run(doing)


def _find(accounts: Accounts, name: str) -> Account:
    found = accounts.directory.find(name)
    if found is None:
        known = ", ".join(a.name for a in accounts.directory.all())
        raise NotAllowed("command.no-account", limit=known, name=name)
    return found


@app.command("list")
def list_accounts(config: Config = None) -> None:
    """Who may log in."""

    async def work(accounts: Accounts) -> None:
        for each in accounts.directory.all():
            here = len(accounts.directory.sessions(each.id))
            print_text("printed.account", name=each.name, role=role_text(each.role), sessions=here)

    _with(config, work)


@app.command()
def add(
    name: Name,
    password: NewPassword,
    role: Annotated[Role, typer.Option()] = Role.OPERATOR,
    config: Config = None,
) -> None:
    """Make an account."""

    async def work(accounts: Accounts) -> None:
        made = await accounts.add(name, password, role)
        print_text("printed.account-made", name=made.name, role=role_text(made.role))

    _with(config, work)


@app.command("password")
def set_password(name: Name, password: NewPassword, config: Config = None) -> None:
    """Set a new password; the account's sessions end within seconds."""

    async def work(accounts: Accounts) -> None:
        await accounts.set_password(_find(accounts, name).id, password)
        print_text("printed.password-set")

    _with(config, work)


@app.command("role")
def set_role(name: Name, role: Role, config: Config = None) -> None:
    """Change a role."""

    async def work(accounts: Accounts) -> None:
        await accounts.set_role(_find(accounts, name).id, role)
        print_text("printed.account-role", name=name, role=role_text(role))

    _with(config, work)


@app.command()
def remove(name: Name, config: Config = None) -> None:
    """Delete an account with its sessions and tokens."""

    async def work(accounts: Accounts) -> None:
        await accounts.remove(_find(accounts, name).id)
        print_text("printed.account-removed", name=name)

    _with(config, work)


@app.command()
def token(
    name: Name,
    purpose: Annotated[str, typer.Option(help="what the token is for")],
    scope: Annotated[list[Right], typer.Option(help="what it may do; repeat for several")],
    days: Annotated[float, typer.Option(min=0.01, max=366)] = 30,
    config: Config = None,
) -> None:
    """Make a token for a script; it is printed this once."""

    async def work(accounts: Accounts) -> None:
        secret, _ = await accounts.make_token(
            _find(accounts, name).id, purpose, frozenset(scope), timedelta(days=days)
        )
        print(secret)

    _with(config, work)
