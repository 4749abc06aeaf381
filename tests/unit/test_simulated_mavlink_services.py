"""Parameters, commands, intervals, requests, clocks and target ids of the simulated MAVLink vehicle."""

from __future__ import annotations

import math
import struct

import pytest
from pymavlink.dialects.v20 import common
from virtual_mavlink import (
    ACCEPTED,
    ARM,
    DENIED,
    FAILED,
    INTERVAL,
    PX4_LOITER,
    REQUEST,
    SET_MODE,
    UNSUPPORTED,
    Client,
)

BOTH = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
ATTITUDE, LOCAL_POSITION, VERSION, INTERVAL_OF = 30, 32, 148, 510


def as_int(value: float) -> int:
    """The bytes of a float as an int."""
    told: int = struct.unpack("<i", struct.pack("<f", value))[0]
    return told


def as_float(value: int) -> float:
    """The bytes of an int as a float."""
    told: float = struct.unpack("<f", struct.pack("<i", value))[0]
    return told


@BOTH
def test_parameters_are_read_by_name_and_by_number(flavour: str) -> None:
    client = Client(flavour)
    by_number = client.read("", 3)
    assert by_number is not None
    by_name = client.read(by_number.param_id)
    assert by_name is not None
    assert by_name.param_index == 3
    assert by_name.param_value == by_number.param_value


def test_px4_puts_the_bytes_of_an_int_into_the_float() -> None:
    client = Client()
    answer = client.read("EKF2_EV_CTRL")
    assert answer is not None
    assert (as_int(answer.param_value), answer.param_type) == (15, 6)
    written = client.write("EKF2_EV_CTRL", as_float(-1), 6)
    assert written is not None
    assert client.vehicle.parameters["EKF2_EV_CTRL"] == -1


def test_ardupilot_casts_an_int() -> None:
    client = Client("ardupilot")
    answer = client.read("GUID_OPTIONS")
    assert answer is not None
    assert (answer.param_value, answer.param_type) == (8.0, 6)
    written = client.write("VISO_TYPE", 300.0, 2)
    assert written is not None
    assert written.param_value == 127.0, "an 8-bit int"


def test_ardupilot_answers_after_a_while() -> None:
    client = Client("ardupilot")
    client.send(common.MAVLink_param_request_read_message(1, 1, b"VISO_TYPE", -1))
    client.wait(80)
    assert not client.of("PARAM_VALUE")
    client.wait(40)
    assert client.of("PARAM_VALUE")


@BOTH
def test_an_unknown_name_gets_no_answer(flavour: str) -> None:
    client = Client(flavour)
    assert client.read("NO_SUCH") is None
    assert client.write("NO_SUCH", 1.0, 9) is None
    told = [text for text in client.texts if "unknown" in text]
    assert told == ([] if flavour == "ardupilot" else ["[pm] unknown param: NO_SUCH"])


def test_px4_has_a_text_for_an_unknown_number() -> None:
    client = Client()
    assert client.read("", 999) is None
    assert "[pm] unknown param ID: 999" in client.texts


@BOTH
def test_newer_firmware_says_that_there_is_no_such_parameter(flavour: str) -> None:
    client = Client(flavour, param_error=True)
    assert client.read("NO_SUCH") is None
    (error,) = client.of("PARAM_ERROR")
    assert (error.param_id, error.error, error.target_system, error.target_component) == ("NO_SUCH", 1, 245, 191)


def test_px4_takes_no_other_type() -> None:
    client = Client()
    assert client.write("EKF2_EV_CTRL", 0.0, 9) is None
    assert client.vehicle.parameters["EKF2_EV_CTRL"] == 15


@BOTH
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_not_finite_is_no_value(flavour: str, value: float) -> None:
    client = Client(flavour)
    name = "COM_OF_LOSS_T" if flavour == "px4" else "GUID_TIMEOUT"
    assert client.write(name, value, 9) is None
    assert client.vehicle.parameters[name] == 0.5


@BOTH
def test_the_list_is_complete(flavour: str) -> None:
    client = Client(flavour)
    client.send(common.MAVLink_param_request_list_message(1, 1))
    client.wait(500)
    values = client.of("PARAM_VALUE")
    numbered = [value for value in values if value.param_index != 65535]
    assert [value.param_index for value in numbered] == list(range(values[0].param_count))
    assert (values[0].param_id == "_HASH_CHECK") == (flavour == "px4")


def test_writing_the_hash_ends_px4s_list() -> None:
    client = Client()
    client.send(common.MAVLink_param_request_list_message(1, 1))
    client.send(common.MAVLink_param_set_message(1, 1, b"_HASH_CHECK", 0.0, 5))
    client.wait(500)
    assert len(client.of("PARAM_VALUE")) < 20


def test_the_hash_changes_with_a_value() -> None:
    client = Client()
    before = client.read("_HASH_CHECK")
    client.write("COM_OF_LOSS_T", 0.7, 9)
    after = client.read("_HASH_CHECK")
    assert before is not None
    assert after is not None
    assert before.param_value != after.param_value


@BOTH
def test_parameters_outlive_a_reboot(flavour: str) -> None:
    client = Client(flavour)
    client.write("COM_OF_LOSS_T" if flavour == "px4" else "GUID_TIMEOUT", 0.25, 9)
    assert client.command(246, 1) == ACCEPTED
    client.wait(300)
    assert client.vehicle.parameters["COM_OF_LOSS_T" if flavour == "px4" else "GUID_TIMEOUT"] == 0.25


@BOTH
def test_an_interval_is_set_read_back_and_ended(flavour: str) -> None:
    client = Client(flavour)
    assert client.command(INTERVAL, ATTITUDE, 20_000) == ACCEPTED
    client.forget()
    client.wait(1000)
    assert len(client.of("ATTITUDE")) == pytest.approx(50, abs=1)
    assert client.command(INTERVAL_OF, ATTITUDE) == ACCEPTED
    assert client.of("MESSAGE_INTERVAL")[-1].interval_us == 20_000
    assert client.command(INTERVAL, ATTITUDE, -1) == ACCEPTED
    client.forget()
    client.wait(1000)
    assert not client.of("ATTITUDE")
    assert client.command(INTERVAL_OF, ATTITUDE) == ACCEPTED
    assert client.of("MESSAGE_INTERVAL")[-1].interval_us == -1


@BOTH
def test_an_interval_is_never_longer_than_can_be_told(flavour: str) -> None:
    client = Client(flavour)
    assert client.command(INTERVAL, ATTITUDE, 1e30) == ACCEPTED
    assert client.command(INTERVAL_OF, ATTITUDE) == ACCEPTED
    assert client.of("MESSAGE_INTERVAL")[-1].interval_us == 2**31 - 1


def test_interval_zero_is_as_after_a_boot() -> None:
    client = Client()
    client.command(INTERVAL, ATTITUDE, -1)
    client.command(INTERVAL, ATTITUDE, 0)
    client.forget()
    client.wait(1000)
    assert len(client.of("ATTITUDE")) == pytest.approx(50, abs=1)


@BOTH
@pytest.mark.parametrize("kind", [99_999, math.nan, 1e30])
def test_messages_that_there_are_not(flavour: str, kind: float) -> None:
    client = Client(flavour)
    for command in (INTERVAL, REQUEST, INTERVAL_OF):
        assert client.command(command, kind, 1000) == FAILED


@BOTH
def test_a_message_is_sent_once_on_request(flavour: str) -> None:
    client = Client(flavour)
    assert client.command(REQUEST, VERSION) == ACCEPTED
    (version,) = client.of("AUTOPILOT_VERSION")
    assert version.flight_sw_version >> 16 == (0x0110 if flavour == "px4" else 0x0406)
    assert client.command(520, 1) == ACCEPTED


@BOTH
def test_unknown_commands_are_unsupported(flavour: str) -> None:
    assert Client(flavour).command(31_000) == UNSUPPORTED


@BOTH
def test_commands_for_others_are_not_answered(flavour: str) -> None:
    client = Client(flavour)
    assert client.command(REQUEST, VERSION, system=2) is None
    assert client.command(REQUEST, VERSION, component=50) is None
    assert client.command(REQUEST, VERSION, system=0, component=0) == ACCEPTED


@BOTH
def test_an_acknowledgement_names_whom_it_is_for(flavour: str) -> None:
    client = Client(flavour)
    client.command(REQUEST, VERSION)
    ack = client.of("COMMAND_ACK")[-1]
    assert (ack.command, ack.target_system, ack.target_component) == (REQUEST, 245, 191)


@BOTH
def test_a_resent_command_is_done_and_answered_again(flavour: str) -> None:
    client = Client(flavour)
    for confirmation in range(2):
        client.send(common.MAVLink_command_long_message(1, 1, REQUEST, confirmation, VERSION, 0, 0, 0, 0, 0, 0))
    client.wait(10)
    assert [ack.result for ack in client.of("COMMAND_ACK")] == [ACCEPTED, ACCEPTED]


@BOTH
def test_command_int_does_the_same(flavour: str) -> None:
    client = Client(flavour)
    client.send(common.MAVLink_command_int_message(1, 1, 0, REQUEST, 0, 0, VERSION, 0, 0, 0, 0, 0, 0))
    client.wait(10)
    assert client.of("AUTOPILOT_VERSION")


def test_the_older_set_mode_message() -> None:
    px4, copter = Client(), Client("ardupilot")
    px4.send(common.MAVLink_set_mode_message(1, 1, PX4_LOITER))
    copter.send(common.MAVLink_set_mode_message(1, 1, 20))
    copter.send(common.MAVLink_set_mode_message(1, 0, 4))
    for client in (px4, copter):
        client.wait(10)
    assert px4.pilot.mode == PX4_LOITER
    assert not px4.of("COMMAND_ACK")
    assert [(ack.command, ack.result) for ack in copter.of("COMMAND_ACK")] == [(11, ACCEPTED), (11, DENIED)]


def test_px4_takes_129_for_the_custom_flag() -> None:
    client = Client()
    client.wait(100)
    assert client.command(SET_MODE, 129, 4, 3) == ACCEPTED
    assert client.command(SET_MODE, 128, 4, 3) == UNSUPPORTED
    assert client.command(SET_MODE, math.nan) == UNSUPPORTED


@BOTH
def test_it_asks_for_the_clients_clock(flavour: str) -> None:
    client = Client(flavour)
    client.wait(100)
    asked = client.of("TIMESYNC")[0]
    assert asked.tc1 == 0
    client.forget()
    client.send(common.MAVLink_timesync_message(123, asked.ts1))
    assert not client.of("TIMESYNC"), "an answer is not answered"


def test_a_clock_that_just_began_is_no_question() -> None:
    client = Client()
    client.send(common.MAVLink_timesync_message(0, 77))
    assert [(told.tc1, told.ts1) for told in client.of("TIMESYNC")] == [(1, 77)]


@BOTH
def test_system_time_is_the_date(flavour: str) -> None:
    client = Client(flavour)
    client.wait(2000)
    assert client.command(REQUEST, 2) == ACCEPTED
    told = client.of("SYSTEM_TIME")[-1]
    assert told.time_unix_usec == pytest.approx(1_767_225_602_000_000, abs=20_000)
    assert told.time_boot_ms == pytest.approx(2000, abs=20)


@BOTH
def test_battery_and_landed_state_are_told(flavour: str) -> None:
    client = Client(flavour)
    for kind in (1, 147, 245, 242, 31, 331):
        client.wait(500)
        assert client.command(REQUEST, kind) == ACCEPTED
    client.wait(3000)
    assert client.of("SYS_STATUS")[-1].voltage_battery == pytest.approx(4160, abs=30)
    assert client.of("BATTERY_STATUS")[-1].battery_remaining == 100
    assert client.of("EXTENDED_SYS_STATE")[-1].landed_state == common.MAV_LANDED_STATE_ON_GROUND
    client.take_off()
    assert client.command(REQUEST, 245) == ACCEPTED
    assert client.of("EXTENDED_SYS_STATE")[-1].landed_state == common.MAV_LANDED_STATE_IN_AIR


def test_a_long_text_comes_in_pieces() -> None:
    client = Client()
    client.wait(10)
    client.forget()
    client.pilot.say(6, "x" * 120)
    client.wait(10)
    pieces = client.of("STATUSTEXT")
    assert [(piece.chunk_seq, len(piece.text)) for piece in pieces] == [(0, 50), (1, 50), (2, 20)]
    assert len({piece.id for piece in pieces} - {0}) == 1
    assert client.texts == ["x" * 120]


def test_flight_termination_stops_the_motors() -> None:
    client = Client()
    client.take_off()
    assert client.command(185, 1) == ACCEPTED
    assert not client.pilot.armed


def test_a_flood_of_requests_is_bounded() -> None:
    client = Client("ardupilot")
    for _ in range(2_000):
        client.send(common.MAVLink_param_request_read_message(1, 1, b"VISO_TYPE", -1))
    client.wait(1000)
    assert len(client.of("PARAM_VALUE")) == 500


@BOTH
def test_arming_is_done_by_everybody_at_once(flavour: str) -> None:
    """System 0 is all of them."""
    client = Client(flavour)
    client.wait(100)
    client.mode(PX4_LOITER if flavour == "px4" else 20)
    assert client.command(ARM, 1, system=0) == ACCEPTED
