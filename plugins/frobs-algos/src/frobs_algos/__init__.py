"""Common parts of algorithm plugins. Import from the modules: an algorithm needs only some of them."""
