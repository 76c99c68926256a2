"""Each start and stop of the exchange is answered, also where the exchange ends otherwise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from drivers.errors import DriveError, LinkLost
from drivers.ethercat.exchange.cyclic import Image
from drivers.ethercat.exchange.exchange import Exchange
from drivers.ethercat.exchange.mapping import Assigned, Entry, Pdo
from drivers.ethercat.exchange.setup import StationSetup
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire.lanes import Done
from drivers.motion.playback import AxisLoop

PDO = Assigned((Pdo(0x1600, (), write=True),), (Entry(0x6040, 0, 2, "H"),))


class Lanes:
    """Keeps every transaction until it is answered by hand."""

    def __init__(self) -> None:
        self.waiting: list[Done] = []

    def submit(self, _number: int, _lane: str, steps: Any, done: Done) -> None:
        steps.close()
        self.waiting.append(done)

    def drop(self) -> None:
        waiting, self.waiting = self.waiting, []
        for done in waiting:
            done(None, LinkLost("ethercat.interface-gone", interface="eth9"))


class Bench:
    def __init__(self) -> None:
        segment: Any = SimpleNamespace(
            master=SimpleNamespace(),
            slaves=[SimpleNamespace(input=b"", output=b"")],
            socket_fd=None,
            wait_for_frames=lambda _waits: None,
            set_output=lambda _station, _data: None,
        )
        self.lanes = Lanes()
        ring: Any = None
        lanes: Any = self.lanes
        self.exchange = Exchange(segment, ring, lanes, lambda _kind, _station, _text: None)
        axis = AxisLoop(
            1,
            inputs={},
            outputs={},
            output_count=0,
            cycle_s=0.001,
            report=lambda _station, _why: None,
        )
        image = Image(1, axis, lambda _data: (), lambda *_values: b"", 0, 0, 3)
        self.exchange.setups = {1: StationSetup(PDO, PDO, 1_000_000, dc=False, watchdog_ms=50.0)}
        self.exchange._stations = [Station(1)]
        self.exchange._images = [image]
        self.answers: list[str] = []

    def done(self, name: str) -> Done:
        def answered(_result: object, error: DriveError | None) -> None:
            self.answers.append(f"{name} {'well' if error is None else error.code}")

        return answered


def test_a_start_is_answered_when_the_interface_goes() -> None:
    bench = Bench()
    bench.exchange.start(bench.done("start"))
    bench.exchange.abandon()
    bench.lanes.drop()
    assert bench.answers == ["start ethercat.interface-gone"]


@pytest.mark.parametrize("first", ["op", "preop"])
def test_a_start_is_answered_when_a_stop_comes_first(first: str) -> None:
    bench = Bench()
    bench.exchange.start(bench.done("start"))
    bench.exchange.stop(bench.done("stop"))
    bench.exchange.housekeeping()
    to_op, to_preop = bench.lanes.waiting
    for reached in (to_op, to_preop) if first == "op" else (to_preop, to_op):
        reached(None, None)
        assert not bench.exchange.operational
    assert sorted(bench.answers) == ["start ethercat.cyclic-exchange-not-run", "stop well"]


def test_a_stop_is_answered_when_the_exchange_ends_otherwise() -> None:
    bench = Bench()
    bench.exchange.start(bench.done("start"))
    bench.exchange.stop(bench.done("stop"))
    bench.exchange.abandon()
    assert bench.answers == ["stop well"]


def test_every_stop_is_answered() -> None:
    bench = Bench()
    bench.exchange.start(lambda _result, _error: None)
    bench.exchange.stop(bench.done("first"))
    bench.exchange.stop(bench.done("second"))
    bench.exchange.housekeeping()
    bench.exchange.stop(bench.done("third"))
    for done in bench.lanes.waiting[1:]:
        done(None, None)
    assert sorted(bench.answers) == ["first well", "second well", "third well"]


def test_a_start_of_which_two_stations_fail_is_answered_once() -> None:
    bench = Bench()
    exchange = bench.exchange
    exchange.setups[2] = exchange.setups[1]
    exchange._stations = [Station(1), Station(2)]
    exchange.start(bench.done("start"))
    bench.lanes.drop()
    assert bench.answers == ["start ethercat.interface-gone"]
