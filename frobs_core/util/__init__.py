"""Arrays, errors, files and other helpers that know nothing about robots."""
