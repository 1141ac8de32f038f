"""``frobs view``: look at an environment, a policy or a robot file in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.completion import complete_policy
from frobs_cli.field_options import option
from frobs_cli.output import print_line
from frobs_core.util.errors import ConflictingOptionsError

if TYPE_CHECKING:
    from frobs_train import Run
    from frobs_view.server import ViewServer


@dataclass(frozen=True, kw_only=True)
class ViewOptions:
    """Options of ``frobs view``.

    Attributes:
        policy: Policy that the page offers, in addition to those of the environment: a name from 'frobs list policies',
            or the path of a run folder, bundle or model file. Repeatable; the first acts at the start.
        simulator: Simulator: a name from 'frobs list simulators'.
        num_envs: Number of environments of an ID, one of which is shown at a time.
        seed: Seed of the first episode.
        follow: Show the newest policy and the learning curve of a run that is being trained.
        host: Network address of this machine on which the server listens, so that other machines can open the page. The
            printed address contains a token that is required to open the page.
        port: Port of the page.
        seconds: End after this time. By default, the page is served until Ctrl-C is pressed.
        settings: Environment setting of an ID, such as environment_kwargs.robot=ur5. Repeatable.
        trust: Also accept a model file that executes code when it is loaded, and a bundle that refers to files, modules
            or wrappers. Use this flag only if you trust the author of the file.
    """

    policy: Sequence[str] = option((), autocompletion=complete_policy)
    simulator: str | None = option(None, show_default="the environment's simulator")
    num_envs: int = option(1, min=1)
    seed: int = option(0, metavar="S", min=0)
    follow: bool = option(False)
    host: str | None = option(None, metavar="ADDRESS", show_default="only this machine")
    port: int | None = option(None, min=1, max=65535, show_default="the first free one from 8080 on")
    seconds: float | None = option(None, metavar="S", min=0.0)
    settings: Sequence[str] = option((), name="set", metavar="KEY=VALUE")
    trust: bool = option(False)


def view(
    target: Annotated[
        str,
        typer.Argument(
            metavar="WHAT",
            show_default=False,
            help="Environment ID, run folder, policy bundle, robot's model file, or name from 'frobs list robots'.",
        ),
    ],
    options: ViewOptions,
) -> None:
    """Look at an environment, a policy or a robot file in the browser.

    The page shows the robots with their real meshes, the goal, contacts and curves of the reward. On the page, you can
    choose a policy, pause, make single steps, and drag the goal. For a robot file, the page has a slider for each joint
    and lists the findings of 'frobs doctor robot'.

    Example:
        $ frobs view frobs/PandaPickAndPlace-v0
        $ frobs view frobs/Irb120Reach-v0 --policy runs/first
        $ frobs view runs/first
        $ frobs view reach.frobs
        $ frobs view my_robot.urdf
        $ frobs view runs/first --follow
    """
    from frobs_view.server import ViewServer

    show = _show_robot if _is_robot(target) else _show_environment
    if options.follow and (show is _show_robot or Path(target).is_file() or _is_id(target)):
        raise ConflictingOptionsError(["--follow", target], "only a run folder can be followed")
    if show is _show_robot and (unused := _unused(options)):
        raise ConflictingOptionsError([*unused, target], "the page of a robot has no environment")
    with ExitStack() as stack:
        stack.enter_context(suppress(KeyboardInterrupt))
        name = Path(target).name if Path(target).is_file() else target
        server = stack.enter_context(closing(ViewServer(options.host, options.port, title=f"FRobs: {name}")))
        show(target, options, server, stack)


def _is_robot(target: str) -> bool:
    from frobs_core import plugins
    from frobs_core.kernel.robot_file import is_robot_file
    from frobs_core.models import is_model_file

    return is_robot_file(target) or is_model_file(target) or target in plugins.records("robot")


def _unused(options: ViewOptions) -> list[str]:
    """Return the options that the page of a robot does not use."""
    given = {
        "--policy": options.policy,
        "--simulator": options.simulator,
        "--num-envs": options.num_envs > 1,
        "--seed": options.seed,
        "--set": options.settings,
        "--trust": options.trust,
    }
    return [flag for flag, value in given.items() if value]


def _is_id(target: str) -> bool:
    from frobs_core.plugins.registry import find_spec
    from frobs_core.util.errors import FrobsError

    if Path(target).exists():
        return False
    try:
        find_spec(target)
    except FrobsError:
        return False
    return True


def _clock(seconds: float | None) -> Any:
    """Return a function that returns True until a number of seconds has passed."""
    import math
    import time

    end = time.monotonic() + (math.inf if seconds is None else seconds)
    return lambda: time.monotonic() < end


def _show_robot(target: str, options: ViewOptions, server: ViewServer, stack: ExitStack) -> None:
    from frobs_view.robot import RobotPage

    page = RobotPage(target, server)
    print_line(server.address)
    page.run(_clock(options.seconds))


def _show_environment(target: str, options: ViewOptions, server: ViewServer, stack: ExitStack) -> None:
    from frobs_view.following import Following, until_closed, wait_for_run
    from frobs_view.player import Player
    from frobs_view.viewer import BrowserViewer

    is_running = _clock(options.seconds)
    if options.follow:
        is_running = until_closed(is_running)
        if not wait_for_run(Path(target), is_running):
            return
    run = _open(target, options)
    env = _make(run, options)
    stack.callback(env.close)
    viewer = BrowserViewer(server)
    viewer.bind(env.unwrapped)
    env.unwrapped.viewer = viewer  # where policies through which a person acts find it
    env.unwrapped.after_step.append(lambda result: viewer.update())
    player = stack.enter_context(closing(Player(env, viewer, _policies(run, target, env, options), options.seed)))
    if options.follow:
        player.after_step.append(Following(Path(target), env, viewer, player, str(run.path)).poll)
    print_line(server.address)
    player.run(is_running)


def _open(target: str, options: ViewOptions) -> Run:
    """Return the run or bundle, or an ID with its settings."""
    from frobs_train import PolicyRun, open_policy

    if Path(target).exists():
        if options.settings:
            raise ConflictingOptionsError(["--set", target], "a run stores its own settings")
        return open_policy(target, trust=options.trust)
    from frobs_core.plugins.registry import find_spec

    find_spec(target)
    return PolicyRun("random", target, options.settings)


def _make(run: Run, options: ViewOptions) -> Any:
    """Make the environment of a run, or several of them without the run's wrappers."""
    import gymnasium as gym

    from frobs_core.plugins.registry import find_spec
    from frobs_train import make_env

    keywords = run.config.keywords(randomize=False)
    if options.simulator is not None:
        keywords["simulator"] = options.simulator
    if options.num_envs == 1:
        env: Any = make_env(run.config.environment, keywords, wrappers=run.config.wrappers)
    else:
        if run.config.wrappers:
            raise ConflictingOptionsError(["--num-envs", "wrappers"], "a wrapped environment is shown alone")
        env = gym.make_vec(
            find_spec(run.config.environment),
            num_envs=options.num_envs,
            vectorization_mode="vector_entry_point",
            **keywords,
        )
    if not hasattr(env.unwrapped, "simulation"):
        from frobs_core.util.errors import RunError

        env.close()
        raise RunError(f"{run.config.environment} is not an environment of FRobs, so its robots cannot be drawn.")
    return env


def _policies(run: Run, target: str, env: Any, options: ViewOptions) -> dict[str, Any]:
    """Return functions that open the policies that can be chosen, by name."""
    from functools import partial

    from frobs_core import load_policy
    from frobs_core.plugins.registry import bare_id, pretrained_ids

    own = [str(run.path)] if Path(target).exists() else []
    names = [*options.policy, *(["random"] if options.follow else []), *own]  # a new run may have no policy yet
    names += ["expert"] if env.unwrapped.task.expert else []
    names += ["pretrained"] if bare_id(run.config.environment) in pretrained_ids() else []
    people = ["teleop", "teleop:keyboard", "teleop:gamepad"] if options.num_envs == 1 else []
    trust = {"trust": True} if options.trust else {}
    return {
        name: partial(load_policy, run.path if name in own else name, env, **(trust if Path(name).exists() else {}))
        for name in dict.fromkeys([*names, "random", *people])
    }
