"""Back ends by name: URIs taken apart, layers in order, and errors that list what there is."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from typing import Any

import pytest

from lcd_flight import plugins
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import InputError, LinkContext, RefusedError
from lcd_flight.plugins import entry_points, links
from lcd_flight.plugins.links import LinkUri, parse_uri

CONTEXT: Any = object()


@pytest.fixture
def more_links(monkeypatch: pytest.MonkeyPatch) -> None:
    """Links that a third party might add."""
    monkeypatch.setattr(links, "names", lambda group: ["mavlink", "mavlink+udp", "radio", "sim"])


@pytest.mark.parametrize(
    ("uri", "link", "layers", "address", "options"),
    [
        ("sim://", "sim", (), "", {}),
        (
            "sim+delay+drop://?delay_ms=12&drop=0.05",
            "sim",
            ("delay", "drop"),
            "",
            {"delay_ms": "12", "drop": "0.05"},
        ),
        ("radio://0/80/2M/E7E7E7E7E7", "radio", (), "0/80/2M/E7E7E7E7E7", {}),
        ("mavlink+udp://0.0.0.0:14540?autopilot=px4", "mavlink+udp", (), "0.0.0.0:14540", {"autopilot": "px4"}),
        ("mavlink+udp+drop://h:1", "mavlink+udp", ("drop",), "h:1", {}),
    ],
)
@pytest.mark.usefixtures("more_links")
def test_a_uri_is_taken_apart(
    uri: str, link: str, layers: tuple[str, ...], address: str, options: Mapping[str, str]
) -> None:
    assert parse_uri(uri) == LinkUri(link, layers, address, options)


def test_options_go_to_the_layer_whose_name_they_bear_and_to_the_link_otherwise() -> None:
    uri = parse_uri("sim+delay+drop://?delay_ms=1&delay_jitter_ms=2&drop=0.5&dropped=3&noise_mm=4")
    assert uri.options_of("delay") == {"delay_ms": "1", "delay_jitter_ms": "2"}
    assert uri.options_of("drop") == {"drop": "0.5"}
    assert uri.link_options() == {"dropped": "3", "noise_mm": "4"}


@pytest.mark.parametrize(
    ("uri", "message"),
    [
        ("sim", r"link 'sim' is not a URI such as sim://; there are: .*sim"),
        ("warp://", r"unknown link 'warp'; there are: .*sim"),
        ("sim+fog://", r"unknown link layer 'fog'; there are: delay, drop"),
        ("sim://?noise_mm", r"link 'sim://\?noise_mm': options are written \?name=value&name=value"),
        ("sim://?noise_mm=1&noise_mm=2", r"option noise_mm is given twice"),
    ],
)
def test_a_wrong_uri_is_an_input_error_that_lists_what_there_is(uri: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        plugins.open_link(uri, CONTEXT)


def test_layers_wrap_from_the_vehicle_outwards_with_their_own_options(monkeypatch: pytest.MonkeyPatch) -> None:
    built: list[Any] = []

    def load(group: str, name: str, what: str) -> Any:
        def factory(inner: Any, options: Mapping[str, str], context: LinkContext) -> Any:
            assert context is CONTEXT
            built.append((name, inner, dict(options)))
            return f"{name}({inner})"

        return factory

    monkeypatch.setattr(links, "load", load)
    link: Any = plugins.open_link("sim+delay+drop://hall?delay_ms=1&drop=0.5&noise_mm=4", CONTEXT)
    assert link == "drop(delay(sim(hall)))"
    assert built == [
        ("sim", "hall", {"noise_mm": "4"}),
        ("delay", "sim(hall)", {"delay_ms": "1"}),
        ("drop", "delay(sim(hall))", {"drop": "0.5"}),
    ]


@pytest.mark.parametrize(
    ("endpoint", "message"),
    [
        ("localhost:5555", r"not one such as tcp://HOST:PORT; there are: .*loopback://.*tcp://"),
        ("smoke://signal", r"unknown motion capture endpoint 'smoke'; there are: .*loopback.*tcp"),
    ],
)
def test_a_wrong_endpoint_is_an_input_error_that_lists_what_there_is(endpoint: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        plugins.pose_source(endpoint, "cf1", RealClock())
    with pytest.raises(InputError, match=message):
        plugins.pose_publisher(endpoint)


def test_an_unknown_simulator_is_an_input_error_that_lists_what_there_is() -> None:
    with pytest.raises(InputError, match=r"unknown simulator 'oracle'; there are: .*multirotor"):
        plugins.simulator("oracle")


def test_the_shipped_simulator_is_found() -> None:
    assert callable(plugins.simulator().rollout)


def test_a_back_end_whose_package_is_missing_is_refused_with_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken:
        name = "radio"

        def load(self) -> None:
            raise ModuleNotFoundError("No module named 'cflib'")

    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: [Broken()])
    with pytest.raises(RefusedError, match=r"link 'radio' cannot be loaded \(No module named 'cflib'\): install"):
        entry_points.load("links", "radio", "link")


def test_importing_plugins_imports_no_back_end_and_nothing_heavy() -> None:
    program = (
        "import sys; import lcd_flight.plugins; "
        "print([m for m in ('zmq', 'numba', 'asyncio', 'msgspec', 'importlib.metadata', 'mocap', 'drivers', "
        "'sim_bridge', 'torch', 'mcap') if m in sys.modules])"
    )
    printed = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert printed.stdout.strip() == "[]"
