"""Manage controllers like the ROS programs ``controller_manager``, ``spawner`` and ``unspawner``."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from frobs_core.util.errors import FrobsError
from frobs_core.util.yaml import load_yaml
from frobs_rl_compat.replacements import arguments
from frobs_rl_compat.ros import ros_controllers
from frobs_rl_compat.ros.logged_errors import or_raise
from frobs_ros.ros import services
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import require
from frobs_ros.ros.names import join

_LISTS = ("list", "list-types", "reload-libraries")


def main() -> int:
    """Run the program that the first argument names, and return the exit code, which is 1 after an error."""
    program, *given = arguments()
    options = _parse(program, given)
    try:
        use_ros()
        require()
        import rospy

        rospy.init_node(program, anonymous=True)
        namespace = join(rospy.get_namespace(), getattr(options, "namespace", ""))
        if program == "controller_manager":
            _manage(namespace, options.command, options.controllers)
        else:
            _spawn(namespace, options, start=program == "spawner")
    except FrobsError as error:
        sys.stderr.write(f"error: {program}: {error}\n")
        return 1
    return 0


def _manage(namespace: str, command: str, names: Sequence[str]) -> None:
    from controller_manager_msgs.srv import ListControllers, ListControllerTypes, ReloadControllerLibraries

    def ask(service: str, kind: Any, *fields: Any) -> Any:
        return services.call(join(namespace, "controller_manager", service), kind, *fields)

    match command:
        case "list":
            for controller in ask("list_controllers", ListControllers).controller:
                sys.stdout.write(f"'{controller.name}' - '{controller.type}' ( {controller.state} )\n")
        case "list-types":
            sys.stdout.writelines(f"{name}\n" for name in ask("list_controller_types", ListControllerTypes).types)
        case "reload-libraries":
            ask("reload_controller_libraries", ReloadControllerLibraries, False)
        case "load" | "unload":
            change = or_raise(getattr(ros_controllers, f"{command}_controller_srv"))
            for name in names:
                change(name, namespace)
        case _:
            change = or_raise(getattr(ros_controllers, f"{command}_controllers_srv"))
            change(names, namespace)
            sys.stdout.write(f"{command}: {', '.join(names)}\n")


def _spawn(namespace: str, options: Any, *, start: bool) -> None:
    """Load and start controllers, or stop them if ``start`` is False, and undo the change when the program ends."""
    import rospy

    services.wait_for(join(namespace, "controller_manager", "load_controller"), options.timeout)
    if getattr(options, "wait_for", None):
        rospy.wait_for_message(options.wait_for, rospy.AnyMsg)
    names = [name for given in options.controllers for name in _names(given, namespace)]
    if not start:
        or_raise(ros_controllers.stop_controllers_srv)(names, namespace)
        undo = partial(ros_controllers.start_controllers_srv, names, namespace)
    else:
        for name in names:
            or_raise(ros_controllers.load_controller_srv)(name, namespace)
        if not options.stopped:
            or_raise(ros_controllers.start_controllers_srv)(names, namespace)
        undo = partial(ros_controllers.kill_controllers_srv, names, namespace)
    sys.stdout.write(f"{'spawned' if start else 'stopped'}: {', '.join(names)}\n")
    sys.stdout.flush()
    rospy.on_shutdown(undo)
    rospy.spin()


def _names(given: str, namespace: str) -> list[str]:
    """Return the names of the given controllers, after loading their parameters if a YAML file is given."""
    path = Path(given)
    if path.suffix not in (".yaml", ".yml"):
        return [given]
    import rospy

    parameters = load_yaml(path)
    for name, settings in parameters.items():
        rospy.set_param(join(namespace, name), settings)
    return list(parameters)


def _parse(program: str, given: list[str]) -> Any:
    parser = ArgumentParser(prog=program, description=__doc__, allow_abbrev=False)
    if program == "controller_manager":
        commands = parser.add_subparsers(dest="command", required=True)
        for command in _LISTS:
            commands.add_parser(command).set_defaults(controllers=[])
        for command in ("load", "unload", "start", "stop", "spawn", "kill"):
            commands.add_parser(command).add_argument("controllers", nargs="+", metavar="NAME")
        return parser.parse_args(given)
    parser.add_argument(
        "controllers", nargs="+", metavar="NAME", help="name of a controller, or a YAML file that defines controllers"
    )
    parser.add_argument("--namespace", metavar="NS", default="", help="namespace of the controller manager")
    parser.add_argument(
        "--timeout", metavar="S", type=float, default=30.0, help="maximum time to wait for the controller manager [s]"
    )
    if program == "spawner":
        parser.add_argument("--stopped", action="store_true", help="load the controllers, but do not start them")
        parser.add_argument(
            "--wait-for", metavar="TOPIC", help="load the controllers after the first message on this topic"
        )
    return parser.parse_args(given)


if __name__ == "__main__":
    sys.exit(main())
