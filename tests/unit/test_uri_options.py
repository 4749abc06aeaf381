"""Options of a URI: typed, limited, and an error that lists what there is."""

from __future__ import annotations

from typing import Annotated

import msgspec
import pytest

from lcd_flight.model import InputError
from lcd_flight.wire.uri_options import read_options


class Options(msgspec.Struct, frozen=True):
    share: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.25
    count: Annotated[int, msgspec.Meta(ge=1)] = 3
    loud: bool = False


class NoOptions(msgspec.Struct, frozen=True):
    pass


def test_defaults_and_values() -> None:
    assert read_options(Options, {}, "x://") == Options()
    assert read_options(Options, {"share": "1e-1", "count": "7", "loud": "true"}, "x://") == Options(0.1, 7, True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": "3"}, "x://: unknown option size=3; x:// has the options share, count, loud"),
        ({"share": "1.5"}, "x://: option share=1.5: expected float <= 1.0; x:// has the options share, count, loud"),
        ({"share": "nan"}, "x://: option share=nan: expected float >= 0.0; x:// has the options share, count, loud"),
        ({"share": "inf"}, "x://: option share=inf: expected float <= 1.0; x:// has the options share, count, loud"),
        ({"share": ""}, "x://: option share=: expected float, got str; x:// has the options share, count, loud"),
        ({"count": "2.5"}, "x://: option count=2.5: expected int, got str; x:// has the options share, count, loud"),
        ({"loud": "aye"}, "x://: option loud=aye: expected bool, got str; x:// has the options share, count, loud"),
    ],
)
def test_one_line_says_what_is_wrong_and_what_there_is(options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_options(Options, options, "x://")
    assert str(caught.value) == message


def test_a_record_without_options() -> None:
    assert read_options(NoOptions, {}, "x://") == NoOptions()
    with pytest.raises(InputError, match="x:// has no options"):
        read_options(NoOptions, {"a": "1"}, "x://")
