"""One exception tree, mapped to exit codes at the command line; what can fail in flight is a value instead."""

from __future__ import annotations

from enum import StrEnum


class Outcome(StrEnum):
    """How a command ended: the closed list behind `outcome` in every `--json` line."""

    OK = "ok"
    """A command that flies nothing did its work."""
    LANDED = "landed"
    """The mission was completed and the vehicle landed."""
    INVALID_INPUT = "invalid_input"
    REFUSED = "refused"
    """Refused before arming: rehearsal, pre-flight, a port or a folder that is not to be had."""
    ABORTED = "aborted"
    """Ended early but landed."""
    INTERRUPTED = "interrupted"
    """Long work was stopped by the user; running the command again goes on where it stopped."""
    CRASHED = "crashed"
    CUT = "cut"
    """Motors were stopped in the air, or a descent without pose ran its time."""
    DIFFERENT = "different"
    """A comparison came out otherwise than it should: `lcd replay`."""
    INTERNAL_ERROR = "internal_error"
    """A fault of ours."""

    @property
    def exit_code(self) -> int:
        """The process's exit code (design: command line)."""
        return _EXIT_CODES[self]


_EXIT_CODES = {
    Outcome.OK: 0,
    Outcome.LANDED: 0,
    Outcome.INVALID_INPUT: 2,
    Outcome.REFUSED: 3,
    Outcome.ABORTED: 4,
    Outcome.INTERRUPTED: 130,
    Outcome.CRASHED: 5,
    Outcome.CUT: 5,
    Outcome.DIFFERENT: 1,
    Outcome.INTERNAL_ERROR: 70,
}


class LcdError(Exception):
    """Base of all errors that a user may see; its text is one clear line for each problem, remedy included."""

    outcome = Outcome.INTERNAL_ERROR


class InputError(LcdError):
    """What the user gave is wrong: a file, a key, an option. Exit code 2."""

    outcome = Outcome.INVALID_INPUT


class RefusedError(LcdError):
    """Flight was refused before arming, or something it needs is not to be had. Exit code 3."""

    outcome = Outcome.REFUSED
