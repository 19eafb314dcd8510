"""Following a whole plan: its pushes under feedback, landing where the object now is, learning on the way."""
