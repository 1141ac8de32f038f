"""A page for each environment ID: what ``frobs show ID`` says, what its task says about itself, and how it looks."""

from collections.abc import Iterator
from pathlib import Path

import gymnasium as gym

from frobs_cli.describe_environment import describe_environment, readable_environment, space_text
from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_core.plugins.records import KINDS
from frobs_core.util.errors import FrobsError
from frobs_train.export.bundle_run import BundleRun
from frobs_train.export.pretrained import read_pretrained
from generate import facts
from generate.pictures import draw_curve
from generate.rst import code, directive, escape, heading, label, literal, table, toctree

DOCS = Path(__file__).parents[1]
_AT_A_GLANCE = ("robot", "controller", "simulator", "task", "from")
_IN_SECTIONS = ("pretrained", "success", "reward_terms", "action_space", "observation_space", "max_episode_steps")


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
            "yes" if record.pretrained else "",
        )
        for env_id, (task, record) in found.items()
    ]
    text = label("environments") + heading("Environments")
    text += (
        "Each ID combines a task with a robot and their default settings. All IDs accept ``simulator=``, ``controller=``, "
        "``reward_type=``, ``render_mode=`` and the parameters of their task as keywords. ``frobs show ID`` prints "
        "the same facts, and ``frobs play ID --pretrained`` shows the trained policy that comes with an ID.\n\n"
    )
    text += table(["ID", "what it is", "robot", "task", "trained policy"], rows, widths="34 30 12 14 10")
    text += (
        "For any other combination, use ``frobs_core:frobs/Env-v0`` and set all parts, in this example with a limit of "
        "100 control steps:\n\n"
    )
    text += literal(
        'gym.make(\n    "frobs_core:frobs/Env-v0",\n    robot="irb120",\n    task="reach",\n'
        '    controller="tcp_delta_position",\n    simulator="mujoco",\n    max_episode_steps=100,\n)',
        "python",
    )
    return text + toctree((f"environments/{slug(env_id)}" for env_id in found), hidden="")


def pages(folder: Path | None = None) -> dict[str, str]:
    """Return a page for each ID.

    Args:
        folder: Where the pages will lie: their pictures are drawn there; None: no pictures.
    """
    return {f"environments/{slug(env_id)}": _page(env_id, folder) for env_id in registry.environments()}


def _page(env_id: str, folder: Path | None) -> str:
    task, record = registry.environments()[env_id]
    found = describe_environment(gym.spec(env_id))
    run = _pretrained(env_id)
    given = "" if record.robot else ', robot="path/to/arm.urdf", tcp="LINK"'
    text = label(f"environment-{slug(env_id)}") + heading(env_id) + f"{escape(record.summary)}.\n\n"
    text += _animation(env_id)
    text += literal(f'env = gym.make("frobs_core:{env_id}"{given})', "python")
    if run is not None:
        text += literal(f"frobs play {env_id} --pretrained", "bash")
    if "error" in found:
        text += f".. warning::\n\n   {escape(found['error'])}\n\n"
    text += "".join(_sections(env_id, found, run, folder))
    text += heading("The task", "-") + f"{code(task.name)}: {escape(task.summary)}.\n\n"
    module, _, name = task.entry_point.partition(":")
    return text + directive("autoclass", f"{module}.{name}", no_members="", no_index="")


def _sections(env_id: str, found: dict, run: BundleRun | None, folder: Path | None) -> Iterator[str]:
    """Yield what ``frobs show`` says, a section for each question."""
    task, record = registry.environments()[env_id]
    try:
        env = gym.make(env_id, disable_env_checker=True) if record.robot else None
    except (FrobsError, gym.error.Error):
        env = None
    yield table([], [(key, _part(key, found[key])) for key in _AT_A_GLANCE if found.get(key)], widths="25 75")
    yield heading("Spaces", "-")
    yield _action(found, record.controller)
    yield from _observation(env, found)
    yield heading("Reward", "-") + _reward(env_id, task, record.robot)
    yield heading("Success and end", "-") + _end(env, found)
    if env is not None:
        env.close()
    if run is not None:
        yield heading("The trained policy", "-") + _policy(env_id, found, run, folder)
    yield heading("What can be set", "-")
    rest = {key: value for key, value in found.items() if key not in (*_AT_A_GLANCE, *_IN_SECTIONS)}
    yield facts.scalars(rest) + facts.tables(rest)


def _part(kind: str, name: str) -> str:
    """Return a part's name, with a link to what it is."""
    known = kind in KINDS and name in plugins.records(kind)
    return f":ref:`{name} <{kind}-{name.replace('_', '-')}>`" if known else escape(name)


def _animation(env_id: str) -> str:
    """Return the animation of the gallery and the still that replaces it, or only a still."""
    path = f"/images/gallery/{slug(env_id)}"
    moves = (DOCS / f"{path}.webp".lstrip("/")).exists()
    alt = f"{env_id}, {'an episode' if moves else 'at the start of an episode'}"
    still = directive("image", f"{path}-still.webp", alt=alt, class_="still animation" if moves else "animation")
    return directive("image", f"{path}.webp", alt=alt, class_="moving animation") + still if moves else still


def _action(found: dict, controller: str) -> str:
    where = _part("controller", controller)
    return (
        f"An **action** is {code(found.get('action_space', ''))}, which the controller {where} turns into motion.\n\n"
    )


def _observation(env: gym.Env | None, found: dict) -> Iterator[str]:
    """Yield what is observed: each part of it, and its columns where the task says what they are."""
    if env is None:
        yield f"The **observation** has {escape(found.get('observation_space', 'the columns that its task says'))}.\n\n"
        return
    space, observations = env.observation_space, env.unwrapped.observations
    parts = space.spaces if isinstance(space, gym.spaces.Dict) else {"": space}
    if "" in parts:
        yield f"An **observation** is {code(space_text(space))}{' with the following columns:'}\n\n"
    else:
        rows = [(code(key), code(space_text(part))) for key, part in parts.items()]
        yield "An **observation** is a dictionary:\n\n" + table(["key", "space"], rows)
    rows = []
    for row in observations.describe():
        term, (first, last) = observations.terms[row["name"]], row["columns"]
        columns = str(first) if last == first else f"{first} … {last}"
        rows.append((columns, code(row["name"]), escape(term.unit), _numbers(term.low), _numbers(term.high)))
    if rows:
        owner = "" if "" in parts else "The columns of ``observation``:\n\n"
        yield owner + table(["columns", "what", "unit", "lowest", "highest"], rows)


def _reward(env_id: str, task, robot: str) -> str:
    """Return the terms of each kind of reward, as a step tells them."""
    cls = task.load()
    text = ""
    for reward_type in cls.reward_types:
        names = _term_names(env_id, reward_type) if robot else list(cls.reward_meanings)
        default = ", the default," if len(cls.reward_types) > 1 and reward_type == cls.reward_types[0] else ""
        shown = f"{code(f'reward_type={reward_type!r}')}{default}" if robot else "Depending on ``reward_type``"
        rows = [(code(name), escape(cls.reward_meanings.get(name, ""))) for name in names]
        verb = " is the sum of" if len(rows) > 1 else " is"
        text += f"{shown}{verb}\n\n{table(['term', 'what it is'], rows)}" if rows else f"{shown}.\n\n"
        if not robot:
            break
    return text + "Each step's ``info`` contains the terms as ``frobs/reward/TERM``.\n\n"


def _term_names(env_id: str, reward_type: str) -> list[str]:
    prefix = "frobs/reward/"
    try:
        env = gym.make(env_id, reward_type=reward_type, disable_env_checker=True)
    except (FrobsError, gym.error.Error):
        return []
    env.reset(seed=0)
    info = env.step(env.action_space.sample())[-1]
    env.close()
    return [key.removeprefix(prefix) for key in info if key.startswith(prefix)]


def _end(env: gym.Env | None, found: dict) -> str:
    text = f"An episode is a success if {escape(found['success'])}. " if found.get("success") else ""
    steps = found["max_episode_steps"]
    text += f"An episode is truncated after {steps:,} control steps"
    if env is not None:
        timestep = env.unwrapped.control_timestep
        text += f" of {timestep:g} s, which is {steps * timestep:g} s"
    return f'{text}. ``info["is_success"]`` reports the success at each step.\n\n'


def _policy(env_id: str, found: dict, run: BundleRun, folder: Path | None) -> str:
    shown = readable_environment(found)["pretrained"]
    cells = {"try it", "by", "file", "commit"}
    rows = [(key, code(value) if key in cells else escape(value)) for key, value in shown.items()]
    text = table([], rows, widths="25 75")
    name = f"{slug(env_id)}-curve.png"
    curve = run.bundle.manifest["training"].get("curve") or {}
    if folder is not None and draw_curve(curve, folder / "environments" / name):
        text += directive("figure", name, alt=f"Learning curve of the policy of {env_id}").rstrip()
        text += "\n\n   Learning curve, with exploration.\n\n"
    return text


def _pretrained(env_id: str) -> BundleRun | None:
    try:
        return BundleRun(read_pretrained(env_id)) if registry.environments()[env_id][1].pretrained else None
    except FrobsError:
        return None  # the page says so: the facts have the error


def _numbers(values) -> str:
    same = (values == values[0]).all()
    return escape(f"{values[0]:.4g}" if same else ", ".join(f"{value:.4g}" for value in values))
