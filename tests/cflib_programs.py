"""Programs as users of cflib write them, each run in a process of its own: `python cflib_programs.py NAME URI ...`.

They use cflib as its examples do and know nothing of the simulation. What they found is printed as one JSON line.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import threading
import time
import warnings
from typing import Any

import cflib.crtp
import zmq
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.log import LogConfig
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
from cflib.crazyflie.syncLogger import SyncLogger
from cflib.utils.power_switch import PowerSwitch

from lcd_flight.wire.mocap_frame import decode, topic

GOAL = (0.3, 0.2, 0.5)
HOVER = 38_842


class MotionCapture(threading.Thread):
    """Hands poses on, as cflib's motion capture examples do."""

    def __init__(self, cf: Crazyflie, endpoint: str) -> None:
        super().__init__()
        self._cf, self._endpoint = cf, endpoint
        self._over = threading.Event()
        self.position = (0.0, 0.0, 0.0)

    def run(self) -> None:
        with zmq.Context() as context, context.socket(zmq.SUB) as socket:
            socket.setsockopt(zmq.SUBSCRIBE, topic("cf1"))
            socket.connect(self._endpoint)
            while not self._over.is_set():
                if socket.poll(100):
                    frame = decode(socket.recv())
                    self.position = frame.position
                    self._cf.loc.send_extpose(frame.position, frame.quaternion)

    def close(self) -> None:
        self._over.set()
        self.join()


def fly(uri: str, endpoint: str) -> dict[str, Any]:
    """Up, to a point, down, by roll, pitch, yaw rate and thrust."""
    with SyncCrazyflie(uri, cf=Crazyflie(rw_cache=tempfile.mkdtemp())) as scf:
        scf.wait_for_params()
        cf = scf.cf
        cf.param.set_value("stabilizer.estimator", 2)
        capture = MotionCapture(cf, endpoint)
        capture.start()
        cf.param.set_value("kalman.resetEstimation", 1)
        time.sleep(0.1)
        cf.param.set_value("kalman.resetEstimation", 0)
        time.sleep(0.3)
        cf.commander.send_setpoint(0, 0, 0, 0)
        highest, nearest = _steer(scf, capture)
        flying = cf.supervisor.read_state_list()
        for _ in range(10):
            cf.commander.send_stop_setpoint()
            time.sleep(0.01)
        cf.commander.send_notify_setpoint_stop()
        time.sleep(2.3)
        landed = cf.supervisor.read_state_list()
        capture.close()
    left = [thread.name for thread in threading.enumerate() if thread is not threading.main_thread()]
    return {"highest": highest, "nearest": nearest, "flying": flying, "landed": landed, "threads": left}


def _steer(scf: SyncCrazyflie, capture: MotionCapture) -> tuple[float, float]:
    """Fly by the vehicle's own estimate; greatest height, and least distance from the goal by motion capture."""
    config = LogConfig("state", 10)
    for name in ("x", "y", "z", "vx", "vy", "vz"):
        config.add_variable(f"stateEstimate.{name}", "float")
    highest, nearest = 0.0, math.inf
    with SyncLogger(scf, config) as reports:
        for step, (_, state, _) in enumerate(reports):
            height = GOAL[2] if step < 250 else -0.1
            a = [
                6.0 * (goal - state[f"stateEstimate.{axis}"]) - 4.0 * state[f"stateEstimate.v{axis}"]
                for axis, goal in zip("xyz", (*GOAL[:2], height), strict=True)
            ]
            pitch, roll = (max(-15.0, min(15.0, math.degrees(x / 9.81))) for x in (a[0], -a[1]))
            thrust = HOVER * (1.0 + max(-0.4, min(0.3, a[2] / 9.81)))
            scf.cf.commander.send_setpoint(roll, pitch, 0, int(thrust))
            highest = max(highest, capture.position[2])
            nearest = min(nearest, math.dist(capture.position, GOAL))
            if step > 300 and capture.position[2] < 0.02:
                break
    return highest, nearest


def talk(uri: str) -> dict[str, Any]:
    """Tables, parameters, arming, manual setpoints, emergency stop, reboot."""
    cache, found = tempfile.mkdtemp(), {}
    with SyncCrazyflie(uri, cf=Crazyflie(rw_cache=cache)) as scf:
        scf.wait_for_params()
        cf, answers = scf.cf, {}
        found["protocol"] = cf.platform.get_protocol_version()
        found["tables"] = [len(names) > 0 for names in (cf.log.toc.toc, cf.param.toc.toc)]
        found["persistent"] = cf.param.toc.get_element_by_complete_name("stabilizer.estimator").is_persistent()
        cf.param.set_value("locSrv.extPosStdDev", 0.5)
        cf.param.set_value_raw("flightmode.stabModeYaw", 0x08, 1)
        cf.param.set_value("stabilizer.estimator", 2)
        cf.param.persistent_store("stabilizer.estimator", lambda name, done: answers.update(stored=done))
        cf.param.persistent_get_state("stabilizer.estimator", lambda name, state: answers.update(state=state._asdict()))
        cf.param.get_default_value("locSrv.extPosStdDev", lambda name, value: answers.update(default=value))
        cf.param.request_param_update("flightmode.stabModeYaw")
        time.sleep(0.3)
        found["values"] = [cf.param.get_value(n) for n in ("locSrv.extPosStdDev", "flightmode.stabModeYaw")]
        found |= answers
        found["unarmed"] = cf.supervisor.read_state_list()
        cf.supervisor.send_arming_request(True)
        time.sleep(0.2)
        found["armed"] = cf.supervisor.read_state_list()
        for _ in range(20):
            cf.commander.send_setpoint_manual(0, 0, 0, 40, rate=False)
            time.sleep(0.01)
        time.sleep(0.1)
        found["spinning"] = cf.supervisor.is_flying
        cf.supervisor.send_emergency_stop_watchdog()
        cf.supervisor.send_emergency_stop()
        time.sleep(0.2)
        found["locked"] = cf.supervisor.is_locked
    switch = PowerSwitch(uri)
    switch.reboot_to_fw()
    switch.close()
    with SyncCrazyflie(uri, cf=Crazyflie(rw_cache=cache)) as scf:
        scf.wait_for_params()
        found["after"] = [scf.cf.supervisor.is_locked, scf.cf.param.get_value("stabilizer.estimator")]
    return found


def older(uri: str) -> dict[str, Any]:
    """Firmware from before the supervisor's port: cflib warns and falls back to the platform's."""
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scf.wait_for_params()
        scf.cf.supervisor.send_arming_request(True)
        time.sleep(0.2)
        config = LogConfig("info", 20)
        config.add_variable("supervisor.info")
        with SyncLogger(scf, config) as reports:
            _, values, _ = next(iter(reports))
        return {"protocol": scf.cf.platform.get_protocol_version(), "info": values["supervisor.info"]}


if __name__ == "__main__":
    cflib.crtp.init_drivers()
    program = {"fly": fly, "talk": talk, "older": older}[sys.argv[1]]
    sys.stdout.write(json.dumps(program(*sys.argv[2:])) + "\n")
