"""Connecting, arming, stopping and leaving over the MAVLink link, and all ways in which it is refused, with reasons."""

from __future__ import annotations

import asyncio
import hashlib
from dataclasses import replace
from pathlib import Path

import pytest
from mavlink_bench import CLOCK, MS, PEER, VEHICLE, Bench, bench, kind_of, level, run, stream, wait_s

from drivers.mavlink import signing
from drivers.mavlink.dialect import mavlink
from drivers.mavlink.link import MavlinkLink
from lcd_flight.model import RefusedError

FLAVOURS = ["px4", "ardupilot"]

pytestmark = pytest.mark.usefixtures("own_state")


@pytest.fixture
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Signing timestamps are kept here, not among the user's own."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


SETPOINT, COMMAND, PARAM_SET, ORIGIN, ODOMETRY = 82, 76, 23, 48, 331
WRONG = {
    "px4": {
        "COM_OF_LOSS_T": (1.0, "COM_OF_LOSS_T is 1, set it to 0.5 (at most 0.5): s; so long it goes on"),
        "COM_OBL_RC_ACT": (0, "COM_OBL_RC_ACT is 0, set it to 4: it lands"),
        "MAV_FWDEXTSP": (0, "MAV_FWDEXTSP is 0, set it to 1"),
        "EKF2_EV_CTRL": (1, "EKF2_EV_CTRL is 1, set it to 15 (with the bits of 11)"),
        "EKF2_HGT_REF": (1, "EKF2_HGT_REF is 1, set it to 3, then restart the autopilot"),
        "EKF2_GPS_CTRL": (7, "EKF2_GPS_CTRL is 7, set it to 0"),
    },
    "ardupilot": {
        "GUID_OPTIONS": (0, "GUID_OPTIONS is 0, set it to 8 (with the bits of 8): thrust is thrust"),
        "GUID_TIMEOUT": (3.0, "GUID_TIMEOUT is 3, set it to 0.5 (at most 0.5)"),
        "VISO_TYPE": (0, "VISO_TYPE is 0, set it to 1, then restart the autopilot"),
        "EK3_SRC1_POSXY": (3, "EK3_SRC1_POSXY is 3, set it to 6, then restart the autopilot"),
        "EK3_SRC1_VELXY": (3, "EK3_SRC1_VELXY is 3"),
        "EK3_SRC1_POSZ": (1, "EK3_SRC1_POSZ is 1"),
        "EK3_SRC1_VELZ": (3, "EK3_SRC1_VELZ is 3"),
        "EK3_SRC1_YAW": (1, "EK3_SRC1_YAW is 1"),
    },
}


async def refusal(made: Bench, given: str = "", **changes: object) -> str:
    """Why it does not connect."""
    with pytest.raises(RefusedError) as refused:
        async with made.link(given, **changes):
            pass
    assert made.air.receive is None
    return str(refused.value)


async def arming_refusal(link: MavlinkLink) -> str:
    with pytest.raises(RefusedError) as refused:
        await link.arm()
    return str(refused.value)


def commands(made: Bench, command: int) -> list[bytes]:
    """Of one kind, that were sent."""
    return [data for _, data in made.air.sent(COMMAND) if int.from_bytes(data[38:40], "little") == command]


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_factory_fresh_autopilot_is_refused_with_a_list_of_all_that_is_wrong(flavour: str) -> None:
    async def main() -> None:
        async with bench(flavour, defaults="factory") as made:
            text = await refusal(made)
            wrong = {name: line for name, (_, line) in WRONG[flavour].items() if name != "MAV_FWDEXTSP"}
            assert all(line.split(",")[0].split(" is ")[0] in text for line in wrong.values())
            assert len(text.splitlines()) == len(wrong) + ((flavour == "px4" and 1) or 1)
            assert "nothing was changed" in text
            assert made.air.sent(PARAM_SET) == []
            assert made.air.sent(SETPOINT) == []

    run(main)


@pytest.mark.parametrize(("flavour", "name"), [(flavour, name) for flavour, wrong in WRONG.items() for name in wrong])
def test_each_wrong_parameter_is_refused_by_name_with_value_and_reason(flavour: str, name: str) -> None:
    async def main() -> None:
        value, line = WRONG[flavour][name]
        async with bench(flavour, age_s=1.0) as made:
            made.vehicle.parameters.put(name, value)
            text = await refusal(made)
            assert line in text
            assert len(text.splitlines()) == 2

    run(main)


def test_what_needs_no_restart_is_set_where_that_was_asked_for_and_read_back() -> None:
    async def main() -> None:
        async with bench("px4") as made:
            made.vehicle.parameters.put("COM_OF_LOSS_T", 1.0)
            made.vehicle.parameters.put("EKF2_EV_CTRL", 0)
            async with made.link("set_parameters=true") as link:
                telemetry = link.report(CLOCK.now_ns()).telemetry
                assert telemetry is not None
                assert "parameter COM_OF_LOSS_T 1 -> 0.5" in telemetry.messages
                assert "parameter EKF2_EV_CTRL 0 -> 15" in telemetry.messages
            assert made.vehicle.parameters["COM_OF_LOSS_T"] == 0.5
            assert made.vehicle.parameters["EKF2_EV_CTRL"] == 15
            made.vehicle.parameters.put("EKF2_HGT_REF", 1)
            assert "EKF2_HGT_REF is 1" in await refusal(made, "set_parameters=true")

    run(main)


def test_a_parameter_that_does_not_hold_is_refused() -> None:
    async def main() -> None:
        async with bench("ardupilot", stuck="GUID_TIMEOUT") as made:
            made.vehicle.parameters.put("GUID_TIMEOUT", 3.0)
            text = await refusal(made, "set_parameters=true")
            assert text == "parameter GUID_TIMEOUT was set to 0.5 but reads 3: set it by hand"

    run(main)


def test_cut_motors_at_a_lost_link_are_demanded_of_px4_and_refused_for_ardupilot() -> None:
    async def main() -> None:
        async with bench("px4", age_s=1.0) as made:
            text = await refusal(made, on_link_lost="cut")
            assert "COM_OBL_RC_ACT is 4, set it to 6: it cuts its motors" in text
        async with bench("ardupilot", age_s=1.0) as made:
            assert "ArduPilot cannot cut its motors when the link is lost" in await refusal(made, on_link_lost="cut")

    run(main)


def test_nobody_there_is_refused_in_the_time_that_was_set() -> None:
    async def main() -> None:
        async with bench(tampers=lambda _data, _up, _now_ns: []) as made:
            began_ns = CLOCK.now_ns()
            text = await refusal(made, "connect_s=3")
            assert "no heartbeat from system 1 at mavlink+udp://127.0.0.1:14540 within 3 s: is the autopilot on" in text
            assert CLOCK.now_ns() - began_ns < 3.1e9

    run(main)


def test_another_system_is_named() -> None:
    async def main() -> None:
        async with bench(system=7) as made:
            text = await refusal(made, "connect_s=3")
            assert "but from system 7, component 1: name the right one with the options system" in text
            async with made.link("system=7"):
                pass

    run(main)


def test_another_autopilot_than_named_is_refused() -> None:
    async def main() -> None:
        async with bench("ardupilot") as made:
            assert "is ArduPilot, not PX4: correct autopilot=" in await refusal(made, "autopilot=px4")

    run(main)


def test_an_address_that_is_not_allowed_is_not_heard() -> None:
    async def main() -> None:
        async with bench() as made:
            text = await refusal(made, "allow=10.0.0.7&connect_s=2")
            assert f"but from the address {PEER[0]}" in text
            async with made.link(f"allow={PEER[0]}"):
                pass

    run(main)


def test_whoever_speaks_after_the_vehicle_from_elsewhere_is_not_heard() -> None:
    """A spoofed heartbeat with the vehicle's own ids, from another port: no effect."""

    async def main() -> None:
        async with bench() as made, made.link() as link:
            await link.arm()
            await stream(link, level(1.2), 0.5)
            spoof, spoofer = mavlink.MAVLink_heartbeat_message(2, 12, 129, 3 << 16, 4, 3), mavlink.MAVLink(None, 1, 1)
            for spoofer.seq in range(256):
                made.air.deliver(bytes(spoof.pack(spoofer)), ("127.0.0.1", 9))
                made.air.deliver(bytes(spoof.pack(spoofer)), ("10.9.9.9", 14580))
            report = await stream(link, level(1.0), 0.2)
            assert report.taken_over == ""
            link.stop_motors()

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_without_motion_capture_it_is_refused(flavour: str) -> None:
    async def main() -> None:
        async with bench(flavour) as made:
            assert "needs poses from motion capture" in await refusal(made, listen_poses=None)
            made.shows = False
            assert "no pose from motion capture: check motion_capture.endpoint" in await refusal(made)

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_an_estimator_that_gets_no_poses_is_refused_with_its_own_word(flavour: str) -> None:
    def no_odometry(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        return [] if up and kind_of(data) == 331 else [data]

    async def main() -> None:
        async with bench(flavour, tampers=no_odometry) as made:
            began_ns = CLOCK.now_ns()
            text = await refusal(made)
            assert "the vehicle's estimate cannot be flown with: its estimator says no " in text
            assert "poses do not reach it or are not fused" in text
            assert CLOCK.now_ns() - began_ns < 40e9

    run(main)


def test_a_frame_that_does_not_agree_is_refused() -> None:
    """The vehicle is told poses of another place than motion capture's: here, by bending them on their way."""

    async def main() -> None:
        async with bench("px4") as made, made.link() as link:
            pose = link._connection.pose
            assert pose is not None
            link._connection.close()  # poses end
            link._connection.pose = replace(pose, p_WB=(1.0, 0.0, 0.0), arrival_ns=CLOCK.now_ns())
            assert "its position is 1.00 m from motion capture (limit 0.05 m)" in await arming_refusal(link)

    run(main)


def test_the_origin_comes_before_the_first_pose() -> None:
    async def main() -> None:
        async with bench("ardupilot") as made:
            async with made.link("origin=-33.12345678,151.00000006,12.5"):
                first_pose_ns = made.air.sent(331)[0][0]
                sent_ns, data = made.air.sent(ORIGIN)[0]
                assert sent_ns < first_pose_ns
                place = [int.from_bytes(data[10 + n : 14 + n], "little", signed=True) for n in (0, 4, 8)]
                assert place == [-331234568, 1510000001, 12500]  # rounded, not cut off
            made.air.ups.clear()
            async with made.link():  # it has one now
                assert made.air.sent(ORIGIN) == []

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_the_mode_is_asked_for_after_a_second_of_stream_and_before_arming(flavour: str) -> None:
    async def main() -> None:
        async with bench(flavour) as made, made.link() as link:
            began_ns = CLOCK.now_ns()
            await link.arm()
            setpoints = made.air.sent(SETPOINT)
            assert setpoints[0][0] - began_ns <= 10 * MS
            mode_ns = next(at for at, data in made.air.sent(COMMAND) if data[38:40] == b"\xb0\x00")
            arm_ns = next(at for at, data in made.air.sent(COMMAND) if data[38:40] == b"\x90\x01")
            assert mode_ns - setpoints[0][0] >= 1e9
            assert arm_ns > mode_ns
            before_mode = [at for at, _ in setpoints if at <= mode_ns]
            assert len(before_mode) > 110
            assert CLOCK.now_ns() - began_ns < 6e9

    run(main)


@pytest.mark.parametrize(("command", "what"), [(176, "refuses OFFBOARD"), (400, "will not arm")])
def test_a_rejected_command_is_refused_with_its_result(command: int, what: str) -> None:
    async def main() -> None:
        async with bench("px4", reject=command) as made, made.link() as link:
            began_ns = CLOCK.now_ns()
            text = await arming_refusal(link)
            assert what in text
            assert "DENIED" in text
            assert CLOCK.now_ns() - began_ns < 8e9
            await wait_s(0.5)
            late = made.air.sent(SETPOINT, CLOCK.now_ns() - 400 * MS)
            assert late == []  # the stream has ended
            assert not made.armed

    run(main)


@pytest.mark.parametrize("command", [176, 400])
def test_a_lost_command_costs_a_repetition_with_a_higher_confirmation(command: int) -> None:
    lost: list[bytes] = []

    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        first = up and kind_of(data) == 76 and int.from_bytes(data[38:40], "little") == command and not lost
        if first:
            lost.append(data)
        return [] if first else [data]

    async def main() -> None:
        async with bench("px4", tampers=tampers) as made, made.link() as link:
            await link.arm()
            assert lost
            sent = commands(made, command)
            confirmations = [data[42] if data[1] > 32 else 0 for data in sent]
            assert confirmations[:2] == [0, 1]
            assert made.armed

    run(main)


@pytest.mark.parametrize("command", [176, 400])
def test_a_lost_acknowledgement_of_what_the_heartbeat_shows_costs_nothing(command: int) -> None:
    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        return [] if not up and kind_of(data) == 77 and int.from_bytes(data[10:12], "little") == command else [data]

    async def main() -> None:
        async with bench("px4", tampers=tampers) as made, made.link() as link:
            await link.arm()
            assert len(commands(made, command)) == 1
            assert made.armed

    run(main)


def test_acknowledgements_that_are_never_heard_do_not_hang() -> None:
    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        return [] if kind_of(data) == 77 and not up else [data]

    async def main() -> None:
        async with bench("px4", tampers=tampers) as made, made.link() as link:
            began_ns = CLOCK.now_ns()
            await link.arm()  # the heartbeat shows that it worked
            assert made.armed
            assert CLOCK.now_ns() - began_ns < 9e9

    run(main)


def test_an_acknowledgement_for_somebody_else_is_none() -> None:
    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        if up or kind_of(data) != 77:
            return [data]
        other = mavlink.MAVLink_command_ack_message(176, 0, 0, 0, 99, 190)
        return [bytes(other.pack(mavlink.MAVLink(None, 1, 1)))] if data[10:12] == b"\xb0\x00" else [data]

    async def main() -> None:
        async with bench("px4", tampers=tampers, reject=176) as made, made.link() as link:
            assert "no acknowledgement after 5 attempts in 2 s" in await arming_refusal(link)

    run(main)


def test_ardupilot_that_has_just_booted_is_waited_for() -> None:
    async def main() -> None:
        async with bench("ardupilot", age_s=1.0) as made, made.link() as link:
            assert 24e9 < CLOCK.now_ns() < 30e9
            await link.arm()
            assert made.armed

    run(main)


def test_a_pilot_who_changes_the_mode_while_it_arms_is_not_armed_against() -> None:
    """The mode is changed between its confirmation and arming, again and again: it is told, and not entered again."""

    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        if up and kind_of(data) == COMMAND and data[38:40] == b"\x90\x01":
            orders.append(data)
            if len(orders) == 1:
                return []
        return [data]

    orders: list[bytes] = []

    async def main() -> None:
        async with bench("ardupilot", tampers=tampers, reject=400) as made, made.link() as link:
            arming = asyncio.create_task(arming_refusal(link))
            while not orders:
                await wait_s(0.01)
            made.vehicle.firmware.pilot.mode = 5
            text = await arming
            assert text == "the mode was changed to LOITER while arming: somebody else has it"
            assert len(commands(made, 176)) == 1
            assert not made.armed

    run(main)


def test_a_pilot_who_takes_over_while_the_motors_come_up_has_it() -> None:
    async def main() -> None:
        async with bench("ardupilot", rc=True) as made, made.link() as link:
            arming = asyncio.create_task(arming_refusal(link))
            while not made.armed:
                await wait_s(0.01)
            await wait_s(0.5)
            made.vehicle.firmware.pilot.mode = 0
            assert (await arming).startswith("the pilot took over: mode STABILIZE")
            assert link.report(CLOCK.now_ns()).taken_over == "the pilot took over: mode STABILIZE"
            count = len(commands(made, 400))
            await link.disarm()
            link.stop_motors()
            await wait_s(0.2)
            assert len(commands(made, 400)) == count
            assert made.armed
            made.vehicle.firmware.pilot.disarm()

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_nothing_is_changed_of_a_vehicle_that_is_armed_while_connecting(flavour: str) -> None:
    """Neither its parameters, nor its origin, nor what its estimator fuses: somebody may be flying it."""

    async def main() -> None:
        async with bench(flavour, rc=True) as made:
            made.vehicle.parameters.put("COM_OF_LOSS_T" if flavour == "px4" else "GUID_TIMEOUT", 1.0)
            if flavour == "ardupilot":
                made.vehicle.parameters.put("DISARM_DELAY", 0)
            made.vehicle.firmware.pilot.request_arm(True, True)
            text = await refusal(made, "set_parameters=true")
            assert text.endswith("is armed, not by us: have it disarmed first")
            assert [made.air.sent(kind) for kind in (PARAM_SET, ORIGIN, ODOMETRY)] == [[], [], []]

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_vehicle_that_somebody_else_has_armed_is_left_alone(flavour: str) -> None:
    async def main() -> None:
        async with bench(flavour, rc=True) as made:
            async with made.link() as link:
                made.vehicle.firmware.pilot.request_arm(True, True)
                assert made.armed
                await wait_s(0.3)
                assert "it is armed already, not by us" in await arming_refusal(link)
                await link.disarm()
                sent = len(made.air.sent(COMMAND))
            assert len(made.air.sent(COMMAND)) == sent
            assert commands(made, 400) == []
            assert commands(made, 176) == []
            assert made.armed

    run(main)


def test_a_vehicle_that_somebody_else_flies_is_not_landed_when_the_link_closes() -> None:
    async def main() -> None:
        async with bench("px4", rc=True) as made:
            async with made.link():
                pilot = made.vehicle.firmware.pilot
                pilot.request_arm(True, True)
                pilot.request_mode(pilot.modes["takeoff"])
                await wait_s(4.0)
                assert made.height_m > 0.5
            assert commands(made, 400) == []
            assert commands(made, 176) == []

    run(main)


def test_arming_that_takes_too_long_ends_disarmed() -> None:
    """Every acknowledgement but the first word of progress is lost, and the heartbeat keeps still."""

    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        if not up and kind_of(data) == 77 and data[10:12] == b"\x90\x01":
            progress = mavlink.MAVLink_command_ack_message(400, mavlink.MAV_RESULT_IN_PROGRESS, 0, 0, 245, 191)
            return [bytes(progress.pack(mavlink.MAVLink(None, 1, 1)))]
        return [data]

    async def main() -> None:
        async with bench("px4", tampers=tampers, reject=400) as made, made.link() as link:
            began_ns = CLOCK.now_ns()
            text = await arming_refusal(link)
            assert text.startswith("arming took longer than 9 s") or "will not arm: IN_PROGRESS" in text
            assert CLOCK.now_ns() - began_ns < 9.1e9
            assert not made.armed

    run(main)


def test_the_mode_without_position_flies_too() -> None:
    async def main() -> None:
        async with bench("ardupilot") as made, made.link("mode=guided_nogps") as link:
            await link.arm()
            assert made.mode == 20
            await stream(link, level(1.2), 0.6)
            assert made.height_m > 0.1
            link.stop_motors()

    run(main)


def test_why_it_does_not_arm_is_quoted() -> None:
    async def main() -> None:
        async with bench("ardupilot") as made, made.link() as link:
            made.vehicle.firmware.pilot._internal_error = True  # type: ignore[attr-defined]
            text = await arming_refusal(link)
            assert "the autopilot will not arm: FAILED; the autopilot says" in text
            assert "Internal errors" in text

    run(main)


def test_after_a_restart_it_reports_again_and_is_not_armed_before_it_is_set_up_anew() -> None:
    async def main() -> None:
        async with bench("ardupilot") as made, made.link() as link:
            made.vehicle.reboot()
            await wait_s(3.0)
            report = link.report(CLOCK.now_ns())
            assert report.age_ns is not None
            assert report.age_ns < 50 * MS
            assert report.telemetry is not None
            assert "the autopilot was restarted" in report.telemetry.messages
            assert "restarted since it was set up; connect anew" in await arming_refusal(link)

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_stop_is_repeated_until_the_vehicle_says_that_it_is_disarmed(flavour: str) -> None:
    lost = [0]

    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        cut = up and kind_of(data) == COMMAND and data[38:40] == b"\x90\x01" and data[14:18] != b"\0\0\0\0"
        lost[0] += cut
        return [] if cut and lost[0] <= 3 else [data]

    async def main() -> None:
        async with bench(flavour, tampers=tampers) as made, made.link() as link:
            await link.arm()
            await stream(link, level(1.3), 0.6)
            link.stop_motors()
            began_ns = CLOCK.now_ns()
            report = await stream(link, level(1.0), 1.0)
            assert not made.armed
            assert report.telemetry is not None
            assert report.telemetry.armed is False
            assert lost[0] >= 4
            assert made.air.sent(SETPOINT, began_ns) == []
            count = lost[0]
            await wait_s(0.5)
            assert lost[0] == count  # it has ended
            assert "its motors were stopped; connect anew" in await arming_refusal(link)

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_closing_in_the_air_leaves_it_to_its_own_landing(flavour: str) -> None:
    async def main() -> None:
        async with bench(flavour) as made:
            async with made.link() as link:
                await link.arm()
                await stream(link, level(1.2), 0.8)
                await stream(link, level(0.9), 0.4)
                left_ns = CLOCK.now_ns()
                assert made.height_m > 0.3
            assert not made.armed
            assert made.height_m < 0.05
            assert made.air.sent(SETPOINT, left_ns) == []
            assert len(made.air.sent(331, left_ns)) > 50  # its poses went on

    run(main)


def test_who_does_not_wait_for_that_leaves_at_once() -> None:
    async def main() -> None:
        async with bench() as made:
            climbed = asyncio.Event()

            async def fly() -> None:
                async with made.link() as link:
                    await link.arm()
                    await stream(link, level(1.2), 1.0)
                    climbed.set()
                    await wait_s(60.0)

            flying = asyncio.create_task(fly())
            await climbed.wait()
            flying.cancel()
            await wait_s(0.5)
            assert not flying.done()
            flying.cancel()
            with pytest.raises(asyncio.CancelledError):
                await flying
            assert made.air.receive is None

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_silence_from_100_ms_on_and_a_fresh_setpoint_ends_it(flavour: str) -> None:
    async def main() -> None:
        async with bench(flavour) as made, made.link() as link:
            await link.arm()
            await stream(link, level(1.15), 0.8)
            last_ns = made.air.sent(SETPOINT)[-1][0]
            await wait_s(0.08)
            assert not link.report(CLOCK.now_ns()).fallback_active
            await wait_s(0.05)
            report = link.report(CLOCK.now_ns())
            assert report.fallback_active
            assert report.telemetry is not None
            assert any("no fresh setpoint for 100 ms" in text for text in report.telemetry.messages)
            link.send(level(1.0), CLOCK.now_ns() - 51 * MS)
            assert made.air.sent(SETPOINT)[-1][0] == last_ns
            assert link.report(CLOCK.now_ns()).stale == 1
            assert not (await stream(link, level(1.0), 0.1)).fallback_active
            link.stop_motors()

    run(main)


def test_what_was_sent_is_reported_byte_for_byte() -> None:
    async def main() -> None:
        async with bench() as made, made.link() as link:
            await link.arm()
            link.report(CLOCK.now_ns())
            link.send(level(1.0), CLOCK.now_ns())
            (sent,) = link.report(CLOCK.now_ns()).transmitted
            assert bytes.fromhex(sent.packet) == made.air.sent(SETPOINT)[-1][1]
            link.stop_motors()

    run(main)


def test_unfit_setpoints_are_counted_and_not_sent() -> None:
    async def main() -> None:
        async with bench() as made, made.link() as link:
            await link.arm()
            count = len(made.air.sent(SETPOINT))
            link.send(replace(level(1.0), thrust_N=float("nan")), CLOCK.now_ns())
            link.send(replace(level(1.0), q_WB=(0.0, 0.0, 0.0, 0.9)), CLOCK.now_ns())
            assert link.report(CLOCK.now_ns()).stale == 2
            assert len(made.air.sent(SETPOINT)) == count
            await stream(link, level(0.3), 0.1)
            for _ in range(15):  # unfit ones are no sign of life
                link.send(replace(level(1.0), thrust_N=float("nan")), CLOCK.now_ns())
                await wait_s(0.01)
            assert link.report(CLOCK.now_ns()).fallback_active
            link.stop_motors()

    run(main)


def test_timesync_is_answered_with_the_clock_that_poses_are_stamped_with() -> None:
    async def main() -> None:
        async with bench() as made, made.link():
            at_ns, data = made.air.sent(111)[-1]
            assert int.from_bytes(data[10:18], "little") == at_ns
            pose_ns, pose = made.air.sent(331)[-1]
            assert 0 <= pose_ns // 1000 - int.from_bytes(pose[10:18], "little") < 1000

    run(main)


@pytest.mark.parametrize("case", ["unsigned vehicle", "another key"])
def test_signing_that_does_not_agree_is_refused_with_what_was_left_out(case: str, tmp_path: Path) -> None:
    key = tmp_path / "key"
    key.write_text("a passphrase\n")
    key.chmod(0o600)
    theirs = None if case == "unsigned vehicle" else hashlib.sha256(b"another").digest()
    reason = "unsigned" if theirs is None else "forged"

    async def main() -> None:
        async with bench(key=theirs, age_s=1.0) as made:
            text = await refusal(made, f"signing=file:{key}&connect_s=2")
            assert reason in text
            assert "check the option signing and the autopilot's key" in text

    run(main)


def test_signing_goes_on_after_a_restart_though_the_clock_went_back(monkeypatch: pytest.MonkeyPatch) -> None:
    secret = hashlib.sha256(b"a passphrase").digest()
    monkeypatch.setenv("TEST_KEY", "a passphrase")

    async def main() -> None:
        async with bench(key=secret) as made:
            async with made.link("signing=env:TEST_KEY"):
                pass
            newest = max(int.from_bytes(data[-12:-6], "little") for _, data in made.air.ups)
            made.air.ups.clear()
            monkeypatch.setattr(signing, "_real_time", lambda: 0)
            async with made.link("signing=env:TEST_KEY"):
                assert min(int.from_bytes(data[-12:-6], "little") for _, data in made.air.ups) > newest

    run(main)


def test_the_key_is_nowhere_to_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    secret = hashlib.sha256(b"a passphrase").digest()
    monkeypatch.setenv("TEST_KEY", "a passphrase")

    async def main() -> None:
        async with bench(key=secret) as made, made.link("signing=env:TEST_KEY") as link:
            telemetry = link.report(CLOCK.now_ns()).telemetry
            told = f"{link.description} {telemetry} {signing.key_from('env:TEST_KEY')}"
            assert secret.hex() not in told
            assert "passphrase" not in told

    run(main)


def test_the_description_says_who_and_how_it_hovers() -> None:
    async def main() -> None:
        async with bench("ardupilot") as made:
            async with made.link() as link:
                assert link.description == "ArduPilot 4.6.3; hovers at 0.390 of full thrust, slope 0.87"
            async with made.link("hover=0.369&thrust_slope=1") as link:
                assert link.description == "ArduPilot 4.6.3; hovers at 0.369 of full thrust, slope 1"
            made.vehicle.parameters.put("MOT_THST_HOVER", 0.0)
            assert "MOT_THST_HOVER is 0.0, no share of thrust to hover at" in await refusal(made)
        assert VEHICLE.weight_N > 0.0

    run(main)
