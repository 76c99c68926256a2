"""State of a CANopen node and its bus at the time of a refusal: typed facts, no words."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BusFacts:
    """The adapter and the bus. Counts are those of the examination, not since the bus was opened.

    ``acknowledge_errors`` and ``protocol_errors`` are error frames of these classes
    (linux/can/error.h); ``not_sent`` are frames that the adapter could not send.
    """

    open: bool = True
    bus_off: bool = False
    received: int = 0
    acknowledge_errors: int = 0
    protocol_errors: int = 0
    error_passive: int = 0
    not_sent: int = 0
    other_sync: bool = False
    bitrate: int = 0


@dataclass(frozen=True, slots=True)
class CanEvidence:
    """Facts of one node. Times in s; None: not read, or the node does not have it.

    ``answers`` counts the answers to one request; more than one come from several nodes.
    ``refused_key`` is the object that a start of the exchange could not write, ``refused_code`` its
    abort code, ``refused`` the code of the refusal itself (`drivers.errors.DriveError.code`).
    ``collisions`` are identifiers with which both this node and another one send: (COB-ID, other
    node).
    """

    node: int
    bus: BusFacts = BusFacts()
    answers: int = 1
    others: tuple[int, ...] = ()
    same_product: tuple[int, ...] = ()
    started: bool = False
    refused: str = ""
    refused_key: str = ""
    refused_code: int | None = None
    timed_out: bool = False
    state: int | None = None
    heard: bool = False
    alive: bool = True
    guarded: bool = False
    silent_s: float | None = None
    period_s: float | None = None
    boots: int = 0
    toggle_repeated: bool = False
    emergency: int | None = None
    emergency_open: bool = False
    foreign_master: bool = False
    timeout_s: float = 0.0
    slowest_answer_s: float | None = None
    device_type: int | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    known_vendor: int | None = None
    known_product: int | None = None
    known_revision: int | None = None
    sync_cob: int | None = None
    error_register: int | None = None
    status_word: int | None = None
    own_status_word: bool = False
    """The bits of 6041h are not those of CiA 402 (they echo the control word), nor is bit 9."""
    drive_error: int | None = None
    pdos_wanted: int = 0
    pdos_silent: tuple[int, ...] = ()
    collisions: tuple[tuple[int, int], ...] = ()
    own_id: int = 0
