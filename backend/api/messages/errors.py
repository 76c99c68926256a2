"""The only place that converts errors to HTTP answers (RFC 9457 problem details)."""

from __future__ import annotations

import logging
import math

from fastapi import FastAPI, Request
from fastapi.encoders import jsonable_encoder
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from backend.api.messages.models import Problem
from backend.foundation.people.errors import Forbidden, NoSuchPerson, NotLoggedIn, TooOften
from backend.tools.wire_message import MessageInfo
from drivers.errors import (
    Busy,
    DriveError,
    LinkLost,
    LinkTimeout,
    NotAllowed,
    OutOfRange,
    ProtocolError,
    Rejected,
    internal_error,
)
from drivers.texts.message import Language, Param, Text, as_text, language, text
from drivers.texts.validation import refusal_of

log = logging.getLogger(__name__)

#: HTTP status by class of error; the first matching class counts.
STATUS: dict[type[DriveError], int] = {
    NotLoggedIn: 401,
    Forbidden: 403,
    NoSuchPerson: 404,
    TooOften: 429,
    OutOfRange: 422,
    Rejected: 422,
    NotAllowed: 409,
    Busy: 409,
    ProtocolError: 502,
    LinkLost: 503,
    LinkTimeout: 504,
}

#: Titles by kind of error, in English and the same for every occurrence (RFC 9457, section 3.1.3).
#: The page has translations (`problemTitle` in `webui/src/i18n/texts/axis/drive.ts`).
TITLES = {
    "drive-error": "Drive error",
    "link-timeout": "No answer in time",
    "link-lost": "Link lost",
    "protocol-error": "Invalid answer",
    "rejected": "The drive refused",
    "out-of-range": "Value out of range",
    "not-allowed": "Not possible now",
    "not-in-use": "Not in use",
    "busy": "In use",
    "bad-description": "Not a usable description",
    "bad-parameter-set": "Not a usable parameter set",
    "bad-recording": "Not a usable recording",
    "changed-meanwhile": "Changed meanwhile",
    "bad-measurement": "Not a usable measurement",
    "bad-snapshot": "Not a usable snapshot",
    "storage-failed": "Could not be stored",
    "backup-failed": "Not backed up",
    "state-refused": "State folder refused",
    "accounts-gone": "Accounts are missing",
    "scale-unknown": "Scale unknown",
    "scale-changed": "Scale changed",
    "restore-failed": "Not everything was restored",
    "not-found": "Not found",
    "not-logged-in": "Not logged in",
    "not-granted": "Needs the permission to move",
    "forbidden": "Forbidden",
    "too-often": "Too many requests",
    "wrong-method": "Wrong method",
    "internal": "Internal error",
    "bad-request": "Bad request",
    "body": "Body refused",
    "http": "Request failed",
}


class NotFound(NotAllowed):
    """The address refers to nothing that exists."""

    kind = "not-found"


class WrongMethod(DriveError):
    """The address exists, but not for this method. ``methods`` are the permitted ones."""

    kind = "wrong-method"

    def __init__(self, code: str | Text, /, methods: list[str], **params: Param) -> None:
        super().__init__(as_text(code, params), limit=", ".join(methods))
        self.methods = methods


def problem_of(error: Exception) -> Problem:
    """Problem details of any error, in the language of the request.

    An error that is not a DriveError is a defect of servodeck, and is described as one.
    """
    spoken = language()
    if not isinstance(error, DriveError):
        defect, report = internal_error(error), text("error.defect")
        return Problem(
            type="urn:servodeck:internal",
            title=TITLES["internal"],
            status=500,
            detail=defect.words(spoken),
            remedy=report.words(spoken),
            code=defect.code,
            params=message_of(defect).params,
            advice=message_of(report),
        )
    status = _status(error)
    value, advice = _scalar(error.value), error.advice_text
    return Problem(
        type=f"urn:servodeck:{error.kind}",
        title=TITLES.get(error.kind, TITLES["drive-error"]),
        status=status,
        detail=error.text.words(spoken),
        drive=_named(error.drive, spoken),
        parameter=error.parameter,
        value=value,
        limit=None if error.limit_text is None else error.limit_text.words(spoken),
        limit_message=message_or_none(error.limit_text),
        remedy=None if advice is None else advice.words(spoken),
        code=error.code or None,
        params=message_of(error.text).params,
        advice=None if advice is None else message_of(advice),
        abort_code=error.abort_code if isinstance(error, Rejected) else None,
    )


def _named(drive: str | Text | None, spoken: Language) -> str | None:
    """The name of the drive, or its place on the bus in the language of the request."""
    return drive.words(spoken) if isinstance(drive, Text) else drive


def message_of(message: Text) -> MessageInfo:
    """A message in the form of the API."""
    return MessageInfo.model_validate(message.to_wire())


def message_or_none(message: Text | None) -> MessageInfo | None:
    """A message in the form of the API; None without one."""
    return None if message is None else message_of(message)


def words_of(message: Text | None) -> str:
    """The sentence in the language of the request; empty without a message."""
    return "" if message is None else message.words(language())


def _status(error: DriveError) -> int:
    if isinstance(error, NotFound):
        return 404
    if isinstance(error, WrongMethod):
        return 405
    return next((code for kind, code in STATUS.items() if isinstance(error, kind)), 500)


def answer(problem: Problem) -> JSONResponse:
    """Make the HTTP answer of a problem."""
    return JSONResponse(
        problem.model_dump(mode="json"),
        status_code=problem.status,
        media_type="application/problem+json",
    )


def answer_error(error: DriveError) -> JSONResponse:
    """Make the HTTP answer of an error, with the headers that belong to it (RFC 9110)."""
    response = answer(problem_of(error))
    if isinstance(error, TooOften):
        response.headers["Retry-After"] = str(max(1, round(error.wait_s)))
    if isinstance(error, NotLoggedIn):
        response.headers["WWW-Authenticate"] = "Bearer"
    if isinstance(error, WrongMethod):
        response.headers["Allow"] = ", ".join(error.methods)
    return response


def install(app: FastAPI) -> None:
    """Register the exception handlers."""

    @app.exception_handler(DriveError)
    async def drive_error(_request: Request, error: DriveError) -> JSONResponse:
        return answer_error(error)

    @app.exception_handler(RequestValidationError)
    async def bad_request(_request: Request, error: RequestValidationError) -> JSONResponse:
        first = error.errors()[0]
        refusal, advice = refusal_of(first), text("api.see-interface")
        return answer(
            Problem(
                type="urn:servodeck:bad-request",
                title=TITLES["bad-request"],
                status=422,
                detail=refusal.words(language()),
                parameter=".".join(str(part) for part in first["loc"]),
                value=_scalar(jsonable_encoder(first.get("input"), custom_encoder={bytes: repr})),
                remedy=advice.words(language()),
                code=refusal.code,
                params=message_of(refusal).params,
                advice=message_of(advice),
            )
        )

    @app.exception_handler(HTTPException)
    async def http_error(_request: Request, error: HTTPException) -> JSONResponse:
        return answer(
            Problem(
                type="urn:servodeck:http",
                title=TITLES["http"],
                status=error.status_code,
                detail=str(error.detail),
            )
        )

    @app.exception_handler(ClientDisconnect)
    async def client_gone(request: Request, _error: ClientDisconnect) -> JSONResponse:
        # Not a defect: a page was closed while it sent a file. Nobody reads this answer.
        log.info("%s %s: the client went within its request", request.method, request.url.path)
        return answer(
            Problem(type="urn:servodeck:http", title=TITLES["http"], status=400, detail="")
        )

    @app.exception_handler(Exception)
    async def internal(request: Request, error: Exception) -> JSONResponse:
        log.exception("unhandled error at %s %s", request.method, request.url.path, exc_info=error)
        return answer(problem_of(error))


def _scalar(value: object) -> int | float | str | None:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)  # JSON has no infinity and no NaN
    return value if isinstance(value, (int, float, str)) else None
