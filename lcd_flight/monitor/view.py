"""The terminal's view of a flight that is being watched."""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from lcd_flight.model import LinkReport, Phase, PoseReport, Severity
from lcd_flight.monitor.picture import Line, Picture
from lcd_flight.wire.live_frame import LiveReport

SILENT_S = 1.0
"""After so long without a report the view says so."""
LOSSY = 0.1
OLD_POSE_NS = 50_000_000
"""Red from here on: what the eye should fall upon, not what the flight judges by."""

_ABNORMAL = (Phase.BRAKE_HOLD, Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.HANDED_OVER, Phase.KILL, Phase.CRASHED)


def render(picture: Picture, now_s: float) -> RenderableType:
    """All that there is to see at `now_s`."""
    if picture.report is None:
        return Text("waiting for a flight", style="dim")
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim", min_width=9)
    table.add_column()
    for label, text in rows(picture, picture.report, now_s):
        table.add_row(label, text)
    parts: list[RenderableType] = [table]
    if picture.lines:
        parts += [Text(""), *(_line(line) for line in picture.lines)]
    return Panel(Group(*parts), title=_title(picture), title_align="left")


def rows(picture: Picture, report: LiveReport, now_s: float) -> list[tuple[str, Text]]:
    """Label and text of each row. report: the picture's newest."""
    inputs = report.inputs
    found = [
        ("phase", _phase(picture, report)),
        ("position", _position(inputs.pose)),
        ("error", _error(picture, report)),
        ("battery", _battery(inputs.link)),
        ("link", _link(inputs.link)),
        ("mocap", _mocap(inputs.pose)),
        ("loop", _loop(picture)),
    ]
    silent_s = now_s - picture.received_s
    if silent_s > SILENT_S:
        found.insert(0, ("stream", Text(f"silent for {silent_s:.0f} s", style="bold red")))
    return found


def status(picture: Picture, report: LiveReport) -> str:
    """The view in one line, for a pipe."""
    return "  ".join(text.plain for _, text in rows(picture, report, picture.received_s))


def _title(picture: Picture) -> str:
    header = picture.header
    return "flight" if header is None else f"{header.name}  {header.vehicle.name}  {header.link}"


def _phase(picture: Picture, report: LiveReport) -> Text:
    leg = picture.leg
    style = "bold red" if report.tick.phase in _ABNORMAL else "bold green"
    text = Text(report.tick.phase.value.upper(), style=style)
    if leg is not None and picture.header is not None:
        time_s, count = report.tick.leg_time_s, len(picture.header.plan.legs)
        where = f"{time_s:.1f}/{leg.duration_s:.1f} s" if time_s <= leg.duration_s else "settling"
        text.append(f"  {leg.kind.value} {where}  leg {report.tick.leg + 1} of {count}", style="default")
    return text.append(f"  t {picture.time_s:.1f} s", style="dim")


def _position(pose: PoseReport) -> Text:
    if pose.state is None:
        return Text("no valid pose", style="bold red")
    x, y, z = pose.state.p_WB
    return Text(f"{x:+.2f} {y:+.2f} {z:+.2f} m  {math.hypot(*pose.state.v_WB_W):.2f} m/s")


def _error(picture: Picture, report: LiveReport) -> Text:
    if report.tick.position_error_W is None:
        return Text("no reference", style="dim")
    error_m = math.hypot(*report.tick.position_error_W)
    limit_m = None if picture.header is None else picture.header.limits.max_position_error_m
    style = "red" if limit_m is not None and error_m > 0.5 * limit_m else "default"
    limit = "" if limit_m is None else f", limit {limit_m:.2f}"
    return Text(f"{error_m:.3f} m  (largest {report.max_error_m:.3f}{limit})", style=style)


def _battery(link: LinkReport) -> Text:
    volts = None if link.telemetry is None else link.telemetry.battery_V
    return Text("not known", style="dim") if volts is None else Text(f"{volts:.2f} V")


def _link(link: LinkReport) -> Text:
    if not link.connected:
        return Text("not connected", style="bold red")
    age = "" if link.age_ns is None else f"age {link.age_ns * 1e-6:.0f} ms  "
    text = Text(
        f"{age}loss {link.loss_share:.1%}  sent {link.sent}", style="red" if link.loss_share > 0.1 else "default"
    )
    return text.append("  FALLBACK", style="bold red") if link.fallback_active else text


def _mocap(pose: PoseReport) -> Text:
    age = "no frame yet" if pose.age_ns is None else f"age {max(pose.age_ns, 0) * 1e-6:.0f} ms"
    reason = f" ({pose.reject_reason})" if pose.reject_reason else ""
    return Text(
        f"{pose.rate_hz:.0f} Hz  {age}  lost {pose.lost}  late {pose.late}  rejected {pose.rejected}{reason}",
        style="red" if pose.age_ns is None or pose.age_ns > OLD_POSE_NS else "default",
    )


def _loop(picture: Picture) -> Text:
    timing = picture.timing
    return Text(
        f"{timing.rate_hz:.1f} Hz  latest {timing.max_lateness_s * 1e3:.2f} ms  missed {timing.missed}",
        style="red" if timing.missed else "default",
    )


def _line(line: Line) -> Text:
    """A finding or a message."""
    if line.finding is None:
        return Text(f"{line.time_s:7.1f} s  {line.text}", style="dim")
    severity = line.finding.severity
    style = "red" if severity > Severity.WARN else "yellow" if severity is Severity.WARN else "default"
    return Text(f"{line.time_s:7.1f} s  {severity.name} {line.text}", style=style)
