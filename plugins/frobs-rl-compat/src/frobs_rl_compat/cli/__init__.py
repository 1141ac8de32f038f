"""The command that this distribution adds: `frobs migrate`."""
