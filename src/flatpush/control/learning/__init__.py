"""Learning while pushing: the centre of friction, ρ and the friction at the finger, from measured motion."""
