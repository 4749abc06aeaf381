"""From waypoints to a trajectory: minimum snap, the tracking cost, the projected solve."""
