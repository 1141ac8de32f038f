"""A page for each environment ID: what ``frobs show ID`` says, and what its task says about itself."""

import gymnasium as gym

from frobs_core import registry
from frobs_core.cli.describe_environment import describe_environment
from frobs_core.errors import FrobsError
from generate import facts
from generate.rst import code, directive, escape, heading, label, literal, table, toctree


def slug(env_id: str) -> str:
    """Return the name of an ID's page."""
    return env_id.rpartition("/")[2].lower()


def page() -> str:
    """Return the page that lists all IDs."""
    found = registry.environments()
    rows = [
        (
            f":doc:`{env_id} <environments/{slug(env_id)}>`",
            *map(escape, (record.summary, record.robot or "any", task.name)),
        )
        for env_id, (task, record) in found.items()
    ]
    text = label("environments") + heading("Environments")
    text += (
        "Each ID is a task with a robot, and what both are given by default. All take ``simulator=``, ``controller=``, "
        "``reward_type=``, ``render_mode=`` and the parameters of their task as keywords. ``frobs show ID`` prints "
        "the same facts.\n\n"
    )
    text += table(["ID", "what it is", "robot", "task"], rows)
    text += (
        "Any other combination is ``frobs_core:frobs/Env-v0``, which is told all of its parts, here with a limit of 100 "
        "control steps:\n\n"
    )
    text += literal(
        'gym.make(\n    "frobs_core:frobs/Env-v0",\n    robot="irb120",\n    task="reach",\n'
        '    controller="tcp_delta_position",\n    simulator="mujoco",\n    max_episode_steps=100,\n)',
        "python",
    )
    return text + toctree((f"environments/{slug(env_id)}" for env_id in found), hidden="")


def pages() -> dict[str, str]:
    """Return a page for each ID."""
    return {f"environments/{slug(env_id)}": _page(env_id) for env_id in registry.environments()}


def _page(env_id: str) -> str:
    task, record = registry.environments()[env_id]
    found = describe_environment(gym.spec(env_id))
    given = "" if record.robot else ', robot="path/to/arm.urdf", tcp="LINK"'
    text = heading(env_id) + f"{escape(record.summary)}.\n\n"
    text += literal(f'env = gym.make("frobs_core:{env_id}"{given})', "python")
    if "error" in found:
        text += f".. warning::\n\n   {escape(found['error'])}\n\n"
    text += facts.scalars(found) + _observation(env_id) + facts.tables(found)
    text += heading("The task", "-") + f"{code(task.name)}: {escape(task.summary)}.\n\n"
    module, _, name = task.entry_point.partition(":")
    return text + directive("autoclass", f"{module}.{name}", no_members="", no_index="")


def _observation(env_id: str) -> str:
    """Return a table of what the columns of the observation are, where the task says so."""
    try:
        env = gym.make(env_id, disable_env_checker=True)
    except (FrobsError, gym.error.Error):
        return ""
    terms = getattr(env.unwrapped.task, "observation_terms", {})
    env.close()
    rows, start = [], 0
    for name, term in terms.items():
        columns = f"{start} … {start + len(term.low) - 1}"
        rows.append((columns, code(name), escape(term.unit), _numbers(term.low), _numbers(term.high)))
        start += len(term.low)
    if not rows:
        return ""
    return ".. rubric:: Observation\n\n" + table(["columns", "what", "unit", "lowest", "highest"], rows)


def _numbers(values) -> str:
    same = (values == values[0]).all()
    return escape(f"{values[0]:.4g}" if same else ", ".join(f"{value:.4g}" for value in values))
