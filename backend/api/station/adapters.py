"""Routes of the latency timer of serial adapters: what it costs, and lowering it."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query

from backend.api.requests.context import TheBench
from backend.api.station.models_preflight import LatencyRequest, LatencyTimerInfo
from backend.foundation.preflight.adapters import LOWERED_MS, Adapters, most_reads
from backend.station.bench import Bench
from drivers.adapters import is_same_port, require_serial_form
from drivers.computer.serial_ports.latency_timer import InForce
from drivers.errors import Busy
from drivers.urls import serial_port_of

router = APIRouter()
Device = Annotated[str, Query(max_length=250, description="serial port, as COM3 or /dev/ttyUSB0")]


@router.get("/adapters/latency-timer")
async def latency_timer(bench: TheBench, device: Device) -> LatencyTimerInfo:
    """Read the latency timer of a serial adapter, and what it costs."""
    require_serial_form(device)
    return await _info(bench, device, None)


@router.put("/adapters/latency-timer")
async def set_latency_timer(bench: TheBench, request: LatencyRequest) -> LatencyTimerInfo:
    """Set the latency timer of a serial adapter; its first value is stored and can be restored.

    On Windows the adapter is restarted, which no program may use meanwhile.
    """
    require_serial_form(request.device)
    adapters = Adapters(bench.state_folder)
    await _require_free(bench, adapters, request.device)
    rates = [
        1000 / trip_ms
        for url, trip_ms in bench.buses.last_round_trip_ms.items()
        if trip_ms and _is_at(url, request.device)
    ]
    before = _measured(bench, request.device) or next(iter(rates), None)
    in_force = await asyncio.to_thread(adapters.set, request.device, request.ms, before)
    return await _info(bench, request.device, in_force)


@router.delete("/adapters/latency-timer")
async def restore_latency_timer(bench: TheBench, device: Device) -> LatencyTimerInfo:
    """Restore the latency timer that an adapter had before servodeck changed it."""
    require_serial_form(device)
    adapters = Adapters(bench.state_folder)
    await _require_free(bench, adapters, device)
    return await _info(bench, device, await asyncio.to_thread(adapters.restore, device))


async def _info(bench: Bench, device: str, in_force: InForce | None) -> LatencyTimerInfo:
    found = await asyncio.to_thread(Adapters(bench.state_folder).look, device)
    timer, changed = found.timer, found.changed
    return LatencyTimerInfo(
        device=device,
        ms=timer.ms if timer else None,
        restarts=bool(timer and timer.instance),
        reads_at_most=most_reads(timer.ms) if timer else None,
        lowered_ms=LOWERED_MS,
        lowered_reads_at_most=most_reads(LOWERED_MS),
        reads_measured=_measured(bench, device),
        before_ms=changed.before_ms if changed else None,
        reads_before=changed.reads_before if changed else None,
        in_force=in_force,
    )


def _is_at(url: str, device: str) -> bool:
    return is_same_port(serial_port_of(url), device)


def _measured(bench: Bench, device: str) -> float | None:
    """Reads per second of an open bus at this port, one after another, as measured there."""
    trips = (
        link.quality(None).round_trip_ms
        for url, link in bench.buses.opened.items()
        if _is_at(url, device)
    )
    trip_ms = next((one for one in trips if one), None)
    return 1000 / trip_ms if trip_ms else None


async def _require_free(bench: Bench, adapters: Adapters, device: str) -> None:
    """A restart of the adapter would cut a bus of this server off, with axes that may move.

    Raises:
        Busy: a bus is open at this port.
    """
    timer = (await asyncio.to_thread(adapters.look, device)).timer
    if timer and timer.instance and any(_is_at(url, device) for url in bench.buses.opened):
        raise Busy("preflight.adapter-in-use", device=device)
