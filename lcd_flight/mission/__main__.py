"""`python -m lcd_flight.mission [FOLDER]`: write the JSON schema and the key tables of the docs again.

FOLDER is the repository's root, by default the current one.
"""

from __future__ import annotations

import sys
from pathlib import Path

from lcd_flight.mission.reference import PAGE, with_tables
from lcd_flight.mission.schema import SCHEMA_FILE, schema_text


def main(root: Path) -> None:
    """Write both files."""
    (root / SCHEMA_FILE).write_text(schema_text(), encoding="utf-8")
    page = root / PAGE
    page.write_text(with_tables(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
