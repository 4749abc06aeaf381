"""Plug-ins by name, imported when they are used: links, link layers, pose sources and publishers, simulators, laws.

They are entry points (`pyproject.toml` has ours), so that flying in the simulator imports no radio, and a third party
adds a link by declaring the same groups in a package of its own.
"""

from lcd_flight.plugins.controllers import controller
from lcd_flight.plugins.links import open_link
from lcd_flight.plugins.poses import pose_publisher, pose_source
from lcd_flight.plugins.simulators import simulator

__all__ = ["controller", "open_link", "pose_publisher", "pose_source", "simulator"]
