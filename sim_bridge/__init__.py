"""Simulated vehicles: the multirotor model, batched rollouts, the simulated link."""
