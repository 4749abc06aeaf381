"""What the user sees: one line a phase, warnings with reasons, progress, and the JSON object at the end.

Lines for people go to standard output, or to standard error with `--json`, so that standard output ends with the object
and a pipe gets nothing else.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lcd_flight.errors import Outcome

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as ProgressBar

    from lcd_flight.learning.progress import Progress

LABEL_WIDTH = 11
LINE_PERIOD_S = 10.0


class Terminal:
    """Prints for people, or for programs, as the options say.

    json_line: whether the last line of standard output is a JSON object.
    quiet: whether lines that are neither warnings nor errors are left out.
    color: False for plain text; a pipe gets plain text anyway.
    """

    def __init__(self, *, json_line: bool = False, quiet: bool = False, color: bool = True) -> None:
        self.json_line = json_line
        self.quiet = quiet
        self._color = color
        self._console: Console | None = None
        self._status_shown = False

    @classmethod
    def from_arguments(cls, arguments: Sequence[str]) -> Terminal:
        """The terminal for errors that come before the options are parsed."""
        return cls(json_line="--json" in arguments, color="--no-color" not in arguments)

    @property
    def console(self) -> Console:
        """rich's console on the stream that people read."""
        if self._console is None:
            from rich.console import Console

            self._console = Console(
                file=sys.stderr if self.json_line else sys.stdout,
                no_color=not self._color,
                highlight=False,
                markup=False,
                soft_wrap=True,
            )
        return self._console

    def announce_compilation(self) -> None:
        """Say once that kernels are being compiled, should that be so: it happens on first use and takes a while."""
        from lcd_flight import jit

        told: list[str] = []

        def tell(kernel: str) -> None:
            if not told:
                self.line("COMPILE", "first use of this version: compiling kernels, about half a minute")
            told.append(kernel)

        jit.announce_compilation(tell)

    @property
    def interactive(self) -> bool:
        """Whether a person is watching and can see lines change in place."""
        return self.console.is_terminal and not self.quiet

    def line(self, label: str, text: str, style: str = "") -> None:
        """One line of the story: `CHECK      mission ok: ...`."""
        self.end_status()
        if not self.quiet:
            self.console.print(f"{label:<{LABEL_WIDTH}}", style=f"bold {style}".strip(), end="")
            self.console.print(text, style=style or None)

    def detail(self, text: str) -> None:
        """A line that belongs to the one before."""
        if not self.quiet:
            self.console.print(" " * (LABEL_WIDTH + 2) + text)

    def status(self, text: str) -> None:
        """A line that the next one replaces; only where a person is watching."""
        if self.interactive:
            width = self.console.width
            self.console.file.write(f"\r{' ' * LABEL_WIDTH}{text[: width - LABEL_WIDTH - 1]}\x1b[K")
            self.console.file.flush()
            self._status_shown = True

    def end_status(self) -> None:
        """Take the changing line away."""
        if self._status_shown:
            self.console.file.write("\r\x1b[K")
            self.console.file.flush()
            self._status_shown = False

    def ask(self, text: str) -> None:
        """A question whose answer is typed behind it."""
        self.console.print(" " * (LABEL_WIDTH + 2) + text, end="")
        self.console.file.flush()

    def warn(self, text: str) -> None:
        """A warning; shown even when quiet."""
        self.end_status()
        self.console.print(f" WARN {text}", style="yellow")

    def finish(self, outcome: Outcome, result: Mapping[str, Any]) -> int:
        """Print the JSON object where asked for and return the exit code."""
        if self.json_line:
            print(json.dumps({"outcome": outcome.value, "error": None, **_plain(result)}, allow_nan=False))  # noqa: T201
        return outcome.exit_code

    def fail(self, outcome: Outcome, message: str, result: Mapping[str, Any] | None = None) -> int:
        """Say what went wrong on standard error, print the JSON object where asked for, return the exit code."""
        for text in message.splitlines():
            print(f"error: {text}", file=sys.stderr)  # noqa: T201
        if self.json_line:
            print(json.dumps({"outcome": outcome.value, "error": message, **_plain(result or {})}, allow_nan=False))  # noqa: T201
        return outcome.exit_code

    def progress_bar(self) -> ProgressBar:
        """A progress display for long work; silent where nobody watches."""
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as ProgressBar

        return ProgressBar(
            TextColumn("{task.description:<10}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[note]}"),
            TimeRemainingColumn(),
            console=self.console,
            disable=not self.interactive,
            transient=True,
        )


@contextmanager
def following(terminal: Terminal, label: str) -> Iterator[Callable[[Progress], None]]:
    """Show the progress of long work: a bar for a person, a line every ten seconds for a pipe."""
    if terminal.interactive:
        with terminal.progress_bar() as bar:
            task = bar.add_task(label, total=None, note="")
            yield lambda p: bar.update(task, total=p.total, completed=p.done, note=_rate(p))
        return
    shown_s = time.monotonic()

    def show(progress: Progress) -> None:
        nonlocal shown_s
        if time.monotonic() - shown_s >= LINE_PERIOD_S:
            shown_s = time.monotonic()
            terminal.line(label, f"{progress.done:,}/{progress.total:,} {_rate(progress)}{_left(progress)}")

    yield show


def _rate(progress: Progress) -> str:
    return f"{progress.unit} {progress.note}  {progress.rate:,.0f}/s"


def _left(progress: Progress) -> str:
    """How long it will take, where that is known."""
    return "" if progress.seconds_left is None else f", {progress.seconds_left:,.0f} s left"


def _plain(value: Any) -> Any:
    """The same value as JSON has it: numpy scalars and arrays as numbers and lists, what is not finite as null."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, bool | int | str | None) else str(value)
