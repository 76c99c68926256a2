"""Rounds of health checks and signed baselines in the database."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from backend.axes.drive.drive import Drive
from backend.foundation.store.database import Store
from backend.foundation.store.health_tables import HealthBaseline, HealthRun
from backend.tools.thresholds import trend_compare
from backend.tools.watching.health.result import HealthRound
from backend.tools.watching.health.settings import HealthSettings
from backend.tools.watching.trend.compare import Finding, compare
from drivers.errors import NotAllowed

#: Settings that do not affect the values: the number of rounds, and the consent of a person.
_OF_NO_EFFECT = frozenset({"rounds", "consent"})


@dataclass(frozen=True)
class AxisOf:
    """Identity of an axis: its key (see `health_tables`), and data of its drive."""

    key: str
    name: str
    profile: str
    vendor_id: int | None = None
    product_code: int | None = None
    revision: int | None = None
    serial: int | None = None
    firmware: str = ""


@dataclass(frozen=True)
class HealthRow:
    """One round as stored; ``measurements``: names of raw data with their SHA-256."""

    id: int
    axis: AxisOf
    station: str
    taken: datetime
    person: str
    settings_sha256: str
    measurements: Mapping[str, str]
    round: HealthRound


@dataclass(frozen=True)
class Baseline:
    """A signed baseline. ``intact``: its contents still have the checksum from signing."""

    id: int
    axis: AxisOf
    signed: datetime
    person: str
    notes: str
    sha256: str
    intact: bool
    settings: Mapping[str, object]
    settings_sha256: str
    rounds: tuple[HealthRound, ...]
    runs: tuple[int, ...]
    measurements: tuple[str, ...]
    newest: datetime


@dataclass(frozen=True)
class Condition:
    """Condition of one axis: its rounds, oldest first, and the newest compared with the baseline.

    ``findings`` are empty without an intact baseline. ``other_settings``: number of rounds after
    the baseline that were measured with other settings and are not compared.
    """

    axis: AxisOf
    rows: tuple[HealthRow, ...]
    baseline: Baseline | None
    findings: tuple[Finding, ...]
    checks: int
    other_settings: int


def axis_of(drive: Drive, station: str) -> AxisOf:
    """The axis of a drive of this station."""
    found = drive.found
    if found is None:
        return AxisOf(f"{station}/{drive.id}", drive.name, drive.profile.drive)
    known = found.vendor_id is not None and found.product_code is not None and found.serial
    key = (
        f"{found.vendor_id:x}-{found.product_code:x}-{found.serial}"
        if known
        else f"{station}/{drive.id}"
    )
    return AxisOf(
        key, drive.name, drive.profile.drive, found.vendor_id, found.product_code, found.revision,
        found.serial, found.firmware or "",
    )  # fmt: skip


def settings_sha256(settings: HealthSettings) -> str:
    """Checksum of the settings on which values depend."""
    reported = settings.model_dump(mode="json", exclude=set(_OF_NO_EFFECT))
    return _digest(reported)


class HealthRecords:
    """The condition of axes in a station's database. Blocks: call it on the store's threads."""

    def __init__(self, store: Store, station: str) -> None:
        self._store = store
        self._station = station

    def add(
        self,
        axis: AxisOf,
        settings: HealthSettings,
        rounds: Sequence[HealthRound],
        measurements: Mapping[str, str],
        person: str,
        taken: datetime | None = None,
    ) -> list[int]:
        """Store the rounds of one health check; return their ids.

        Raises:
            DatabaseFailed: nothing was stored.
        """
        with self._store.writing() as session:
            rows = [
                HealthRun(
                    station=self._station, axis_key=axis.key, axis=axis.name, profile=axis.profile,
                    vendor_id=axis.vendor_id, product_code=axis.product_code,
                    revision=axis.revision, serial=axis.serial, firmware=axis.firmware,
                    taken=taken or datetime.now(UTC), person=person,
                    settings=settings.model_dump(mode="json"),
                    settings_sha256=settings_sha256(settings), measurements=dict(measurements),
                    round=one.model_dump_json(),
                )
                for one in rounds
            ]  # fmt: skip
            session.add_all(rows)
            session.flush()
            return [row.id for row in rows]

    def sign(self, key: str, runs: Collection[int], person: str, notes: str = "") -> Baseline:
        """Sign rounds of an axis as its baseline; an earlier baseline stays stored.

        Raises:
            NotAllowed: too few rounds, not of this axis, with different settings, or no person.
        """
        if not person.strip():
            raise NotAllowed("health.baseline-needs-name", parameter="person")
        with self._store.writing() as session:
            rows = [
                row
                for row in _rows(session, _query().where(HealthRun.axis_key == key))
                if row.id in set(runs)
            ]
            unknown = sorted(set(runs) - {row.id for row in rows})
            if unknown:
                raise NotAllowed(
                    "health.run-not-of-axis", value=unknown[0], runs=", ".join(map(str, unknown))
                )
            if len(rows) < trend_compare.LEAST_REPEATS:
                raise NotAllowed(
                    "health.baseline-few-runs",
                    value=len(rows),
                    limit=str(trend_compare.LEAST_REPEATS),
                    rounds=len(rows),
                    least=trend_compare.LEAST_REPEATS,
                )
            if len({row.settings_sha256 for row in rows}) > 1:
                raise NotAllowed("health.baseline-different-settings")
            signed = datetime.now(UTC)
            settings = session.get_one(HealthRun, rows[0].id).settings
            content = _content(rows, settings, signed, person.strip(), notes)
            made = HealthBaseline(
                axis_key=key,
                signed=signed,
                person=person.strip(),
                notes=notes,
                content=content,
                sha256=_digest(content),
            )
            session.add(made)
            session.flush()
            return _baseline(made)

    def condition(self, axis: AxisOf) -> Condition:
        """Condition of one axis."""
        with self._store.reading() as session:
            rows = _rows(session, _query().where(HealthRun.axis_key == axis.key))
            baselines = _baselines(session, axis.key)
        return _condition(axis, rows, baselines.get(axis.key))

    def trend(self, since: datetime | None = None, name: str = "") -> list[Condition]:
        """Conditions of all axes of the database, or of those with a name; sorted by name.

        ``since`` limits the rounds that are returned, not those that are compared.
        """
        query = _query()
        if name:
            query = query.where(HealthRun.axis == name)
        with self._store.reading(snapshot=True) as session:
            rows = _rows(session, query)
            baselines = _baselines(session)
        by_axis: dict[str, list[HealthRow]] = {}
        for row in rows:
            by_axis.setdefault(row.axis.key, []).append(row)
        found = [
            _condition(own[-1].axis, own, baselines.get(key), since) for key, own in by_axis.items()
        ]
        return sorted(found, key=lambda each: (each.axis.name, each.axis.key))


def _condition(
    axis: AxisOf,
    rows: Sequence[HealthRow],
    baseline: Baseline | None,
    since: datetime | None = None,
) -> Condition:
    shown = tuple(row for row in rows if since is None or row.taken >= since)
    if baseline is None:
        return Condition(axis, shown, None, (), 0, 0)
    later = [row for row in rows if row.taken > baseline.newest and row.id not in baseline.runs]
    same = [row for row in later if row.settings_sha256 == baseline.settings_sha256]
    findings = compare(baseline.rounds, [row.round for row in same]) if baseline.intact else []
    return Condition(axis, shown, baseline, tuple(findings), len(same), len(later) - len(same))


def _query() -> Select[HealthRun]:
    return select(HealthRun).order_by(HealthRun.taken, HealthRun.id)


def _rows(session: Session, query: Select[HealthRun]) -> list[HealthRow]:
    """Rows of a query; read as columns and not as mapped objects, as a page needs thousands."""
    columns = [each for each in HealthRun.__table__.columns if each.name != "settings"]
    found = session.execute(query.with_only_columns(*columns))
    return [
        HealthRow(
            id=row.id,
            axis=AxisOf(
                row.axis_key, row.axis, row.profile, row.vendor_id, row.product_code, row.revision,
                row.serial, row.firmware,
            ),
            station=row.station, taken=row.taken, person=row.person,
            settings_sha256=row.settings_sha256, measurements=row.measurements,
            round=HealthRound.model_validate_json(row.round),
        )
        for row in found
    ]  # fmt: skip


def _baselines(session: Session, key: str | None = None) -> dict[str, Baseline]:
    """The newest baseline of each axis."""
    newest = select(func.max(HealthBaseline.id)).group_by(HealthBaseline.axis_key)
    if key is not None:
        newest = newest.where(HealthBaseline.axis_key == key)
    found = session.scalars(select(HealthBaseline).where(HealthBaseline.id.in_(newest)))
    return {row.axis_key: _baseline(row) for row in found}


def _content(
    rows: Sequence[HealthRow],
    settings: Mapping[str, object],
    signed: datetime,
    person: str,
    notes: str,
) -> dict[str, object]:
    """Signed contents: person, time, axis, stored measurements and their values."""
    return {
        "signed": signed.isoformat(),
        "person": person,
        "notes": notes,
        "axis": asdict(rows[-1].axis),
        "settings": dict(settings),
        "settings_sha256": rows[0].settings_sha256,
        "runs": [
            {
                "id": row.id,
                "taken": row.taken.isoformat(),
                "measurements": dict(row.measurements),
                "round": row.round.model_dump(mode="json"),
            }
            for row in rows
        ],
    }


def _digest(content: Mapping[str, object]) -> str:
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _baseline(row: HealthBaseline) -> Baseline:
    content = row.content
    runs, axis, settings = content["runs"], content["axis"], content["settings"]
    assert isinstance(runs, list)
    assert isinstance(axis, dict)
    assert isinstance(settings, dict)
    same = (content["person"], content["notes"]) == (row.person, row.notes)
    return Baseline(
        id=row.id, axis=AxisOf(**axis), signed=row.signed, person=row.person, notes=row.notes,
        sha256=row.sha256, intact=same and _digest(content) == row.sha256, settings=settings,
        settings_sha256=str(content["settings_sha256"]),
        rounds=tuple(HealthRound.model_validate(run["round"]) for run in runs),
        runs=tuple(int(run["id"]) for run in runs),
        measurements=tuple(dict.fromkeys(name for run in runs for name in run["measurements"])),
        newest=max(datetime.fromisoformat(run["taken"]) for run in runs),
    )  # fmt: skip
