"""Why something ended, failed or cannot be used reaches page and command line as code and facts.

Each case is rendered in English and Chinese: a sentence of the backend would be the same in both.
"""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import AsyncIterator, Callable
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import httpx
import pytest

from backend.api.live.connection import Connection
from backend.api.live.jog import Jogs
from backend.api.live.messages import JogEnded, JogStart, JogStop, StopAll, StopTaken, from_page
from backend.api.live.people_messages import EnableRelease
from backend.api.live.people_views import PeopleViews
from backend.api.messages import convert
from backend.api.messages.errors import TITLES, problem_of
from backend.commands.drive import live as command
from backend.foundation.people.identity import LOCAL
from backend.foundation.people.rights import Right
from backend.foundation.people.station import People
from backend.foundation.people.support import Invitation, Support
from backend.foundation.store.database import Store
from backend.foundation.work.jobs import Job, Progress
from backend.records.audit import AuditLog, Fact
from backend.records.audit.recorder import AuditRecorder
from backend.records.audit.trail import Filter, Trail
from backend.station.bench import Bench
from backend.tools.moving.jog.release import END_OF_ENABLING, END_OF_JOG, Release
from backend.tools.moving.jog.run import end_of
from backend.tools.moving.moves.identification import state_of
from drivers.errors import DriveError
from drivers.texts.message import Language, Text, prose, speaking, text
from drivers.texts.profile_errors import profile_error_text
from profiles.loader import ProfileError, drive_names, load_all, parse_profile

ROOT = Path(__file__).parents[4]
CHINESE = re.compile(r"[\u4e00-\u9fff]")


def require_both_languages(message: Text | None) -> None:
    """A message of the catalogue whose Chinese is Chinese, and whose English is not."""
    assert message is not None
    assert message.code
    assert CHINESE.search(message.words("zh")), message
    assert not CHINESE.search(message.words("en")), message
    assert message.code not in message.words("en"), "it has words"


def carried(found: Any, name: str) -> tuple[str, Text]:
    """The words and the message of one field of an answer."""
    wire = getattr(found, f"{name}_message")
    assert wire is not None
    return getattr(found, name), Text.from_wire(wire.model_dump())


async def eventually(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110 - of state that nobody signals
            await asyncio.sleep(0.01)


# --- the end of a jog -----------------------------------------------------------------


@pytest.mark.parametrize("release", get_args(Release))
def test_every_release_of_the_page_has_words(release: Release) -> None:
    require_both_languages(END_OF_JOG[release])
    require_both_languages(END_OF_ENABLING[release])


@pytest.mark.parametrize("reason", ["", "released", "Esc", "window lost the focus", None, 7, {}])
def test_a_release_counts_whatever_reason_comes_with_it(reason: object) -> None:
    """Pages of earlier versions sent words, and another client may send anything."""
    for kind, which in (("jog_stop", "drive"), ("enable_release", "invitation")):
        sent = json.dumps({"type": kind, which: "x", "reason": reason})
        found = from_page.validate_json(sent)
        assert isinstance(found, JogStop | EnableRelease)
        assert found.reason == "released"
    assert JogStop(drive="x").reason == "released"
    assert JogStop(drive="x", reason="escape").reason == "escape"


async def jog_ended(bench: Bench, end: Callable[[Jogs, Job], None]) -> JogEnded:
    """What the page is sent when a jog ended this way."""
    sent: list[Any] = []
    jogs = Jogs(bench, "c1", sent.append)
    limits = {"speed": 60.0, "acceleration": 600.0, "travel_limit": 5.0, "torque_limit": 50.0}
    jogs.start(JogStart.model_validate({"drive": "x", "direction": 1, "press": 1, **limits}), "A")
    job = bench.jobs.moving("x")
    assert job is not None
    end(jogs, job)
    await eventually(lambda: any(isinstance(each, JogEnded) for each in sent))
    return next(each for each in sent if isinstance(each, JogEnded))


JOG_ENDS: list[tuple[Callable[[Jogs, Job], None], Text]] = [
    (lambda jogs, _: jogs.release("x", END_OF_JOG["released"]), END_OF_JOG["released"]),
    (lambda jogs, _: jogs.release(None, text("work.page-gone")), text("work.page-gone")),
    (
        lambda _, job: job.cancel(text("motion.stop-was-pressed")),
        text("motion.stop-was-pressed"),
    ),
]


@pytest.mark.parametrize("language", ["en", "zh"])
@pytest.mark.parametrize(("end", "why"), JOG_ENDS)
async def test_the_page_is_sent_the_end_of_a_jog_as_code_and_facts(
    bench: Bench, end: Callable[[Jogs, Job], None], why: Text, language: Language
) -> None:
    with speaking(language):
        ended = await jog_ended(bench, end)
    words, message = carried(ended, "reason")
    assert message == why
    assert words == why.words(language)
    require_both_languages(message)
    assert ended.problem is None
    remedy = why.remedy()
    assert ended.remedy == ("" if remedy is None else remedy.words(language))
    with speaking("zh"):
        assert command._why(ended) == why


def test_the_result_of_a_jog_is_in_the_language_of_its_reader() -> None:
    job = Job("jog-1", "jog", text("jog.moving"), "x", True, Progress(lambda: None))
    job.state, job.result = "done", end_of(END_OF_JOG["focus-lost"], 0.25)
    with speaking("zh"):
        result = convert.job(job).model_dump(mode="json")["result"]
    assert result["reason"] == "窗口失去焦点"
    assert result["reason_message"] == {"code": "jog.end-focus-lost", "params": {}}
    assert result["moved_rev"] == 0.25


def test_the_audit_keeps_the_end_of_a_jog_as_a_code(tmp_path: Path) -> None:
    store = Store(tmp_path)
    audit = AuditLog(store, "bench-1")
    job = Job("jog-1", "jog", text("jog.moving"), "x", True, Progress(lambda: None))
    recorder = AuditRecorder(audit, str)
    recorder.job_changed(job)
    job.state, job.result = "done", end_of(END_OF_JOG["escape"], 0.25)
    recorder.job_changed(job)
    # A person's own words stay what they are, and so does what earlier versions wrote.
    audit.add(Fact("write", "written", detail={"reason": "page 12"}))
    audit.close()
    written, ended, _began = Trail(store).search(Filter())
    store.close()
    assert ended.reason == END_OF_JOG["escape"]
    assert ended.detail_in("en")["reason"] == "Esc was pressed"
    assert ended.detail_in("zh")["reason"] == "按下了 Esc 键"
    assert written.reason == prose("page 12")
    assert written.detail_in("zh") == {"reason": "page 12"}


# --- remote support -------------------------------------------------------------------


class Ticks:
    """A clock of the test's own."""

    s = 0.0

    def __call__(self) -> float:
        return self.s


def invited(support: Support, *, joined: bool = True) -> tuple[str, Invitation]:
    link, made = support.invite("Olaf", "Greta", frozenset({Right.MOTION}), 600.0)
    if joined:
        support.join(link, made.code, "here")
    return link, made


def expired(support: Support, clock: Ticks) -> Invitation:
    _, made = invited(support)
    clock.s += 601.0
    support.tick()
    return made


def guessed(support: Support, _clock: Ticks) -> Invitation:
    link, made = invited(support, joined=False)
    while made.state == "open":
        with pytest.raises(DriveError):
            support.join(link, "wrong", "here")
    return made


def ended_by_olaf(support: Support, _clock: Ticks) -> Invitation:
    _, made = invited(support)
    return support.revoke(made.id, text("people.end-by-person", person="Olaf"))


@pytest.mark.parametrize(
    ("end", "code"),
    [
        (expired, "people.end-expired"),
        (guessed, "people.end-too-many-codes"),
        (ended_by_olaf, "people.end-by-person"),
    ],
)
def test_why_an_invitation_ended_is_code_and_facts(
    bench: Bench, tmp_path: Path, end: Callable[[Support, Ticks], Invitation], code: str
) -> None:
    clock = Ticks()
    ended = end(Support(clock), clock)
    assert ended.why_ended is not None
    assert ended.why_ended.code == code
    require_both_languages(ended.why_ended)
    views = PeopleViews(bench, People(tmp_path), {})
    for language in get_args(Language):
        with speaking(language):
            words, message = carried(
                views.invitation(ended, host=True, identity=LOCAL), "why_ended"
            )
        assert message == ended.why_ended
        assert words == ended.why_ended.words(language)


def test_what_stops_a_guest_is_code_and_facts() -> None:
    clock = Ticks()
    support = Support(clock)
    stopped: list[Text] = []
    support.on_disabled.append(lambda _invitation, why: stopped.append(why))
    _, made = invited(support)
    rights = frozenset({Right.MOTION})
    support.grant(made.id, "Olaf", rights, 60.0, None)
    support.grant(made.id, "Olaf", rights, 60.0, "x")
    support.press(made.id, "site")
    support.release(made.id, "site", END_OF_ENABLING["released"])
    support.press(made.id, "site")
    clock.s += 1.0
    support.watch()
    clock.s += 60.0
    support.tick()
    assert [each.code for each in stopped] == [
        "people.end-grant-replaced",
        "people.end-enabling-released",
        "people.end-site-silent",
        "people.end-grant-expired",
    ]
    for each in stopped:
        require_both_languages(each)


# --- STOP -----------------------------------------------------------------------------


class NoSocket:
    """Carries nothing."""

    async def send_bytes(self, _data: bytes) -> None: ...


@pytest.fixture
async def page(bench: Bench) -> AsyncIterator[Connection]:
    socket: Any = NoSocket()
    people: Any = None
    made = Connection("c1", socket, bench, people, people, LOCAL)
    yield made
    await made.close()


@pytest.mark.parametrize("language", ["en", "zh"])
async def test_a_stop_that_did_not_reach_a_drive_says_why_by_code(
    bench: Bench, page: Connection, monkeypatch: pytest.MonkeyPatch, language: Language
) -> None:
    why = text("error.link-lost")

    async def stop(_drives: list[str]) -> dict[str, Text | None]:
        return {"x": why}

    monkeypatch.setattr(bench.motion, "stop", stop)
    sent: list[Any] = []
    monkeypatch.setattr(page, "send", sent.append)
    with speaking(language):
        await page._stop(StopAll(drive="x"))
    await asyncio.sleep(0)
    taken = next(each for each in sent if isinstance(each, StopTaken))
    assert taken.problems == {"x": why.words(language)}
    assert Text.from_wire(taken.problem_messages["x"].model_dump()) == why
    require_both_languages(why)


# --- profiles -------------------------------------------------------------------------

SLIPS = {
    "profile.no-yaml": b"drive: [",
    "profile.no-mapping": b"- one",
    "profile.refused": b"drive: broken\nparametres: []",
    "profile.class-in-row": b"drive: broken\nparameters: [{key: '6040:00', motion: none}]",
    "profile.not-utf8": b"drive: \xff\xfe",
}


@pytest.mark.long(keep=4)
@pytest.mark.parametrize(("code", "content"), SLIPS.items())
async def test_a_profile_that_cannot_be_used_says_why_by_code(
    http: httpx.AsyncClient,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    code: str,
    content: bytes,
) -> None:
    monkeypatch.setenv("SERVODECK_PROFILES", str(tmp_path / "mine"))
    file = tmp_path / "mine" / "broken" / "profile.yaml"
    file.parent.mkdir(parents=True)
    file.write_bytes(content)
    for language in get_args(Language):
        answer = await http.get("/profiles", headers={"Accept-Language": language})
        found = next(each for each in answer.json() if each["profile"] == "broken")
        message = Text.from_wire(found["problem_message"])
        assert message.code == code
        assert found["problem"] == message.words(language)
        require_both_languages(message)
        require_both_languages(message.remedy())


def test_an_unknown_profile_is_a_code_at_the_command_line_too() -> None:
    with pytest.raises(ProfileError) as caught:
        parse_profile({"a.yaml": "drive: x", "b.yaml": "drive: y"})
    message = profile_error_text(caught.value)
    assert message == text("profile.field-twice", file="b.yaml", field="drive")
    require_both_languages(message)


# --- identification by the drive ------------------------------------------------------


def test_every_state_of_an_identification_has_words() -> None:
    specs = {
        name: spec
        for name, profile in load_all().items()
        if name in drive_names() and (spec := profile.functions.identification) is not None
    }
    assert "mms7" in specs
    for name, spec in specs.items():
        values = load_all()[name].by_key[spec.status_key].enum
        assert set(values) == set(spec.states), "each value of the manual has a state"
        for value in values:
            message = state_of(spec, value)
            assert message.code != "moves.identification-status"
            require_both_languages(message)
        assert {spec.states[value] for value in spec.done} == {"complete"}
        assert {spec.states[value] for value in spec.failed} == {"error"}
        require_both_languages(state_of(spec, 99))
        assert "99" in state_of(spec, 99).words("zh")


# --- titles of problems ---------------------------------------------------------------


def test_the_page_has_its_own_title_for_every_type_of_problem() -> None:
    """RFC 9457: a title is that of the type; the page shows its own, in its own language."""
    for module in ("backend.commands.server.serve", "backend.cli"):
        import_module(module)
    ours = {each.kind for each in _classes(DriveError) if _is_ours(each)}
    source = (ROOT / "webui/src/i18n/texts/axis/drive.ts").read_text("utf-8")
    pairs = re.findall(r"'problemTitle\.([a-z-]+)': \['([^']+)', '([^']+)'\]", source)
    assert ours <= set(TITLES)
    assert {kind: english for kind, english, _ in pairs} == TITLES
    assert all(CHINESE.search(chinese) for _, _, chinese in pairs)


def _classes(error: type[DriveError]) -> set[type[DriveError]]:
    return {error}.union(*(_classes(each) for each in error.__subclasses__()))


def _is_ours(error: type[DriveError]) -> bool:
    return error.__module__.partition(".")[0] in ("backend", "drivers")


@pytest.mark.parametrize("error", [RuntimeError("boom"), DriveError("error.link-lost")])
def test_a_problem_has_words_in_both_languages_and_one_title(error: Exception) -> None:
    shown = {}
    for language in get_args(Language):
        with speaking(language):
            shown[language] = problem_of(error)
    english, chinese = shown["en"], shown["zh"]
    assert english.title == chinese.title
    assert english.code == chinese.code
    assert english.code
    assert CHINESE.search(chinese.detail)
    assert not CHINESE.search(english.detail)


async def test_a_bad_request_advises_in_the_language_that_is_asked_for(
    http: httpx.AsyncClient,
) -> None:
    answer = await http.post("/buses/cyclic", json={}, headers={"Accept-Language": "zh"})
    problem = answer.json()
    assert answer.status_code == 422
    assert problem["advice"]["code"] == "api.see-interface"
    assert CHINESE.search(problem["remedy"])
    assert problem["code"] == "input.refused"
    assert problem["params"]["place"] == problem["parameter"]
    assert problem["params"]["reason"]["code"] == "input.missing"
    assert problem["detail"] == f"{problem['parameter']}：缺少此字段"
