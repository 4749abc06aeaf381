"""The JSON schema of mission files, for editors: completion, descriptions with units, ranges."""

from __future__ import annotations

import json
from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from lcd_flight.mission.mission import Mission

SCHEMA_FILE = "missions/mission.schema.json"
"""Where it stands in the repository; missions name it in their first line."""


class _WithoutTitles(GenerateJsonSchema):
    """pydantic's titles repeat the keys."""

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002 - pydantic's signature
        """Never."""
        return False


def mission_schema() -> dict[str, Any]:
    """The schema (draft 2020-12) of what one key alone can show; the loader checks more (`checks`)."""
    schema = Mission.model_json_schema(by_alias=True, schema_generator=_WithoutTitles)
    return {"$schema": GenerateJsonSchema.schema_dialect, **schema, "title": "lcd-flight mission"}


def schema_text() -> str:
    """The schema file's contents."""
    return json.dumps(mission_schema(), indent=1, ensure_ascii=False) + "\n"
