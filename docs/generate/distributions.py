"""The page of the distributions: what each contains, imports and adds to the command line."""

from importlib.metadata import entry_points

from layers import distributions, imported_distributions

from generate import rst
from generate.rst import code, escape, heading, label


def page() -> str:
    """Return the page."""
    text = label("distributions") + heading("Distributions")
    text += (
        "FRobs consists of these pip packages. The package ``frobs`` requires all of them except ``frobs-algos-sbx``, "
        "``frobs-ray``, and those that the extras ``data``, ``imitation`` and ``lerobot`` add. Each distribution imports "
        "only the FRobs distributions that its row lists; a test verifies this.\n\n"
    )
    rows = []
    for name, distribution in distributions().items():
        lower = sorted(imported_distributions(distribution))
        rows.append(
            (
                code(name),
                ", ".join(code(package.name) for package in distribution.packages) or "–",
                f"{escape(distribution.project['description'])}.",
                "requires the others, except ``frobs-algos-sbx`` and ``frobs-ray``"
                if not distribution.packages
                else ", ".join(map(code, lower)) or "–",
                ", ".join(code(command) for command in _commands(name)) or "–",
            )
        )
    return text + rst.table(
        ["distribution", "packages", "contents", "imports", "commands"], rows, widths="18 16 30 20 16"
    )


def _commands(name: str) -> list[str]:
    """Return the commands that a distribution adds, with the words of groups."""
    tables = [entry.load() for entry in entry_points(group="frobs.commands") if entry.dist and entry.dist.name == name]
    return [f"frobs {command.name}" for table in tables for command in table if command.function]
