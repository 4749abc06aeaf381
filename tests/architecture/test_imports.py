"""What a command imports before it is needed, each in a process of its own."""

from __future__ import annotations

import subprocess
import sys

import pytest


def _modules_after(code: str) -> set[str]:
    script = f"import sys\n{code}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines())


def test_help_imports_nothing_heavy() -> None:
    modules = _modules_after(
        "import contextlib, io\nfrom lcd_flight.cli.main import flyer, run\n"
        "with contextlib.redirect_stdout(io.StringIO()): run(flyer, ['--help'])"
    )
    assert not modules & {"numpy", "numba", "torch", "scipy", "zmq", "mcap", "pyarrow", "google.protobuf", "asyncio"}


@pytest.mark.parametrize("room", ["model", "control", "safety", "mission", "wire", "planning", "plugins", "worlds"])
def test_rooms_import_no_compiler_and_no_radio(room: str) -> None:
    modules = _modules_after(f"import lcd_flight.{room}")
    assert not modules & {"numba", "torch", "pyarrow", "cflib", "pymavlink", "drivers", "mocap", "sim_bridge"}


def test_the_vocabulary_imports_numpy_and_nothing_else() -> None:
    standard = set(sys.stdlib_module_names)
    modules = {name.partition(".")[0] for name in _modules_after("import lcd_flight.model")}
    assert {m for m in modules if m not in standard and not m.startswith("_")} - {"sitecustomize"} == {
        "lcd_flight",
        "numpy",
    }


def test_flying_the_simulator_imports_no_learning_and_no_drivers() -> None:
    modules = _modules_after("import lcd_flight.api\nfrom lcd_flight import plugins")
    assert not modules & {"torch", "pyarrow", "cflib", "pymavlink", "drivers", "rotorpy"}
