"""`lcd sim VEHICLE`: a simulated vehicle that behaves like the real one and waits for a program to connect."""

from __future__ import annotations

import typer

from lcd_flight.cli import sim_crazyflie, sim_mavlink

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Serve a simulated vehicle that behaves like the real one: a full bench without hardware.",
)
app.command("crazyflie")(sim_crazyflie.crazyflie)
app.command("mavlink")(sim_mavlink.mavlink)


@app.callback()
def _vehicles() -> None:
    """Keep the vehicle's name in the command, be there one or several."""
