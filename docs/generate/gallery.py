"""The gallery of all IDs: an animation, the robot, the task, and the success and training time of the policy shown."""

from collections.abc import Mapping
from typing import Any

from layers import ROOT

from frobs_cli.catalogue import source_of
from frobs_core.plugins import registry
from frobs_core.plugins.records import EnvironmentRecord
from frobs_core.util.errors import FrobsError
from frobs_train.export.pretrained import describe_pretrained, read_pretrained
from generate.environments import slug

_TABS = {
    "frobs-tasks-reach": "Reaching",
    "frobs-tasks-navigation": "Navigation",
    "frobs-tasks-manipulation": "Manipulation",
    "frobs-tasks-legacy": "FRobs_RL",
}
"""Title of the tab with the IDs of a distribution."""


def fragment() -> str:
    """Return the gallery as Markdown, for the index to include."""
    cards: dict[str, list[str]] = {title: [] for title in _TABS.values()}
    for env_id, (task, record) in registry.environments().items():
        distribution = source_of("task", task).partition(" ")[0]
        if distribution in _TABS:
            cards[_TABS[distribution]].append(_card(env_id, task.name, record))
    tabs = [
        f"::::{{tab-item}} {title} ({len(found)})\n:::{{grid}} 2 2 3 3\n:gutter: 2\n:class-container: gallery\n\n"
        f"{''.join(found)}:::\n::::\n"
        for title, found in cards.items()
    ]
    return f":::::{{tab-set}}\n{''.join(tabs)}:::::\n"


def _card(env_id: str, task: str, record: EnvironmentRecord) -> str:
    name = slug(env_id)
    lines = [
        "```{grid-item-card}",
        f":link: reference/generated/environments/{name}",
        ":link-type: doc",
        "",
        f"{picture(f'images/gallery/{name}', record.summary)}",
        "",
        f"**{env_id.rpartition('/')[2]}**",
        "",
        f"{record.robot or 'any robot'} · {task}",
        "",
        _results(env_id, record),
        "```",
        "",
    ]
    return "\n".join(lines)


def picture(path: str, alt: str) -> str:
    """Return an animation with the still that replaces it, or the still alone if there is no animation."""
    still = f"![{alt}]({path}-still.webp)"
    moves = (ROOT / "docs" / f"{path}.webp").exists()
    return f"![{alt}]({path}.webp){{.moving}}{still}{{.still}}" if moves else still


def _results(env_id: str, record: EnvironmentRecord) -> str:
    """Return the success rate and the training time of the trained policy, or what the animation shows otherwise."""
    if not record.pretrained:
        moves = (ROOT / "docs" / "images" / "gallery" / f"{slug(env_id)}.webp").exists()
        return "scripted expert" if moves else "you choose the robot"
    try:
        facts: Mapping[str, Any] = describe_pretrained(read_pretrained(env_id))
    except FrobsError as error:
        return str(error)
    return f"{facts['success_rate']:.1%} success · {facts['seconds'] / 60:.1f} min"
