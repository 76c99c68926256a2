"""Application layer state machine (ETG.1000.6 clause 6.4): requests, checks, error codes."""

from __future__ import annotations

from typing import Protocol

from drivers.virtual.wires.ethercat.controller.registers import ERROR_FLAG, AlCode, AlState

_ALLOWED: dict[AlState, tuple[AlState, ...]] = {
    AlState.INIT: (AlState.PREOP, AlState.BOOT),
    AlState.BOOT: (AlState.INIT,),
    AlState.PREOP: (AlState.INIT, AlState.SAFEOP),
    AlState.SAFEOP: (AlState.INIT, AlState.PREOP, AlState.OP),
    AlState.OP: (AlState.INIT, AlState.PREOP, AlState.SAFEOP),
}

WAIT_NS = 9_000_000_000
"""Longest wait in Safe-Op for outputs and SYNC0 (ETG.2000 default time-out SafeOp to Op)."""


class Application(Protocol):
    """Functions of the slave that the state machine calls before and after a transition."""

    def check(self, target: AlState) -> int:
        """Return the AL status code that forbids ``target``, or 0."""

    def waits_for(self, target: AlState) -> int:
        """Return 0, or the code for a time-out while ``target`` must wait for a condition."""

    def entered(self, old: AlState, new: AlState, code: int) -> None:
        """The state has changed; ``code`` is not 0 if an error caused it."""


class AlStateMachine:
    """State, error flag and AL status code; transitions take ``delay_ns``."""

    def __init__(self, application: Application) -> None:
        self._application = application
        self.state = AlState.INIT
        self.error = False
        self.code = 0
        self.delay_ns = 0
        self.refusals: dict[AlState, int] = {}
        """Injected fault: target states that are refused, with the AL status code."""
        self._target: AlState | None = None
        self._due_ns = 0
        self._give_up_ns = 0

    @property
    def target(self) -> AlState:
        """Requested state, or the present state if no transition is pending."""
        return self.state if self._target is None else self._target

    @property
    def due_ns(self) -> int | None:
        """Time at which a pending transition is checked again."""
        return None if self._target is None else self._due_ns

    @property
    def status(self) -> int:
        """Value of register 130h."""
        return int(self.state) | (ERROR_FLAG if self.error else 0)

    def power_on(self) -> None:
        """Return to Init without error."""
        self.state, self.error, self.code, self._target = AlState.INIT, False, 0, None

    def request(self, control: int, now_ns: int) -> None:
        """Process ``control``, which the master has written to 120h."""
        wanted = control & 0x0F
        acknowledge = bool(control & ERROR_FLAG)
        if self.error and not acknowledge and wanted >= self.state:
            return  # an error must be acknowledged before a higher state is accepted
        if acknowledge:
            self.error, self.code = False, 0
        try:
            target = AlState(wanted)
        except ValueError:
            self._fail(AlCode.UNKNOWN_STATE)
            return
        self._target = None
        if target == self.state:
            self.error, self.code = False, 0
            return
        if target not in _ALLOWED[self.state]:
            self._fail(AlCode.INVALID_TRANSITION)
            return
        self._target = target
        self._due_ns = now_ns + self.delay_ns
        self._give_up_ns = self._due_ns + WAIT_NS
        if not self.delay_ns:
            self.run(now_ns)

    def run(self, now_ns: int) -> None:
        """Complete a pending transition that is due."""
        target = self._target
        if target is None or now_ns < self._due_ns:
            return
        code = self.refusals.get(target) or self._application.check(target)
        if code:
            self._target = None
            self._fail(code)
            return
        if missing := self._application.waits_for(target):
            if now_ns < self._give_up_ns:
                self._due_ns = self._give_up_ns
                return
            self._target = None
            self._fail(missing)
            return
        self._target = None
        self.error, self.code = False, 0
        self._enter(target, 0)

    def retry(self, now_ns: int) -> None:
        """Check a waiting transition again after a frame."""
        if self._target is not None and self._due_ns == self._give_up_ns:
            self._due_ns = now_ns
            self.run(now_ns)

    def fall(self, state: AlState, code: int) -> None:
        """Fall to ``state`` with the error flag set, after an error in operation."""
        self._target = None
        if state < self.state:
            self._enter(state, code)
        self._fail(code)

    def _enter(self, state: AlState, code: int) -> None:
        old, self.state = self.state, state
        self._application.entered(old, state, code)

    def _fail(self, code: int) -> None:
        self.error, self.code = True, int(code)
