"""Application layer state machine (ETG.1000.6 clause 6.4): requests, checks, error codes."""

from __future__ import annotations

from typing import Protocol

from drivers.virtual.wires.ethercat.registers import ERROR_FLAG, AlCode, AlState

_ALLOWED: dict[AlState, tuple[AlState, ...]] = {
    AlState.INIT: (AlState.PREOP, AlState.BOOT),
    AlState.BOOT: (AlState.INIT,),
    AlState.PREOP: (AlState.INIT, AlState.SAFEOP),
    AlState.SAFEOP: (AlState.INIT, AlState.PREOP, AlState.OP),
    AlState.OP: (AlState.INIT, AlState.PREOP, AlState.SAFEOP),
}

WAIT_NS = 9_000_000_000
"""How long Safe-Op waits for outputs and SYNC0 (ETG.2000 default time-out of SafeOp to Op)."""


class Application(Protocol):
    """What the state machine asks of the slave before and after a step."""

    def check(self, target: AlState) -> int:
        """AL status code that forbids ``target``, 0 if nothing does."""

    def waits_for(self, target: AlState) -> int:
        """0, or while ``target`` must wait for something the code to give if it never comes."""

    def entered(self, old: AlState, new: AlState, code: int) -> None:
        """The state has changed; ``code`` is not 0 when an error forced it."""


class AlStateMachine:
    """State, error flag and code; transitions take ``delay_ns``."""

    def __init__(self, application: Application) -> None:
        self._application = application
        self.state = AlState.INIT
        self.error = False
        self.code = 0
        self.delay_ns = 0
        self.refusals: dict[AlState, int] = {}
        """Trouble: target states that are refused, with the code to give."""
        self._target: AlState | None = None
        self._due_ns = 0
        self._give_up_ns = 0

    @property
    def target(self) -> AlState:
        """Where it is heading; the present state when nothing is pending."""
        return self.state if self._target is None else self._target

    @property
    def due_ns(self) -> int | None:
        """When a pending step must be checked again."""
        return None if self._target is None else self._due_ns

    @property
    def status(self) -> int:
        """Value of register 130h."""
        return int(self.state) | (ERROR_FLAG if self.error else 0)

    def power_on(self) -> None:
        """Back to Init without an error."""
        self.state, self.error, self.code, self._target = AlState.INIT, False, 0, None

    def request(self, control: int, now_ns: int) -> None:
        """The master has written ``control`` to 120h."""
        wanted = control & 0x0F
        acknowledge = bool(control & ERROR_FLAG)
        if self.error and not acknowledge and wanted >= self.state:
            return  # an error must be acknowledged before the state may rise again
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
        """Finish a pending step that is due."""
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
        """Something a pending step may be waiting for has happened."""
        if self._target is not None and self._due_ns == self._give_up_ns:
            self._due_ns = now_ns
            self.run(now_ns)

    def fall(self, state: AlState, code: int) -> None:
        """An error of the running slave: down to ``state`` with the error flag."""
        self._target = None
        if state < self.state:
            self._enter(state, code)
        self._fail(code)

    def _enter(self, state: AlState, code: int) -> None:
        old, self.state = self.state, state
        self._application.entered(old, state, code)

    def _fail(self, code: int) -> None:
        self.error, self.code = True, int(code)
