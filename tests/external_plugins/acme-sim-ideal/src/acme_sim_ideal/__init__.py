"""A simulator whose drives are ideal: joints follow their commands, and nothing has weight."""
