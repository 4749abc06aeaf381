"""A simulated Crazyflie that behaves like the real one and speaks its radio protocol over UDP."""
