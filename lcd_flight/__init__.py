"""Plans quadrotor trajectories that this vehicle can really fly, flies them at 100 Hz and explains every flight."""
