"""A flight's description for those who watch it live: the same metadata and attachments that its log begins with."""

from __future__ import annotations

import msgspec

from lcd_flight.record.header import FlightHeader, attachments, header_from, metadata
from lcd_flight.wire.live_frame import LiveFlight


def live_flight(header: FlightHeader) -> LiveFlight:
    """What is published of a header."""
    files = {name: data.decode() for name, (_, data) in attachments(header).items()}
    return LiveFlight(metadata=metadata(header), attachments=files)


def live_header(flight: LiveFlight) -> FlightHeader:
    """The header that `live_flight` was given.

    Raises:
        ValueError: it is of another version.
    """
    try:
        return header_from(flight.metadata, {name: text.encode() for name, text in flight.attachments.items()})
    except (KeyError, msgspec.MsgspecError) as error:
        raise ValueError(f"the flight's description is not as this version writes it: {error}") from error
