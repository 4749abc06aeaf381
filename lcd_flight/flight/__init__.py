"""Flying a plan: the phases, the pure tick, the loop that runs it, and the session around them."""
