"""Wrong mission files: each line a user sees is checked whole, with file, line, key, value, limit and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from lcd_flight.mission import MissionError, load_mission
from lcd_flight.model import InputError, Outcome

RIGHT = """\
version: 1
name: right
seed: 7
vehicle:
  type: crazyflie
  uri: sim://
  initial_position: [0.0, 0.0, 0.0]
  battery: {voltage_takeoff: 3.8, voltage_warning: 3.2, voltage_critical: 3.0}
motion_capture:
  endpoint: tcp://127.0.0.1:5555
  rigid_body: cf1
planner:
  type: learned
  speed: 1.5
plan:
  - takeoff: {height: 1.0, duration: 2.5}
  - hold: {duration: 2.0}
  - trajectory:
      waypoints:
        - {position: [0.0, 0.0, 1.0], yaw_deg: 0}
        - {position: [1.5, 0.5, 1.2]}
        - {position: [2.5, 2.0, 1.8], yaw_deg: 90}
  - land: {duration: 2.5}
safety:
  geofence: {min: [-1.0, -1.0, 0.0], max: [4.0, 4.0, 3.0]}
  max_position_error: 1.5
rehearse: {runs: 20, faults: [motor_noise]}
"""

# old text, new text, the lines that the user sees (without the file's name)
ONE_PROBLEM = {
    "missing key": (
        "name: right\n",
        "",
        "1: name: is missing; add it, e.g. `name: four-waypoints`",
    ),
    "missing key inside": (
        "hold: {duration: 2.0}",
        "hold: {}",
        "17: plan[1].hold.duration: is missing; add it, e.g. `duration: 2.0`",
    ),
    "missing geofence": (
        "  geofence: {min: [-1.0, -1.0, 0.0], max: [4.0, 4.0, 3.0]}\n",
        "",
        "24: safety.geofence: is missing; add it, e.g. `geofence: {min: [-1.0, -1.0, 0.0], max: [4.0, 4.0, 3.0]}`",
    ),
    "unknown key with a near one": (
        "  speed: 1.5",
        "  sped: 1.5",
        "14: planner.sped: is not a known key; did you mean speed? "
        "(one of type, model, speed, weight, transfer_speed, limits)",
    ),
    "unknown key in a waypoint": (
        "{position: [1.5, 0.5, 1.2]}",
        "{position: [1.5, 0.5, 1.2], yaw: 3}",
        "21: plan[2].trajectory.waypoints[1].yaw: is not a known key; did you mean yaw_deg? "
        "(one of position, yaw_deg, time)",
    ),
    "unknown section": (
        "rehearse: {runs: 20",
        "rehersal: {runs: 20",
        "27: rehersal: is not a known key; did you mean rehearse? (one of version, name, seed, vehicle, "
        "motion_capture, planner, control, plan, safety, log, rehearse)",
    ),
    "duplicate key": (
        "  speed: 1.5",
        "  speed: 1.5\n  speed: 2.5",
        "15: planner.speed: is given twice, first on line 14; keep one of them",
    ),
    "number with an exponent only": (
        "speed: 1.5",
        "speed: 1e-3",
        '14: planner.speed: 1e-3 is text to some YAML readers; write 0.001, or "1e-3" for text',
    ),
    "octal": (
        "seed: 7",
        "seed: 012",
        '3: seed: 012 is octal to some YAML readers; write 12, or "012" for text',
    ),
    "base 60": (
        "hold: {duration: 2.0}",
        "hold: {duration: 12:30}",
        "17: plan[1].hold.duration: 12:30 is a number in base 60 to some YAML readers; write one number, "
        "or put text in quotes",
    ),
    "on and off": (
        "max_position_error: 1.5",
        "confirm: off",
        "26: safety.confirm: off is a truth value to some YAML readers and text to others; "
        'write false, or "off" for text',
    ),
    "yes as a name": (
        "name: right",
        "name: yes",
        '2: name: yes is a truth value to some YAML readers and text to others; write true, or "yes" for text',
    ),
    "underscored number": (
        "runs: 20",
        "runs: 1_000",
        '27: rehearse.runs: 1_000 is text to some YAML readers; write 1000, or "1_000" for text',
    ),
    "hexadecimal": (
        "seed: 7",
        "seed: 0x10",
        "3: seed: 0x10 is a number to some YAML readers and text to others; write the number in decimal",
    ),
    "a date": (
        "name: right",
        "name: 2026-11-22",
        "2: name: 2026-11-22 is a date to some YAML readers; put text in quotes",
    ),
    "not a number": (
        "speed: 1.5",
        "speed: .nan",
        "14: planner.speed: .nan is not a finite number; write a number",
    ),
    "infinite": (
        "position: [1.5, 0.5, 1.2]",
        "position: [1.5, -.inf, 1.2]",
        "21: plan[2].trajectory.waypoints[1].position[1]: -.inf is not a finite number; write a number",
    ),
    "too large for a float": (
        "speed: 1.5",
        "speed: 1.0e+999",
        "14: planner.speed: 1.0e+999 is too large to be read; write a smaller number",
    ),
    "anchor": (
        "uri: sim://",
        "uri: &link sim://",
        "6: vehicle.uri: &link is an anchor; write the value out wherever it is used",
    ),
    "tag": (
        "uri: sim://",
        "uri: !!str sim://",
        "6: vehicle.uri: tag:yaml.org,2002:str is a tag; write the plain value",
    ),
    "merge key": (
        "  rigid_body: cf1",
        "  <<: {rigid_body: cf1}",
        "11: motion_capture.<<: is a merge key; write the keys out",
    ),
    "second document": (
        "rehearse:",
        "---\nrehearse:",
        "27: a second document begins here; keep one mission in one file",
    ),
    "number in quotes": (
        "speed: 1.5",
        'speed: "1.5"',
        '14: planner.speed: "1.5" is text; write a number in m/s without quotes',
    ),
    "text for a number": (
        "height: 1.0",
        "height: high",
        '16: plan[0].takeoff.height: "high" is text; write a number in m',
    ),
    "fraction for a whole number": (
        "runs: 20",
        "runs: 2.5",
        "27: rehearse.runs: 2.5 is a number; write a whole number",
    ),
    "truth for a number": (
        "position: [1.5, 0.5, 1.2]",
        "position: [1.5, true, 1.2]",
        "21: plan[2].trajectory.waypoints[1].position[1]: true is true or false; write a number in m",
    ),
    "empty section": (
        "motion_capture:\n  endpoint: tcp://127.0.0.1:5555\n  rigid_body: cf1\n",
        "motion_capture:\n",
        "9: motion_capture: is empty; write keys with values, or remove the key",
    ),
    "list for a mapping": (
        "rehearse: {runs: 20, faults: [motor_noise]}",
        "rehearse: [20]",
        "27: rehearse: a list of 1 is a list; write keys with values",
    ),
    "two numbers in a position": (
        "position: [1.5, 0.5, 1.2]",
        "position: [1.5, 0.5]",
        "21: plan[2].trajectory.waypoints[1].position: has 2 numbers, must have 3; write [x, y, z] in m",
    ),
    "four numbers in a position": (
        "position: [1.5, 0.5, 1.2]",
        "position: [1.5, 0.5, 1.2, 0.0]",
        "21: plan[2].trajectory.waypoints[1].position: has 4 numbers, must have 3; write [x, y, z] in m",
    ),
    "negative duration": (
        "hold: {duration: 2.0}",
        "hold: {duration: -2.0}",
        "17: plan[1].hold.duration: -2.0 is not above 0 s; write more than 0 s",
    ),
    "take-off below the least height": (
        "height: 1.0",
        "height: 0.05",
        "16: plan[0].takeoff.height: 0.05 is below 0.2 m; write at least 0.2 m",
    ),
    "heading beyond a turn": (
        "yaw_deg: 90",
        "yaw_deg: 900",
        "22: plan[2].trajectory.waypoints[2].yaw_deg: 900 is above 360 deg; write at most 360 deg",
    ),
    "unknown planner": (
        "type: learned",
        "type: learnt",
        '13: planner.type: "learnt" is not possible here; did you mean learned? '
        "(one of learned-polished, learned, analytic-polished, analytic, minimum-snap)",
    ),
    "unknown fault": (
        "faults: [motor_noise]",
        "faults: [motor_noise, wind]",
        '27: rehearse.faults[1]: "wind" is not possible here; write one of motor_noise, mocap_dropout',
    ),
    "fault twice": (
        "faults: [motor_noise]",
        "faults: [motor_noise, motor_noise]",
        "27: rehearse.faults[1]: motor_noise is named twice; keep one of them",
    ),
    "a link that is no link": (
        "uri: sim://",
        "uri: simulator",
        '6: vehicle.uri: "simulator" has the wrong form; write e.g. sim://',
    ),
    "an endpoint without a port": (
        "endpoint: tcp://127.0.0.1:5555",
        "endpoint: tcp://127.0.0.1",
        "10: motion_capture.endpoint: tcp://127.0.0.1 has no port from 1 to 65535; write tcp://HOST:PORT",
    ),
    "a port that cannot be": (
        "endpoint: tcp://127.0.0.1:5555",
        "endpoint: tcp://127.0.0.1:99999",
        "10: motion_capture.endpoint: tcp://127.0.0.1:99999 has no port from 1 to 65535; write tcp://HOST:PORT",
    ),
    "an endpoint that is none": (
        "endpoint: tcp://127.0.0.1:5555",
        "endpoint: 127.0.0.1",
        '10: motion_capture.endpoint: "127.0.0.1" has the wrong form; write e.g. tcp://127.0.0.1:5555',
    ),
    "a name with a slash": (
        "name: right",
        "name: ../right",
        '2: name: "../right" has the wrong form; write e.g. four-waypoints',
    ),
    "another version": (
        "version: 1",
        "version: 2",
        "1: version: 2 is above 1; write at most 1",
    ),
    "unknown vehicle": (
        "type: crazyflie",
        "type: crazyfly",
        '5: vehicle.type: "crazyfly" is no known vehicle and no file; did you mean crazyflie? ({vehicles})',
    ),
    "a vehicle that flies no thrust and attitude": (
        "type: crazyflie",
        "type: hummingbird",
        '5: vehicle.type: "hummingbird" has no onboard controller to fly thrust and attitude; choose another vehicle',
    ),
    "no such file of gains": (
        "planner:",
        "control: {gains: mine.yaml}\nplanner:",
        "12: control.gains: {folder}/mine.yaml: no such file; check the name and the folder you are in",
    ),
    "voltages in the wrong order": (
        "voltage_warning: 3.2",
        "voltage_warning: 2.9",
        "8: vehicle.battery.voltage_critical: 3 V is not below voltage_warning 2.9 V; "
        "lower it or raise voltage_warning",
    ),
    "fence upside down": (
        "min: [-1.0, -1.0, 0.0]",
        "min: [-1.0, 5.0, 0.0]",
        "25: safety.geofence.min[1]: 5 is not below the geofence's max 4 m; swap them or move one",
    ),
    "rehearsal allows more than the flight": (
        "max_position_error: 1.5",
        "max_position_error: 0.5",
        "24: safety.max_predicted_error: 0.75 is above max_position_error 0.5 m, at which the flight lands; "
        "lower it or raise max_position_error",
    ),
    "waypoint above the fence": (
        "[1.5, 0.5, 1.2]",
        "[1.5, 0.5, 9.5]",
        "21: plan[2].trajectory.waypoints[1].position[2]: 9.5 is above the geofence's 3 m; "
        "lower the waypoint or raise safety.geofence.max",
    ),
    "waypoint below the floor": (
        "[1.5, 0.5, 1.2]",
        "[1.5, 0.5, -0.2]",
        "21: plan[2].trajectory.waypoints[1].position[2]: -0.2 is below the geofence's 0 m; "
        "raise the waypoint or lower safety.geofence.min",
    ),
    "start outside the fence": (
        "initial_position: [0.0, 0.0, 0.0]",
        "initial_position: [-2.0, 0.0, 0.0]",
        "7: vehicle.initial_position[0]: -2 is below the geofence's -1 m; move the start or lower safety.geofence.min",
    ),
    "hover above the fence": (
        "height: 1.0",
        "height: 3.5",
        "16: plan[0].takeoff.height: 3.5 is above the geofence's 3 m; lower the hover or raise safety.geofence.max",
    ),
    "landing outside the fence": (
        "land: {duration: 2.5}",
        "land: {position: [1.0, -3.0, 0.0]}",
        "23: plan[3].land.position[1]: -3 is below the geofence's -1 m; move the landing or lower safety.geofence.min",
    ),
    "equal consecutive waypoints": (
        "[1.5, 0.5, 1.2]",
        "[0.0, 0.0, 1.0]",
        "21: plan[2].trajectory.waypoints[1].position: [0.0, 0.0, 1.0] equals the waypoint before; remove one of them",
    ),
    "a turn on the spot without a time": (
        "{position: [1.5, 0.5, 1.2]}",
        "{position: [0.0, 0.0, 1.0], yaw_deg: 45}",
        "21: plan[2].trajectory.waypoints[1].position: [0.0, 0.0, 1.0] equals the waypoint before, so a speed gives "
        "no duration; add `time` or remove one of them",
    ),
    "one waypoint": (
        "        - {position: [1.5, 0.5, 1.2]}\n        - {position: [2.5, 2.0, 1.8], yaw_deg: 90}\n",
        "",
        "19: plan[2].trajectory.waypoints: has length 1; write at least 2 items",
    ),
    "a time at the first waypoint": (
        "{position: [0.0, 0.0, 1.0], yaw_deg: 0}",
        "{position: [0.0, 0.0, 1.0], time: 2}",
        "20: plan[2].trajectory.waypoints[0].time: 2 s: the first waypoint has no time; remove it",
    ),
    "a time too short for the way": (
        "{position: [1.5, 0.5, 1.2]}",
        "{position: [1.5, 0.5, 1.2], time: 0.1}",
        "21: plan[2].trajectory.waypoints[1].time: 0.1 s for 1.59 m needs 15.94 m/s, above "
        "planner.limits.max_velocity 5 m/s; write at least 0.32 s",
    ),
    "a climb too fast": (
        "takeoff: {height: 1.0, duration: 2.5}",
        "takeoff: {height: 2.0, duration: 0.5}",
        "16: plan[0].takeoff.duration: 0.5 s for 4.38 m needs 8.75 m/s, above planner.limits.max_velocity 5 m/s; "
        "write at least 0.88 s",
    ),
    "faster than the planner's limit": (
        "speed: 1.5",
        "speed: 6.0",
        "14: planner.speed: 6 is above planner.limits.max_velocity 5 m/s; lower it or raise the limit",
    ),
    "faster than the vehicle": (
        "speed: 1.5",
        "speed: 15.0\n  limits: {max_velocity: 20.0}",
        "14: planner.speed: 15 is above 9.0 m/s, the fastest that a crazyflie can fly level; lower it",
    ),
    "faster than any": (
        "speed: 1.5",
        "speed: 300.0",
        "14: planner.speed: 300.0 is above 20 m/s; write at most 20 m/s",
    ),
    "unknown item": (
        "- hold: {duration: 2.0}",
        "- hover: {duration: 2.0}",
        "17: plan[1]: hover is no item of a plan; write one of takeoff, hold, trajectory, land",
    ),
    "item that is no mapping": (
        "- hold: {duration: 2.0}",
        "- hold",
        "17: plan[1]: hold lacks its colon and what stands behind it; write `- hold: {duration: 2.0}`",
    ),
    "two actions in one item": (
        "- hold: {duration: 2.0}",
        "- hold: {duration: 2.0}\n    land: {}",
        "18: plan[1].land: is a second key in one item of the plan; indent it below the item's name, "
        "or begin a new item with `-`",
    ),
    "trajectory before take-off": (
        "  - takeoff: {height: 1.0, duration: 2.5}\n  - hold: {duration: 2.0}\n",
        "  - hold: {duration: 2.0}\n  - takeoff: {height: 1.0, duration: 2.5}\n",
        "17: plan[1].takeoff: is item 2 of 4; takeoff must be the first item, once",
    ),
    "nothing lands": (
        "  - land: {duration: 2.5}\n",
        "",
        "15: plan: has no land; add `- land: {}` as its last item",
    ),
    "something after the landing": (
        "  - land: {duration: 2.5}\n",
        "  - land: {duration: 2.5}\n  - hold: {duration: 1.0}\n",
        "23: plan[3].land: is item 4 of 5; land must be the last item, once",
    ),
    "a tab": (
        "  speed: 1.5",
        "\tspeed: 1.5",
        "14: a tab; YAML is indented with spaces: replace it by spaces",
    ),
    "an open bracket": (
        "position: [1.5, 0.5, 1.2]",
        "position: [1.5, 0.5, 1.2",
        "21: not YAML: expected ',' or ']', but got '}' while parsing a flow sequence; "
        "check indentation, colons, quotes and brackets here",
    ),
}


def written(folder: Path, text: str) -> Path:
    path = folder / "x.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def errors_of(folder: Path, text: str) -> list[str]:
    """What the user sees, without the file's name."""
    path = written(folder, text)
    with pytest.raises(MissionError) as caught:
        load_mission(path)
    lines = str(caught.value).splitlines()
    assert len(lines) == len(caught.value.problems)
    assert all(line.startswith(f"{path}:") for line in lines)
    return [line.removeprefix(f"{path}:") for line in lines]


def test_the_right_one_loads(tmp_path: Path) -> None:
    assert load_mission(written(tmp_path, RIGHT)).name == "right"


@pytest.mark.parametrize("name", ONE_PROBLEM)
def test_one_problem_is_one_line(name: str, tmp_path: Path) -> None:
    from lcd_flight.worlds import vehicle_names

    old, new, expected = ONE_PROBLEM[name]
    assert RIGHT.count(old) == 1, "the edit must be unambiguous"
    expected = expected.replace("{folder}", str(tmp_path))
    expected = expected.replace("{vehicles}", f"one of {', '.join(vehicle_names())}")
    assert errors_of(tmp_path, RIGHT.replace(old, new)) == [expected]


def test_every_problem_is_told_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = RIGHT
    chosen = [
        "octal",
        "unknown planner",
        "negative duration",
        "a time at the first waypoint",
        "waypoint above the fence",
    ]
    chosen += [
        "voltages in the wrong order",
        "number with an exponent only",
        "unknown fault",
        "landing outside the fence",
    ]
    for name in chosen:
        text = text.replace(*ONE_PROBLEM[name][:2])
    assert sorted(errors_of(tmp_path, text)) == sorted(ONE_PROBLEM[name][2] for name in chosen)
    lines = [int(line.split(":")[0]) for line in errors_of(tmp_path, text)]
    assert lines == sorted(lines)


def test_a_broken_waypoint_does_not_hide_its_neighbours(tmp_path: Path) -> None:
    text = RIGHT.replace("[0.0, 0.0, 1.0]", "[0.0, high, 1.0]").replace("[2.5, 2.0, 1.8]", "[2.5, 20.0, 1.8]")
    assert errors_of(tmp_path, text) == [
        '20: plan[2].trajectory.waypoints[0].position[1]: "high" is text; write a number in m',
        "22: plan[2].trajectory.waypoints[2].position[1]: 20 is above the geofence's 4 m; "
        "move the waypoint or raise safety.geofence.max",
    ]


def test_every_tab_is_told(tmp_path: Path) -> None:
    text = RIGHT.replace("  type: learned\n  speed: 1.5", "\ttype: learned\n\tspeed: 1.5")
    assert [line.split(":")[0] for line in errors_of(tmp_path, text)] == ["13", "14"]


def test_aliases_are_refused_beside_their_anchors(tmp_path: Path) -> None:
    text = RIGHT.replace("min: [-1.0, -1.0, 0.0]", "min: &low [-1.0, -1.0, 0.0]").replace(
        "initial_position: [0.0, 0.0, 0.0]", "initial_position: *low"
    )
    found = errors_of(tmp_path, text)
    assert any("*low is an alias; write the value out" in line for line in found) or "undefined alias" in found[0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "1: is empty; write a mission: version, name, vehicle, plan, safety (docs/mission.md)"),
        ("# only a comment\n", "1: is empty; write a mission: version, name, vehicle, plan, safety (docs/mission.md)"),
        ("- 1\n", "1: holds a list of 1; write a mission: version, name, vehicle, plan, safety (docs/mission.md)"),
        ("fly\n", '1: holds "fly"; write a mission: version, name, vehicle, plan, safety (docs/mission.md)'),
        ("[" * 5000, "1: nested more than 20 levels deep; a mission needs six"),
        ("a: \0", "1: not YAML: the character #x0000 is not allowed; remove it"),
    ],
)
def test_files_that_are_no_mapping(text: str, expected: str, tmp_path: Path) -> None:
    assert errors_of(tmp_path, text)[0] == expected


def test_the_smallest_wrong_mission_names_all_that_is_missing(tmp_path: Path) -> None:
    keys = [line.split(": ")[1] for line in errors_of(tmp_path, "{}\n")]
    assert keys == ["version", "name", "vehicle", "plan", "safety"]


def test_what_is_no_text_file(tmp_path: Path) -> None:
    latin = tmp_path / "latin.yaml"
    latin.write_bytes(b"version: 1\nname: caf\xe9\n")
    large = tmp_path / "large.yaml"
    large.write_bytes(b"#" * 300_000)
    expected = {
        latin: f"{latin}:2: byte 0xe9 is not UTF-8; save the file as UTF-8 text",
        large: f"{large}: is larger than 256 kB; is it the right file?",
        tmp_path: f"{tmp_path}: is a folder; name a file in it",
        tmp_path / "none.yaml": f"{tmp_path}/none.yaml: no such file; check the name and the folder you are in",
        Path("/dev/null"): "/dev/null: is not a plain file; name a file",
        tmp_path / ("long" * 100): f"{tmp_path / ('long' * 100)}: cannot be read (File name too long); "
        "check the name and your rights to it",
    }
    for path, message in expected.items():
        with pytest.raises(InputError) as caught:
            load_mission(path)
        assert str(caught.value) == message
        assert caught.value.outcome is Outcome.INVALID_INPUT


def test_a_file_without_the_right_to_read_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, RIGHT)

    def denied(_: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", denied)  # rights alone do not stop the root user
    with pytest.raises(
        InputError, match=r"x\.yaml: cannot be read \(Permission denied\); check the name and your rights"
    ):
        load_mission(path)


def test_an_unknown_name_says_what_ships(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        load_mission("dmo")
    assert str(caught.value) == "dmo: no such mission; give a file's path, or the name of one that ships: demo"


def test_a_list_is_not_called_short_for_wrong_items(tmp_path: Path) -> None:
    text = RIGHT.replace("[0.0, 0.0, 1.0]", "[a, 0.0, 1.0]").replace("[1.5, 0.5, 1.2]", "[b, 0.5, 1.2]")
    assert errors_of(tmp_path, text) == [
        '20: plan[2].trajectory.waypoints[0].position[0]: "a" is text; write a number in m',
        '21: plan[2].trajectory.waypoints[1].position[0]: "b" is text; write a number in m',
    ]


def test_keys_are_plain_words(tmp_path: Path) -> None:
    found = errors_of(tmp_path, RIGHT + "? [1, 2]\n: 3\n&anchor log: {}\n")
    assert found[0] == "28: a key must be a plain word"
    assert any(line.startswith("30: ") and "&anchor is an anchor" in line for line in found)


def test_what_is_wrong_with_a_vehicle_file_is_told_at_the_missions_key(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("name: mine\n", encoding="utf-8")
    found = errors_of(tmp_path, RIGHT.replace("type: crazyflie", "type: mine.yaml"))
    assert len(found) > 1
    assert all(line.startswith(f"5: vehicle.type: {tmp_path}/mine.yaml: ") for line in found)
    assert any("mass_kg: this key is missing" in line for line in found)
