"""Feedback laws on plain numbers, and the same compiled."""
