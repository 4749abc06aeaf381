"""Compiled kernels: linked helpers, a cache that knows every source, and news of compilations."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from lcd_flight import jit
from lcd_flight.errors import RefusedError


def _scaled(x: float) -> float:
    return 3.0 * x


def _hypotenuse(x: float, y: float) -> float:
    return math.sqrt(_scaled(x) ** 2 + _scaled(y) ** 2)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LCD_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def told() -> Iterator[list[str]]:
    names: list[str] = []
    jit.announce_compilation(names.append)
    yield names
    jit.announce_compilation(lambda _: None)


def test_helpers_are_linked_and_stay_plain_python(cache: Path) -> None:
    compiled = jit.Compiler(Path(__file__)).kernel(_hypotenuse)
    assert compiled(1.0, 2.0) == pytest.approx(_hypotenuse(1.0, 2.0), rel=1e-15)
    assert type(_scaled).__name__ == "function"
    assert type(_hypotenuse).__name__ == "function"


def test_a_kernel_is_compiled_once_for_its_sources(cache: Path, tmp_path: Path, told: list[str]) -> None:
    source = tmp_path / "law.py"
    source.write_text("gain = 1\n")
    jit.Compiler(source).kernel(_hypotenuse)(1.0, 2.0)
    assert "_hypotenuse" in told
    told.clear()
    jit.Compiler(source).kernel(_hypotenuse)(1.0, 2.0)
    assert told == []
    source.write_text("gain = 2\n")
    jit.Compiler(source).kernel(_hypotenuse)(1.0, 2.0)
    assert "_hypotenuse" in told


def test_every_python_file_of_a_folder_counts(cache: Path, tmp_path: Path) -> None:
    folder = tmp_path / "control"
    (folder / "inner").mkdir(parents=True)
    (folder / "inner" / "law.py").write_text("gain = 1\n")
    jit.Compiler(folder).kernel(_hypotenuse)(1.0, 2.0)
    (folder / "inner" / "law.py").write_text("gain = 2\n")
    jit.Compiler(folder).kernel(_hypotenuse)(1.0, 2.0)
    assert len(list((cache / "kernels").iterdir())) == 2


def test_a_cache_that_cannot_be_written_is_refused_with_a_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("LCD_CACHE_DIR", str(tmp_path / "file" / "cache"))
    with pytest.raises(RefusedError, match="LCD_CACHE_DIR"):
        jit.Compiler(Path(__file__)).kernel(_hypotenuse)


def test_threads_do_not_change_the_cache_folder_for_each_other(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """numba's folder is one for the process: a thread that finds it empty would keep machine code where it stands."""
    import numba
    from numba.core import config

    compile_now = numba.njit

    def slowly(**options: object) -> object:
        time.sleep(0.01)
        return compile_now(**options)

    monkeypatch.setattr(numba, "njit", slowly)
    monkeypatch.chdir(tmp_path)
    before = config.CACHE_DIR
    compilers = [jit.Compiler(Path(__file__), fastmath=bool(n % 2)) for n in range(6)]
    with ThreadPoolExecutor(6) as pool:
        kernels = list(pool.map(lambda compiler: compiler.kernel(_scaled), compilers))
    assert [kernel(2.0) for kernel in kernels] == [6.0] * 6
    assert before == config.CACHE_DIR
    assert [path.name for path in tmp_path.iterdir()] == ["cache"]
