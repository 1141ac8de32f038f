"""Commands that this distribution adds to the ``frobs`` command line."""
