"""Receding horizon: one finger, as many landings as it takes, every push planned anew at every tick."""
