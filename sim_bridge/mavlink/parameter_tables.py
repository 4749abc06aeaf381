"""The parameters that a client needs, with types and defaults; real firmware has hundreds more.

Sources: PX4 1.16 and ArduCopter 4.6 parameter references. `ready`: what flying by external poses wants.
"""

from __future__ import annotations

from sim_bridge.mavlink.parameters import INT8, INT16, INT32, REAL, Parameter, Value


def _table(kind: int, text: str) -> list[Parameter]:
    words = [pair.split("=") for pair in text.split()]
    return [Parameter(name, kind, float(value) if kind == REAL else int(value)) for name, value in words]


PX4 = (
    *_table(
        INT32,
        """
        SYS_AUTOSTART=4001 MAV_SYS_ID=1 MAV_COMP_ID=1 MAV_TYPE=2 MAV_FWDEXTSP=1 COM_OBL_RC_ACT=0 COM_RC_IN_MODE=0
        COM_RCL_EXCEPT=0 COM_RC_OVERRIDE=1 NAV_RCL_ACT=2 NAV_DLL_ACT=0 COM_ARM_WO_GPS=1 COM_LOW_BAT_ACT=0 EKF2_EV_CTRL=0
        EKF2_HGT_REF=1 EKF2_GPS_CTRL=7 EKF2_BARO_CTRL=1 EKF2_MAG_TYPE=0 EKF2_EV_NOISE_MD=0 EKF2_NOAID_TOUT=5000000
        MPC_USE_HTE=1 CBRK_SUPPLY_CHK=0 SYS_HAS_GPS=1 SYS_HAS_MAG=1 MC_AIRMODE=0
        """,
    ),
    *_table(
        REAL,
        """
        COM_OF_LOSS_T=1.0 COM_FAIL_ACT_T=5.0 COM_DISARM_LAND=2.0 COM_DISARM_PRFLT=10.0 COM_SPOOLUP_TIME=1.0
        COM_RC_LOSS_T=0.5 BAT_LOW_THR=0.15 BAT_CRIT_THR=0.07 BAT_EMERGEN_THR=0.05 EKF2_EV_DELAY=0.0 EKF2_EVP_NOISE=0.1
        EKF2_EVA_NOISE=0.1 EKF2_EV_POS_X=0.0 EKF2_EV_POS_Y=0.0 EKF2_EV_POS_Z=0.0 MPC_THR_HOVER=0.5 MPC_THR_MIN=0.12
        MPC_THR_MAX=1.0 THR_MDL_FAC=0.0 MPC_LAND_SPEED=0.7 MPC_TILTMAX_AIR=45.0 MIS_TAKEOFF_ALT=2.5 MC_ROLL_P=6.5
        MC_PITCH_P=6.5 MC_YAW_P=2.8
        """,
    ),
)
PX4_READY: dict[str, Value] = {
    "COM_OBL_RC_ACT": 4,
    "COM_OF_LOSS_T": 0.5,
    "COM_FAIL_ACT_T": 0.0,
    "COM_RC_IN_MODE": 4,
    "COM_RCL_EXCEPT": 4,
    "EKF2_EV_CTRL": 15,
    "EKF2_HGT_REF": 3,
    "EKF2_GPS_CTRL": 0,
    "EKF2_MAG_TYPE": 5,
    "SYS_HAS_GPS": 0,
}

ARDUPILOT = (
    *_table(
        INT8,
        """
        VISO_TYPE=0 EK3_ENABLE=1 EK3_SRC1_POSXY=3 EK3_SRC1_VELXY=3 EK3_SRC1_POSZ=1 EK3_SRC1_VELZ=3 EK3_SRC1_YAW=1
        AHRS_EKF_TYPE=3 COMPASS_USE=1 COMPASS_ENABLE=1 GPS1_TYPE=1 DISARM_DELAY=10 FRAME_CLASS=1 FRAME_TYPE=1
        FS_EKF_ACTION=1 FS_THR_ENABLE=1 FS_GCS_ENABLE=0 FS_CRASH_CHECK=1 BATT_FS_LOW_ACT=0
        BATT_FS_CRT_ACT=0 MOT_HOVER_LEARN=2
        """,
    ),
    *_table(INT16, "FORMAT_VERSION=120 SYSID_THISMAV=1 SYSID_MYGCS=255 ANGLE_MAX=3000 LAND_SPEED=50 VISO_DELAY_MS=10"),
    *_table(INT32, "ARMING_CHECK=1 GUID_OPTIONS=0 LOG_BITMASK=176126 AHRS_OPTIONS=0"),
    *_table(
        REAL,
        """
        GUID_TIMEOUT=3.0 MOT_THST_HOVER=0.35 MOT_THST_EXPO=0.65 MOT_SPIN_ARM=0.1 MOT_SPIN_MIN=0.15 MOT_SPOOL_TIME=0.5
        WPNAV_SPEED_UP=250.0 WPNAV_SPEED_DN=150.0 FS_EKF_THRESH=0.8 ATC_ANG_RLL_P=4.5 ATC_ANG_PIT_P=4.5
        ATC_ANG_YAW_P=4.5 BATT_LOW_VOLT=0.0 BATT_CRT_VOLT=0.0 BATT_ARM_VOLT=0.0 VISO_POS_X=0.0 VISO_POS_Y=0.0
        VISO_POS_Z=0.0
        """,
    ),
)
ARDUPILOT_READY: dict[str, Value] = {
    "VISO_TYPE": 1,
    "EK3_SRC1_POSXY": 6,
    "EK3_SRC1_VELXY": 6,
    "EK3_SRC1_POSZ": 6,
    "EK3_SRC1_VELZ": 6,
    "EK3_SRC1_YAW": 6,
    "COMPASS_USE": 0,
    "GPS1_TYPE": 0,
    "GUID_OPTIONS": 8,
    "GUID_TIMEOUT": 0.5,
    "MOT_THST_HOVER": 0.39,
    "FS_THR_ENABLE": 0,
}
