"""The parameters of the simulated firmware: those that do something here, and those that say what it is.

Names, types and defaults are crazyflie-firmware 2026.08's. What is not simulated (PID gains, decks, lights) is not
here, so that no client believes that it has set it.
"""

from __future__ import annotations

from sim_bridge.crazyflie.kinds import F32, I8, U8, U16, U32
from sim_bridge.crazyflie.parameters import Parameter

COMPLEMENTARY, KALMAN = 1, 2
PID = 1


def parameter_table() -> tuple[Parameter, ...]:
    """In the order of the table of contents."""
    return (
        Parameter("commander", "enHighLevel", U8, 0),
        Parameter("cpu", "flash", U16, 1024, read_only=True),
        Parameter("firmware", "modified", U8, 0, read_only=True),
        Parameter("firmware", "revision0", U32, 0x51D0F11E, read_only=True),
        Parameter("firmware", "revision1", U16, 0, read_only=True),
        Parameter("flightmode", "stabModeRoll", U8, 1),
        Parameter("flightmode", "stabModePitch", U8, 1),
        Parameter("flightmode", "stabModeYaw", U8, 0),
        Parameter("kalman", "initialX", F32, 0.0),
        Parameter("kalman", "initialY", F32, 0.0),
        Parameter("kalman", "initialZ", F32, 0.0),
        Parameter("kalman", "initialYaw", F32, 0.0),
        Parameter("kalman", "resetEstimation", U8, 0),
        Parameter("locSrv", "extPosStdDev", F32, 0.01),
        Parameter("locSrv", "extQuatStdDev", F32, 4.5e-3),
        Parameter("pm", "criticalLowVoltage", F32, 3.0),
        Parameter("pm", "lowVoltage", F32, 3.2),
        Parameter("stabilizer", "controller", U8, PID, persistent=True),
        Parameter("stabilizer", "estimator", U8, COMPLEMENTARY, persistent=True),
        Parameter("stabilizer", "stop", U8, 0),
        Parameter("supervisor", "landedTimeout", U16, 3000),
        Parameter("supervisor", "prefltTimeout", U16, 30000),
        Parameter("supervisor", "tmblChckEn", U8, 1),
        Parameter("system", "selftestPassed", I8, 1, read_only=True),
    )
