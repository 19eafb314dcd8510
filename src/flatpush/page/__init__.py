"""The live page: a scene that is moved by hand, and its plan that follows. The server needs the extra `page`."""
