"""The log service, byte by byte: what crazyflie-firmware's log.c answers and sends."""

from __future__ import annotations

import pytest

from sim_bridge.crazyflie.crtp import decode, encode
from sim_bridge.crazyflie.kinds import F32, I16, U16
from sim_bridge.crazyflie.logs import MAX_BLOCKS, Logs, LogVariable

Values = dict[str, float]


@pytest.fixture
def service() -> Logs[Values]:
    return Logs(
        [
            LogVariable("pm", "vbat", F32, lambda seen: seen["vbat"]),
            LogVariable("motor", "m1", U16, lambda seen: seen["m1"]),
            LogVariable("stateEstimateZ", "x", I16, lambda seen: seen["x"]),
        ]
    )


def answer(service: Logs[Values], request: str, now_ms: int = 0) -> str:
    packet = decode(bytes.fromhex(request))
    assert packet is not None
    return " ".join(encode(said).hex().upper() for said in service.answer(packet, now_ms))


def data(service: Logs[Values], now_ms: int) -> list[str]:
    seen = {"vbat": 4.0, "m1": 38842.0, "x": -2.0}
    return [encode(packet).hex().upper() for packet in service.due(now_ms, lambda: seen)]


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ("5C 02 0000", "5C020000" + "07" + b"pm\0vbat\0".hex().upper()),
        ("5C 02 0100", "5C020100" + "02" + b"motor\0m1\0".hex().upper()),
        ("5C 02 0300", "5C02"),
        ("5D 05", "5D050000"),
        ("5D 06 01 070000 020100", "5D060100"),
        ("5D 06 01 070900", "5D060102"),  # no such variable
        ("5D 06 01 0F0000", "5D060102"),  # no such type
        ("5D 06 01 07FFFF", "5D060102"),  # raw memory
        ("5D 03 07 0A", "5D030702"),  # no such block
        ("5D 04 07", "5D040702"),
        ("5D 02 07", "5D020702"),
        ("5D 07 07 070000", "5D070702"),
        ("5D 00 01", "5D000108"),  # ENOEXEC: the commands before version 2
        ("5D", ""),
        ("5E 01", ""),
    ],
)
def test_answers(service: Logs[Values], request_: str, said: str) -> None:
    assert answer(service, request_) == said


def test_the_table_says_how_long_it_is_its_checksum_and_the_limits(service: Logs[Values]) -> None:
    checksum = service.checksum.to_bytes(4, "little").hex().upper()
    assert answer(service, "5C 03") == f"5C030300{checksum}1080"


def test_a_block_sends_its_variables_at_its_period(service: Logs[Values]) -> None:
    answer(service, "5D 06 09 070000 020100")
    assert answer(service, "5D 03 09 02", now_ms=70_000) == "5D030900"  # 20 ms
    assert data(service, 70_018) == []
    assert data(service, 70_020) == ["5E09" + "841101" + "00008040" + "BA97"]
    assert data(service, 70_038) == []
    assert len(data(service, 70_040)) == 1


def test_a_variable_is_sent_as_the_type_that_is_asked_for(service: Logs[Values]) -> None:
    answer(service, "5D 06 01 080000 010100 040200")  # FP16, uint8, int8
    answer(service, "5D 03 01 01")
    assert data(service, 10) == ["5E01" + "0A0000" + "0044" + "FF" + "FE"]


def test_milliseconds_by_the_newer_command_and_zero_for_one_packet(service: Logs[Values]) -> None:
    answer(service, "5D 06 01 070000")
    answer(service, "5D 08 01 0500")
    assert [len(data(service, ms)) for ms in (4, 5, 9, 10)] == [0, 1, 0, 1]
    answer(service, "5D 08 01 0000", now_ms=12)
    assert [len(data(service, ms)) for ms in (12, 14, 100)] == [1, 0, 0]


def test_stopped_deleted_and_reset_blocks_are_silent(service: Logs[Values]) -> None:
    for number in ("01", "02", "03"):
        answer(service, f"5D 06 {number} 070000")
        answer(service, f"5D 03 {number} 01")
    answer(service, "5D 04 01")
    answer(service, "5D 02 02")
    assert [packet[:4] for packet in data(service, 10)] == ["5E03"]
    answer(service, "5D 05")
    assert data(service, 1000) == []


def test_a_block_twice_is_refused(service: Logs[Values]) -> None:
    answer(service, "5D 06 01 070000")
    assert answer(service, "5D 06 01 070000") == "5D060111"  # EEXIST


def test_a_block_holds_26_bytes(service: Logs[Values]) -> None:
    assert answer(service, "5D 06 01" + "070000" * 6) == "5D060100"
    assert answer(service, "5D 07 01 020100") == "5D070100"
    assert answer(service, "5D 07 01 020100") == "5D070107"  # E2BIG


def test_there_are_16_blocks(service: Logs[Values]) -> None:
    for number in range(MAX_BLOCKS):
        assert answer(service, f"5D 06 {number:02X} 070000") == f"5D06{number:02X}00"
    assert answer(service, "5D 06 20 070000") == "5D06200C"  # ENOMEM


def test_there_are_128_variables(service: Logs[Values]) -> None:
    for number in range(15):
        answer(service, f"5D 06 {number:02X}" + "010100" * 9)
    assert service.size == 128
    assert answer(service, "5D 07 00 010100") == "5D07000C"
