"""The controller JointTrajectoryController, which follows trajectories from a topic or an action."""

from __future__ import annotations

import queue
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import FrobsError, UnknownNameError
from frobs_ros.bridge import LOG
from frobs_ros.bridge.controllers.controller import Controller, listed
from frobs_ros.bridge.controllers.goal import Points, read_points
from frobs_ros.bridge.controllers.pid import Pid
from frobs_ros.bridge.controllers.spline import Spline
from frobs_ros.bridge.controllers.tolerances import Tolerances
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import NANO, World
from frobs_ros.errors import TrajectoryJointsError
from frobs_ros.messages.types import find_type


class TrajectoryController(Controller):
    """Controller that follows trajectories from the ``command`` topic and the ``follow_joint_trajectory`` action.

    The controller publishes its state on the ``state`` topic. With the position interface, the drives also receive the
    target velocity to prevent lag. With the velocity and effort interfaces, a PID controller with the gains
    ``gains/<joint>`` and the feedforward gain ``velocity_ff/<joint>`` follows the trajectory.

    Args:
        parameters: Supported keys are ``joints``, ``constraints``, ``gains``, ``velocity_ff``, ``state_publish_rate``
            and ``allow_partial_joints_goal``.
    """

    def __init__(self, model: Model, topic: str, parameters: Mapping[str, Any], interface: CommandMode) -> None:
        import rospy
        from actionlib import ActionServer
        from control_msgs.msg import FollowJointTrajectoryAction

        super().__init__(model, topic, parameters, interface, float(parameters.get("state_publish_rate", 50.0)))
        self.claim(listed(parameters, "joints"))
        self._partial = bool(parameters.get("allow_partial_joints_goal", False))
        self._default_tolerances = self._tolerances = Tolerances.from_parameters(self.joints, parameters)
        self._pid, self._forward = None, np.zeros(len(self.joints))
        if interface is not CommandMode.POSITION:
            gains, ahead = parameters.get("gains", {}), parameters.get("velocity_ff", {})
            self._pid = Pid([gains.get(joint, {}) for joint in self.joints], f"the controller {topic} (gains)")
            self._forward = np.array([float(ahead.get(joint, 0.0)) for joint in self.joints])
        self._feedback = find_type("control_msgs/FollowJointTrajectoryFeedback")
        self._result = find_type("control_msgs/FollowJointTrajectoryResult")
        self._runs, self._now = False, 0.0
        self._held: Floats = np.zeros(len(self.joints))
        self._spline = Spline(np.zeros(1), self._held[None])
        self._desired = (self._held, self._held, self._held)
        self._goal: Any = None
        self._inbox: queue.SimpleQueue[tuple[Points | None, Any]] = queue.SimpleQueue()
        self._state = self.publisher(f"{topic}/state", "control_msgs/JointTrajectoryControllerState")
        self.subscribe(f"{topic}/command", "trajectory_msgs/JointTrajectory", self._take, queue_size=10)
        # A rate of 0 keeps actionlib from starting its timer. The timer would fail when simulated time jumps back.
        rospy.set_param("/gazebo/actionlib_status_frequency", 0)
        name, kind = f"{topic}/follow_joint_trajectory", FollowJointTrajectoryAction
        self._server = ActionServer(name, kind, goal_cb=self._accept, cancel_cb=self._cancel, auto_start=False)
        # The action server shuts down its timer when it stops, so provide a dummy timer.
        self._server.status_timer = SimpleNamespace(shutdown=lambda: None)
        self._server.start()

    def _take(self, trajectory: Any) -> None:
        """Accept a trajectory from the topic. A trajectory without points stops the robot. Called in a rospy thread."""
        if not self._runs:
            LOG.error("%s/command: the trajectory is ignored because the controller is not running", self.topic)
            return
        try:
            points = read_points(trajectory, self.joints, self._held, self._partial) if trajectory.points else None
        except FrobsError as error:
            LOG.error("%s/command: %s", self.topic, error)
            return
        self._inbox.put((points, None))

    def _accept(self, handle: Any) -> None:
        """Accept or reject an action goal. Called in a rospy thread."""
        goal = handle.get_goal()
        code, text = self._result.INVALID_GOAL, ""
        if not self._runs:
            text = "the controller is not running"
        elif not goal.trajectory.points:
            text = "the trajectory has no points"
        else:
            try:
                points = read_points(goal.trajectory, self.joints, self._held, self._partial)
            except (UnknownNameError, TrajectoryJointsError) as error:
                code, text = self._result.INVALID_JOINTS, str(error)
            except FrobsError as error:
                text = str(error)
            else:
                if points.start is not None and points.start + points.times[-1] < self._now:
                    code, text = self._result.OLD_HEADER_TIMESTAMP, "the trajectory ends in the past"
        if text:
            LOG.error("%s/follow_joint_trajectory: %s", self.topic, text)
            handle.set_rejected(self._result(error_code=code, error_string=text), text)
            return
        handle.set_accepted()
        self._inbox.put((points, handle))

    def _cancel(self, handle: Any) -> None:
        """Cancel an action goal, which may still wait to be begun. Called in a rospy thread."""
        self._inbox.put((None, handle))

    def start(self, world: World) -> None:
        """Take control of the joints and hold their current positions."""
        super().start(world)
        self._end_goal(None, "")
        self._empty_inbox()
        self._now = world.time_ns / NANO
        self._last_stamp_ns = -1
        self._hold()
        self._runs = True

    def stop(self, world: World) -> None:
        """Release the joints and cancel the active goal."""
        self._runs = False
        self._end_goal(None, "the controller was stopped")
        self._empty_inbox()
        super().stop(world)

    def most_steps(self, world: World) -> int | None:
        """Return 1 if a PID controller requires the state at each physics step, and None otherwise."""
        return None if self._pid is None else 1

    def before(self, world: World, steps: int) -> None:
        """Set the joints' targets for each of the next physics steps."""
        now = world.time_ns / NANO
        while not self._inbox.empty():
            self._begin(*self._inbox.get(), now)
        times = now + world.timestep * np.arange(1.0, steps + 1.0)
        if self._pid is None and times[0] > self._spline.end:
            self._desired = self._held, np.zeros_like(self._held), np.zeros_like(self._held)
            self.command(self._held)
            return
        positions, velocities, accelerations = self._spline.sample(times)
        self._desired = positions[-1], velocities[-1], accelerations[-1]
        if self._pid is None:
            stiffness, damping = (gain[0, self.columns] for gain in self.robot.drive_gains())
            # The drive law contains the damping term Kd·q̇. Adding Kd/Kp·v to the target turns this term into
            # Kd·(q̇ − v).
            ahead = np.divide(damping, stiffness, out=np.zeros_like(damping), where=stiffness > 0.0)
            self.model.joint_targets.look_ahead(self.columns, positions + ahead * velocities)
        else:
            error, rate = positions[0] - self.positions(), velocities[0] - self.velocities()
            self.command(self._forward * velocities[0] + self._pid(error, rate, world.timestep))

    def after(self, world: World) -> None:
        """Check whether the active goal has been reached or a tolerance is violated."""
        self._now = world.time_ns / NANO
        if self._goal is None:
            return
        error = self._desired[0] - self.positions()
        if self._now < self._spline.end:
            joint = self._tolerances.path_violation(error)
            if joint is not None:
                text = f"{self.joints[joint]} is {abs(error[joint]):.4g} from the trajectory"
                self._end_goal(self._result.PATH_TOLERANCE_VIOLATED, text)
                self._hold()
            return
        joint = self._tolerances.goal_violation(error, self.velocities())
        if joint is None:
            self._end_goal(self._result.SUCCESSFUL, "")
        elif self._now > self._spline.end + self._tolerances.goal_time:
            text = f"{self.joints[joint]} is {abs(error[joint]):.4g} from the goal, at {self.velocities()[joint]:.4g}/s"
            self._end_goal(self._result.GOAL_TOLERANCE_VIOLATED, text)

    def _begin(self, points: Points | None, handle: Any, now: float) -> None:
        """Start following a new trajectory, or hold the current positions if ``points`` is None.

        ``handle`` is the action goal of the trajectory, or the one to cancel. It is None if the topic sent it.
        """
        if points is None and handle is not None and handle != self._goal:
            return  # the goal ended before its cancellation arrived
        self._end_goal(None, "another trajectory was sent" if points else "cancelled")
        if points is None:
            self._hold()
            return
        start = now if points.start is None else points.start
        times = start + points.times
        later = times > now
        if not later.any():
            LOG.error("%s: the trajectory is ignored because it ends in the past", self.topic)
            return
        here = self._spline.sample(np.array([now]))

        def join(first: Floats, rest: Floats | None) -> Floats | None:
            return None if rest is None else np.concatenate([first, rest[later]])

        positions = join(here[0], points.positions)
        assert positions is not None
        self._spline = Spline(
            np.concatenate([[now], times[later]]),
            positions,
            join(here[1], points.velocities),
            join(here[2], points.accelerations),
        )
        self._held = positions[-1]
        self._goal = handle
        self._tolerances = (
            self._default_tolerances.updated(self.joints, handle.get_goal()) if handle else self._default_tolerances
        )

    def _hold(self) -> None:
        """Hold the current joint positions."""
        self._held = self.positions().copy()
        self._spline = Spline(np.array([-np.inf]), self._held[None])
        self._desired = self._held, np.zeros_like(self._held), np.zeros_like(self._held)
        if self._pid is not None:
            self._pid.reset()

    def _end_goal(self, code: int | None, text: str) -> None:
        """Report the active goal's result to the client, or report a cancellation if ``code`` is None."""
        goal, self._goal = self._goal, None
        if goal is None:
            return
        if code is None:
            goal.set_canceled(self._result(error_string=text), text)
        elif code == self._result.SUCCESSFUL:
            goal.set_succeeded(self._result(error_code=code), text)
        else:
            LOG.warning("%s/follow_joint_trajectory: %s", self.topic, text)
            goal.set_aborted(self._result(error_code=code, error_string=text), text)

    def _empty_inbox(self) -> None:
        while not self._inbox.empty():
            points, handle = self._inbox.get()
            if points is not None and handle is not None:
                handle.set_canceled(text="the controller was restarted")

    def tell(self, world: World) -> None:
        """Publish the controller's state and the feedback on the active goal."""
        if self._state.get_num_connections() == 0 and self._goal is None:
            return
        header, actual = self.header(world), (self.positions(), self.velocities())
        error = self._desired[0] - actual[0], self._desired[1] - actual[1]

        def fill(message: Any) -> Any:
            for point, values in ((message.desired, self._desired), (message.actual, actual), (message.error, error)):
                point.positions, point.velocities = values[0].tolist(), values[1].tolist()
            return message

        names = list(self.joints)
        self._state.publish(fill(self._state.data_class(header=header, joint_names=names)))
        if self._goal is not None:
            self._goal.publish_feedback(fill(self._feedback(header=header, joint_names=names)))

    def close(self) -> None:
        """End the active goal and unregister all topics and the action."""
        self._end_goal(None, "the controller was unloaded")
        super().close()
        self._server.stop()
