"""Flying: phases, the pure tick, clocks and the asyncio loop that holds 100 Hz."""
