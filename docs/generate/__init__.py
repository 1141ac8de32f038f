"""Writes the reference from the code: distributions, hooks, records, IDs, capabilities, errors and the command line.

This Sphinx extension writes the pages before each build to ``docs/reference/generated``, which is not in git.
"""

from pathlib import Path

from generate import (
    api,
    architecture,
    capabilities,
    commands,
    distributions,
    environments,
    errors,
    gallery,
    hooks,
    live_pages,
    plugins,
    ros,
    ros_features,
    rules,
    signatures,
    step_figure,
    step_files,
)

PAGES = {
    "distributions": distributions.page,
    "hooks": hooks.page,
    "plugins": plugins.page,
    "environments": environments.page,
    "capabilities": capabilities.page,
    "errors": errors.page,
    "model-rules": rules.page,
    "commands": commands.page,
    "ros": ros.page,
    "ros-features": ros_features.page,
    "api": api.page,
}
"""Each page of the reference, with what writes it."""

INSERTS = {
    "architecture.svg": architecture.figure,
    "gallery.inc": gallery.fragment,
    "live-pages.inc": live_pages.fragment,
    "step-files.inc": step_files.fragment,
    "step-calls.svg": step_figure.figure,
    "unsupported-capabilities.inc": capabilities.unsupported,
}
"""Files that other pages include, with what writes them."""


def write_reference(folder: Path) -> None:
    """Write all pages; a page that is up to date keeps its time, so that it is not built again."""
    pages = {name: page() for name, page in PAGES.items()}
    pages |= environments.pages(folder) | api.pages()
    files = {folder / f"{name}.rst": text for name, text in pages.items()}
    files |= {folder / name: write() for name, write in INSERTS.items()}
    for stale in set(folder.rglob("*.rst")) - set(files):
        stale.unlink()
    for path, text in files.items():
        if not path.exists() or path.read_text() != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)


def setup(app):
    """Tell Sphinx to write the pages before it looks for them, and to show signatures as they are written."""
    app.connect("builder-inited", lambda app: write_reference(Path(app.srcdir) / "reference" / "generated"))
    app.connect("build-finished", live_pages.write)
    app.connect("autodoc-process-signature", signatures.as_written)
    app.connect("autodoc-process-docstring", signatures.plain_first_line, priority=400)  # before napoleon
    app.connect("missing-reference", signatures.resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
