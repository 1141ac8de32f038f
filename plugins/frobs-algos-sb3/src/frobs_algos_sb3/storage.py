"""The reader and writer of files, where version 0.2 had it."""

from frobs_algos.storage import *  # noqa: F403
