"""Whoever guesses is slowed; whoever knows the password gets in meanwhile."""

from __future__ import annotations

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.api.admission.requests import (
    MOST_FIRST_OF_PLACES,
    MOST_OF_PLACE,
    MOST_OF_STRANGERS,
    Admission,
)
from backend.foundation.people.errors import NotLoggedIn, TooOften
from backend.foundation.people.login.budgets import CROWDED, FREE, LoginBudgets, address_group
from backend.foundation.people.login.credentials import name_key
from backend.foundation.people.login.devices import KnownDevices
from backend.foundation.people.login.turns import MOST_OF_PLACE as MOST_WAITING
from backend.foundation.people.login.turns import MOST_PLACES, HashTurns
from backend.foundation.people.rights import Role
from tests.support.guarded import NAMES, PASSWORD, Caller, GuardedServer
from tests.support.station import NO_CERTIFICATES, until

# --- names ----------------------------------------------------------------------------

SPELLINGS = ["vw", "vw ", " vw", "\tvw\n", "vw\u00a0", "\u3000vw", "VW", "\uff56\uff57", "Vw\u2003"]
# Signs that show nothing: zero width, soft hyphen, filler, variation selector, tag.
SPELLINGS += ["v\u200bw", "\ufeffvw", "v\u00adw", "vw\u3164", "vw\ufe0f", "v\U000e0061w"]


@pytest.mark.parametrize("spelling", SPELLINGS, ids=ascii)
def test_one_name_however_it_is_spelled(spelling: str) -> None:
    assert name_key(spelling) == "vw"


@given(st.text(max_size=40))
def test_a_key_is_its_own_key(name: str) -> None:
    assert name_key(name_key(name)) == name_key(name)


@pytest.mark.long
def test_padding_a_locked_name_gives_no_further_guess(server: GuardedServer) -> None:
    """28 ways to write a locked name were 27 more guesses: found by one key, counted by another."""
    server.run(server.people.accounts.add("vw", PASSWORD, Role.VIEWER))
    # The waits begin with 2 s: on a slow computer one would end in between.
    now = time.monotonic()
    server.people.accounts._budgets._pairs._clock = lambda: now
    for _ in range(FREE):
        assert guess(server, "vw") == 401
    pads = [" " * n for n in range(1, 15)] + ["\u00a0" * n for n in range(1, 14)]
    answers = [guess(server, spelling) for spelling in (*SPELLINGS, *("vw" + pad for pad in pads))]
    refused = [status for status in answers if status in (422, 429)]
    assert len(answers) == len(refused), answers


def guess(server: GuardedServer, name: str, password: str = "a wrong password") -> int:
    return httpx.post(
        f"{server.url}/api/v1/session",
        json={"name": name, "password": password},
        timeout=60,
        verify=NO_CERTIFICATES,
    ).status_code


# --- budgets --------------------------------------------------------------------------


def test_others_wrong_tries_do_not_keep_out_who_types_it_right() -> None:
    budgets = LoginBudgets()
    for host in range(200):
        for _ in range(10):
            address = f"192.0.2.{host}"
            try:
                budgets.require("anna", address)
            except TooOften:
                break
            budgets.tried("anna", address)
    budgets.require("anna", "198.51.100.7")
    budgets.tried("anna", "198.51.100.7")
    with pytest.raises(TooOften):
        budgets.require("anna", "198.51.100.7")


def test_a_crowd_gets_one_try_each() -> None:
    """What many addresses together may guess stays small: one each, then waits that double."""
    budgets = LoginBudgets()
    tries = 0
    for host in range(100):
        for _ in range(10):
            try:
                budgets.require("anna", f"192.0.2.{host}")
            except TooOften:
                break
            budgets.tried("anna", f"192.0.2.{host}")
            tries += 1
    assert tries <= CROWDED + FREE + 100


def test_one_address_tries_many_names_one_by_one() -> None:
    budgets = LoginBudgets()
    for n in range(CROWDED):
        budgets.tried(f"name {n}", "192.0.2.1")
    budgets.tried("anna", "192.0.2.1")
    with pytest.raises(TooOften):
        budgets.require("anna", "192.0.2.1")
    budgets.require("anna", "192.0.2.2")


def test_a_known_browser_has_a_budget_of_its_own_which_ends() -> None:
    budgets = LoginBudgets()
    for _ in range(50):
        budgets.tried("anna", "127.0.0.1")
    with pytest.raises(TooOften):
        budgets.require("anna", "127.0.0.1")
    for _ in range(FREE):
        budgets.require("anna", "127.0.0.1", "browser")
        budgets.tried("anna", "127.0.0.1", "browser")
    with pytest.raises(TooOften):
        budgets.require("anna", "127.0.0.1", "browser")


def test_hosts_of_an_ipv6_network_are_one() -> None:
    assert address_group("2001:db8::1") == address_group("2001:db8::ffff:1")
    assert address_group("2001:db8::1") != address_group("2001:db8:0:1::1")
    assert address_group("::ffff:192.0.2.1") == address_group("192.0.2.1")
    assert address_group("fe80::1%eth0") == address_group("fe80::2%eth0")
    assert address_group("nonsense") == "nonsense"


# --- known browsers -------------------------------------------------------------------


def test_a_device_cookie_is_signed_and_names_one_account() -> None:
    ours, other = KnownDevices(b"k" * 32), KnownDevices(b"x" * 32)
    cookie = ours.issue(7)
    known = ours.known(cookie)
    assert known is not None
    assert known.account == 7
    assert other.known(cookie) is None
    identity, _, signature = cookie.split(".")
    for forged in ("", None, "a", "a.b", "..", cookie + "0", f"{identity}.8.{signature}",
                   f"{identity}.٧.{signature}", f"{identity}.7.", cookie.replace(".7.", ".07."),
                   "é" * 40, f"x.{'9' * 5000}.{signature}"):  # fmt: skip
        assert ours.known(forged) is None, forged


def test_a_browser_that_was_here_gets_in_while_its_name_is_guessed(server: GuardedServer) -> None:
    """From the same address: behind a proxy all come from one."""
    server.run(server.people.accounts.add("Dora", PASSWORD, Role.OPERATOR))
    with httpx.Client(base_url=f"{server.url}/api/v1") as browser:
        body = {"name": "Dora", "password": PASSWORD}
        assert browser.post("/session", json=body).status_code == 200
        browser.headers["X-Servodeck-CSRF"] = browser.get("/session").json()["csrf"]
        assert browser.delete("/session").status_code == 204
        del browser.headers["X-Servodeck-CSRF"]
        assert "servodeck-device" in browser.cookies
        while guess(server, "dora") == 401:
            pass
        assert guess(server, "Dora", PASSWORD) == 429, "a stranger waits"
        assert browser.post("/session", json=body).status_code == 200
        # The cookie of one account is none for another's name.
        browser.cookies.delete("servodeck")
        while guess(server, NAMES[Role.VIEWER]) == 401:
            pass
        other = {"name": NAMES[Role.VIEWER], "password": PASSWORD}
        assert browser.post("/session", json=other).status_code == 429


@pytest.mark.long
def test_a_known_browser_is_no_stranger_at_the_gate(server: GuardedServer) -> None:
    """A crowd of requests of nobody from its address does not keep the log-in page from it."""
    device = server.people.accounts.devices.issue(1)
    bare = httpx.Client(base_url=f"{server.url}/api/v1", timeout=60)
    with bare:
        until_refused = (bare.get("/session").status_code for _ in range(3000))
        assert 429 in until_refused
        answer = bare.get("/session", headers={"Cookie": f"servodeck-device={device}"})
        assert answer.status_code == 200


def test_the_device_cookie_opens_nothing(server: GuardedServer) -> None:
    device = server.people.accounts.devices.issue(1)
    stranger = Caller(server)
    answer = stranger.ask("GET", "/drives", headers={"Cookie": f"servodeck-device={device}"})
    assert answer.status_code == 401


# --- turns at the hash ----------------------------------------------------------------


async def test_turns_go_to_known_ones_first_then_place_by_place() -> None:
    turns, order = HashTurns(), []
    go = asyncio.Event()

    async def one(name: str, place: str, *, known: bool) -> None:
        async with turns.turn(place, known=known):
            order.append(name)
            await go.wait()

    tasks = []
    for name, place, known in (
        ("first", "a", False),
        ("a1", "a", False),
        ("a2", "a", False),
        ("b1", "b", False),
        ("c1", "c", False),
        ("known", "browser", True),
    ):
        tasks.append(asyncio.create_task(one(name, place, known=known)))
        await asyncio.sleep(0)
    go.set()
    await asyncio.gather(*tasks)
    assert order == ["first", "known", "a2", "b1", "c1", "a1"]


async def test_who_was_never_wrong_comes_before_any_number_of_addresses_that_guess() -> None:
    """65 addresses that went on guessing kept everybody out who came from a 66th."""
    turns, order = HashTurns(), []
    entered = asyncio.Event()
    end = asyncio.Event()

    async def one(place: str, wrong: int) -> None:
        async with turns.turn(place, known=False, wrong=wrong):
            entered.set()
            order.append(place)
            await end.wait()

    guesses = [asyncio.create_task(one(f"guesses {n}", n)) for n in range(1, MOST_PLACES + 2)]
    await entered.wait()
    once_wrong = asyncio.create_task(one("once wrong", 1))
    never_wrong = asyncio.create_task(one("never wrong", 0))
    await asyncio.sleep(0)
    end.set()
    await asyncio.gather(once_wrong, never_wrong)
    ended = await asyncio.gather(*guesses, return_exceptions=True)
    assert order[:2] == ["guesses 1", "never wrong"]
    assert order.index("once wrong") == 2
    # Two went away for them: those who had been wrong most often.
    gone = [n for n, each in enumerate(ended, 1) if isinstance(each, TooOften)]
    assert gone == [MOST_PLACES, MOST_PLACES + 1]


def test_the_wrong_tries_of_an_address_are_those_of_all_names(server: GuardedServer) -> None:
    accounts = server.people.accounts
    for n in range(3):
        with pytest.raises(NotLoggedIn):
            server.run(accounts.log_in(f"nobody {n}", "wrong password", "192.0.2.1", "test"))
    assert accounts._budgets.wrong_tries_of("192.0.2.1") == 3
    assert accounts._budgets.wrong_tries_of("192.0.2.2") == 0


def test_a_few_addresses_do_not_fill_the_room_of_all_strangers() -> None:
    """Five addresses with 40 slow requests each kept everybody out who was not known."""
    admission = Admission()
    with ExitStack() as held:
        for n in range(MOST_OF_STRANGERS):
            held.enter_context(
                admission.running(f"192.0.2.{n // MOST_OF_PLACE}", known=False, stop=False)
            )
        with pytest.raises(TooOften), admission.running("192.0.2.0", known=False, stop=False):
            pass
        with admission.running("198.51.100.7", known=False, stop=False):
            pass
        for n in range(MOST_FIRST_OF_PLACES):
            held.enter_context(admission.running(f"203.0.113.{n}", known=False, stop=False))
        with pytest.raises(TooOften), admission.running("198.51.100.7", known=False, stop=False):
            pass
        # There is room for who is known.
        with admission.running("192.0.2.0", known=True, stop=False):
            pass


async def test_the_oldest_of_a_crowd_goes_for_the_newest() -> None:
    turns = HashTurns()
    done: list[str] = []

    async def one(name: str) -> None:
        async with turns.turn("crowd", known=False):
            done.append(name)

    async with turns.turn("crowd", known=False):
        tasks = [asyncio.create_task(one(str(n))) for n in range(20)]
        await asyncio.sleep(0)
    ended = await asyncio.gather(*tasks, return_exceptions=True)
    assert done == ["19", "18", "17"]
    assert sum(isinstance(each, TooOften) for each in ended) == 20 - MOST_WAITING


async def test_who_goes_away_while_waiting_passes_the_turn_on() -> None:
    turns = HashTurns()
    entered = asyncio.Event()

    async def one() -> None:
        async with turns.turn("x", known=False):
            entered.set()

    async with turns.turn("x", known=False):
        gone, called, stays = (asyncio.create_task(one()) for _ in range(3))
        await asyncio.sleep(0)
        gone.cancel()
        await asyncio.sleep(0)
    stays.cancel()  # its turn has come in this very moment
    await asyncio.wait_for(called, 5)
    assert entered.is_set()
    async with asyncio.timeout(5), turns.turn("y", known=False):
        pass


async def test_places_are_bounded() -> None:
    turns = HashTurns()

    async def one(place: str) -> None:
        async with turns.turn(place, known=False):
            pass

    async with turns.turn("x", known=False):
        tasks = [asyncio.create_task(one(f"place {n}")) for n in range(MOST_PLACES + 5)]
        await asyncio.sleep(0)
    ended = await asyncio.gather(*tasks, return_exceptions=True)
    assert sum(isinstance(each, TooOften) for each in ended) == 5


@pytest.mark.long
def test_a_right_password_does_not_wait_for_eighty_guesses(tmp_path: Path) -> None:
    """80 guesses at once delayed a right one by 80 hashes (12 s)."""
    server = GuardedServer(tmp_path).start()
    try:
        server.add_people()
        hash_s = 0.15
        slow = server.people.accounts._passwords
        verify = slow.verify
        held: list[float] = []

        def slowly(kept: str, password: str) -> bool:
            held.append(time.monotonic())
            time.sleep(hash_s)
            return verify(kept, password)

        slow.verify = slowly  # type: ignore[method-assign]
        try:
            with ThreadPoolExecutor(80) as crowd:
                for n in range(80):
                    crowd.submit(guess, server, f"nobody {n}")
                until(lambda: held)
                before = len(held)
                log_in_as_a_person_does(server)
                waited_for = len(held) - before
        finally:
            slow.verify = verify  # type: ignore[method-assign]
        # Counted in hashes, as a busy machine takes its own time for each.
        assert waited_for <= 20, "80 before"
        assert len(held) < 60, "guesses of one address beyond its share are not even hashed"
    finally:
        server.stop()


def log_in_as_a_person_does(server: GuardedServer) -> None:
    """Again after the time that the answer names, until it works."""
    for _ in range(10):
        answer = httpx.post(
            f"{server.url}/api/v1/session",
            json={"name": NAMES[Role.OPERATOR], "password": PASSWORD},
            timeout=60,
        )
        if answer.status_code == 200:
            return
        assert answer.status_code == 429
        time.sleep(min(1.0, float(answer.headers["Retry-After"])))
    raise AssertionError("never got in")
