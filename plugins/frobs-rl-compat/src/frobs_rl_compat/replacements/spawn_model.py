"""Spawn a model from a file, a parameter or standard input, like ``gazebo_ros``'s ``spawn_model`` program."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from frobs_cli.errors import MissingFileError
from frobs_core.util.errors import FrobsError
from frobs_core.util.rotations import quat_from_rpy
from frobs_models import path_folders
from frobs_rl_compat.gazebo.poses import pose_message
from frobs_rl_compat.gazebo.spawn import RefusedError
from frobs_rl_compat.replacements import arguments
from frobs_ros.errors import MasterError, ServiceError
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import master_uri, require
from frobs_ros.ros.services import call, wait_for

_TIMEOUT = 60.0
"""Maximum time to wait for the simulation, and for the model that ``-wait`` names [s]."""


def main() -> int:
    """Spawn a model, and return the exit code, which is 1 after an error."""
    options = _parse(arguments())
    try:
        use_ros()
        require()
        _spawn(options)
    except FrobsError as error:
        sys.stderr.write(f"error: spawn_model: {error}\n")
        return 1
    return 0


def _spawn(options: Namespace) -> None:
    import rospy
    from gazebo_msgs.srv import DeleteModel, SetModelConfiguration, SpawnModel
    from std_srvs.srv import Empty

    rospy.init_node("spawn_model", anonymous=True)
    root = options.gazebo_namespace.rstrip("/")
    service = f"{root}/spawn_{'urdf' if options.urdf else 'sdf'}_model"
    text = _text(options)
    if options.wait:
        _wait_for(f"{root}/model_states", options.wait)
    namespace = rospy.get_namespace() if options.robot_namespace is None else options.robot_namespace
    quat = quat_from_rpy([options.R, options.P, options.Y]).tolist()
    pose = pose_message((options.x, options.y, options.z), (*quat[1:], quat[0]))
    _call(service, SpawnModel, options.model, text, namespace, pose, options.reference_frame)
    if options.J:
        names, positions = [joint for joint, _ in options.J], [float(position) for _, position in options.J]
        _call(
            f"{root}/set_model_configuration",
            SetModelConfiguration,
            options.model,
            options.param or "",
            names,
            positions,
        )
    if options.unpause:
        _call(f"{root}/unpause_physics", Empty)
    sys.stdout.write(f"spawn_model: the model '{options.model}' was spawned\n")
    if options.b:
        rospy.on_shutdown(lambda: _call(f"{root}/delete_model", DeleteModel, options.model))
        rospy.spin()


def _text(options: Namespace) -> str:
    """Return the model's XML text from the selected source."""
    import rospy

    if options.stdin:
        return sys.stdin.read()
    if options.param is not None:
        if not rospy.has_param(options.param):
            raise MasterError(master_uri(), f"there is no parameter '{rospy.resolve_name(options.param)}'")
        return str(rospy.get_param(options.param))
    file = Path(options.file) if options.file is not None else _of_database(options.database)
    if not file.is_file():
        raise MissingFileError(file, "pass the path of a URDF or SDF file")
    return file.read_text("utf-8")


def _of_database(name: str) -> Path:
    """Find a model's SDF file in the folders of ``GAZEBO_MODEL_PATH``, and return the file's path."""
    for folder in path_folders("GAZEBO_MODEL_PATH"):
        if (folder / name / "model.sdf").is_file():
            return folder / name / "model.sdf"
    raise MissingFileError(Path(name) / "model.sdf", "add the parent folder of the model's folder to GAZEBO_MODEL_PATH")


def _call(name: str, kind: type[Any], *fields: Any) -> None:
    wait_for(name, _TIMEOUT)
    answer = call(name, kind, *fields)
    if not getattr(answer, "success", True):
        raise RefusedError(name, answer.status_message)


def _wait_for(topic: str, model: str) -> None:
    import rospy
    from gazebo_msgs.msg import ModelStates

    try:
        while model not in rospy.wait_for_message(topic, ModelStates, _TIMEOUT).name:
            pass
    except rospy.ROSException as error:
        raise ServiceError(
            topic, f"no model states were received while waiting for the model '{model}': {error}"
        ) from error


def _parse(given: list[str]) -> Namespace:
    parser = ArgumentParser(prog="spawn_model", description=__doc__, allow_abbrev=False)
    kind = parser.add_mutually_exclusive_group(required=True)
    kind.add_argument("-urdf", action="store_true", help="the model is in URDF or xacro format")
    kind.add_argument("-sdf", action="store_true", help="the model is in SDF format")
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("-file", metavar="FILE", help="file that contains the model")
    source.add_argument("-param", metavar="NAME", help="ROS parameter that contains the model")
    source.add_argument("-database", metavar="NAME", help="name of a model in one of the folders in GAZEBO_MODEL_PATH")
    source.add_argument("-stdin", action="store_true", help="read the model from standard input")
    parser.add_argument("-model", metavar="NAME", required=True, help="name of the model in the simulation")
    parser.add_argument("-robot_namespace", metavar="NS", help="namespace of the robot's topics and services")
    parser.add_argument("-gazebo_namespace", metavar="NS", default="/gazebo", help="namespace of the simulation")
    parser.add_argument(
        "-reference_frame",
        metavar="NAME",
        default="",
        help="model or link that the pose is relative to; default: the world",
    )
    parser.add_argument("-wait", metavar="MODEL", help="wait until this model is in the simulation")
    parser.add_argument("-unpause", action="store_true", help="unpause the simulation afterwards")
    parser.add_argument(
        "-package_to_model", action="store_true", help="no effect, because package:// URIs are always supported"
    )
    parser.add_argument("-b", action="store_true", help="keep running, and delete the model on exit")
    parser.add_argument(
        "-J", nargs=2, metavar=("JOINT", "POSITION"), action="append", help="initial position of a joint"
    )
    for name, unit in (("x", "m"), ("y", "m"), ("z", "m"), ("R", "rad"), ("P", "rad"), ("Y", "rad")):
        parser.add_argument(f"-{name}", type=float, default=0.0, metavar=unit)
    return parser.parse_args(given)


if __name__ == "__main__":
    sys.exit(main())
