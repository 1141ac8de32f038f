"""The static pages of trained policies in the gallery, if the files from ``make page`` are there."""

from pathlib import Path
from typing import Any

from frobs_train import open_pretrained
from frobs_view.page import FILES, write_page
from generate.environments import slug

SHOWN = {
    "frobs/Irb120Reach-v0": "Reach a goal with an IRB 120",
    "frobs/PandaPush-v0": "Push a cube with a Panda",
    "frobs/PandaPickAndPlace-v0": "Pick and place with a Panda",
    "frobs/Ur5Lift-v0": "Lift a cube with a UR5",
}
"""IDs whose trained policies visitors can run, and the labels of their buttons."""


def fragment() -> str:
    """Return the buttons that open the pages, as Markdown, or an empty text without the files."""
    if not (FILES / "app.js").is_file():
        return ""
    buttons = "".join(
        f'<button type="button" data-page="pages/{slug(env_id)}/index.html">{label}</button>\n'
        for env_id, label in SHOWN.items()
    )
    return (
        "A trained policy can also run [in your browser](how-to/send-a-page.md), where you can push the robot and move the "
        f'goal. The first click loads 6 MB:\n\n```{{raw}} html\n<div class="live-pages">\n{buttons}</div>\n```\n'
    )


def write(app: Any, error: Exception | None) -> None:
    """Write the pages beside the documentation, after it was built."""
    if error is not None or app.builder.name != "html" or not (FILES / "app.js").is_file():
        return
    for env_id in SHOWN:
        write_page(open_pretrained(env_id), Path(app.outdir) / "pages" / slug(env_id))
