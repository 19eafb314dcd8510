"""Feedback laws of one push that sticks: what the push is taken to be, where it should go, and how it gets there."""
