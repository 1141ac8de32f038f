"""Declares the commands of this distribution as strings, so that listing the commands does not import them."""

from frobs_cli.commands import Command

COMMANDS: tuple[Command, ...] = ()
