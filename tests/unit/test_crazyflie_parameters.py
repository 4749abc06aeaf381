"""The parameter service, byte by byte: what crazyflie-firmware's param_logic.c answers."""

from __future__ import annotations

import pytest

from sim_bridge.crazyflie.crtp import decode, encode
from sim_bridge.crazyflie.kinds import F32, U8, U16
from sim_bridge.crazyflie.parameters import Parameter, Parameters


@pytest.fixture
def service() -> Parameters:
    return Parameters(
        [
            Parameter("flightmode", "stabModeYaw", U8, 0),
            Parameter("locSrv", "extPosStdDev", F32, 0.01),
            Parameter("cpu", "flash", U16, 1024, read_only=True),
            Parameter("stabilizer", "estimator", U8, 1, persistent=True),
        ]
    )


def answer(service: Parameters, request: str) -> str:
    packet = decode(bytes.fromhex(request))
    assert packet is not None
    return " ".join(encode(said).hex().upper() for said in service.answer(packet))


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        # number, type and flags, group, name
        ("2C 02 0000", "2C020000" + "28" + b"flightmode\0stabModeYaw\0".hex().upper()),
        ("2C 02 0100", "2C020100" + "26" + b"locSrv\0extPosStdDev\0".hex().upper()),
        ("2C 02 0200", "2C020200" + "69" + b"cpu\0flash\0".hex().upper()),
        ("2C 02 0300", "2C020300" + "38" + b"stabilizer\0estimator\0".hex().upper()),
        ("2C 02 0400", "2C02"),  # there is no fifth
        ("2D 0000", "2D00000000"),
        ("2D 0100", "2D0100000AD7233C"),
        ("2D 0200", "2D0200000004"),
        ("2D 0400", "2D040002"),  # ENOENT
        ("2E 0000 01", "2E000001"),
        ("2E 0100 0000003F", "2E01000000003F"),
        ("2E 0400 01", "2E040002"),
        ("2E 0200 0100", ""),  # read-only: silence
        ("2E 0100 00", ""),  # too short to be a float
        ("2F 07 0300", "2F0703000001"),  # extended type: persistent
        ("2F 07 0000", "2F07000002"),
        ("2F 02 0300", "2F02030001"),  # as older clients ask
        ("2F 08 0100", "2F080100000AD7233C"),  # default value
        ("2F 08 0200", "2F08020002"),
        ("2F 06 0000", "2F06000000"),
        ("2F 07 0900", "2F07090002"),
        ("2F 04 0300", "2F0403000001"),  # nothing stored, default 1
        ("2F 04 0000", "2F04000002"),
        ("2F 09 0000", ""),
        ("2F", ""),
        ("2D 00", ""),
        ("2C 01", ""),  # the old form of the table is not spoken
    ],
)
def test_answers(service: Parameters, request_: str, said: str) -> None:
    assert answer(service, request_) == said


def test_the_table_says_how_long_it_is_and_has_a_checksum_of_its_own(service: Parameters) -> None:
    assert answer(service, "2C 03") == "2C030400" + service.checksum.to_bytes(4, "little").hex().upper()


def test_the_checksum_changes_with_the_table(service: Parameters) -> None:
    assert Parameters([Parameter("flightmode", "stabModeYaw", U8, 0)]).checksum != service.checksum


def test_what_was_written_is_read_back(service: Parameters) -> None:
    answer(service, "2E 0100 0000003F")
    assert service["locSrv.extPosStdDev"] == 0.5
    assert answer(service, "2D 0100") == "2D0100000000003F"


@pytest.mark.parametrize(
    ("type_and_value", "error", "value"),
    [("06 0000003F", "00", 0.5), ("08 01", "16", 0.01), ("06 00", "16", 0.01)],
)
def test_setting_by_name(service: Parameters, type_and_value: str, error: str, value: float) -> None:
    name = b"locSrv\0extPosStdDev\0".hex().upper()
    assert answer(service, f"2F 00 {name} {type_and_value}") == f"2F00{name}{error}"
    assert service["locSrv.extPosStdDev"] == pytest.approx(value)


@pytest.mark.parametrize(("name", "error"), [(b"cpu\0flash\0", "0D"), (b"no\0such\0", "02")])
def test_setting_by_name_what_cannot_be_set(service: Parameters, name: bytes, error: str) -> None:
    assert answer(service, f"2F 00 {name.hex()} 09 0100") == f"2F00{name.hex().upper()}{error}"


def test_what_is_stored_outlives_a_reboot_and_the_rest_does_not(service: Parameters) -> None:
    answer(service, "2E 0300 02")
    answer(service, "2E 0000 01")
    assert answer(service, "2F 03 0300") == "2F03030000"
    assert answer(service, "2F 04 0300") == "2F040300010102"
    service.reboot()
    assert (service["stabilizer.estimator"], service["flightmode.stabModeYaw"]) == (2, 0)
    assert answer(service, "2F 05 0300") == "2F05030000"
    service.reboot()
    assert service["stabilizer.estimator"] == 1


def test_what_is_not_persistent_cannot_be_stored(service: Parameters) -> None:
    assert answer(service, "2F 03 0000") == "2F03000002"


def test_a_change_from_within_is_told(service: Parameters) -> None:
    assert encode(service.updated("flightmode.stabModeYaw", 1)).hex().upper() == "2F01000001"
