"""Reads mesh files."""
