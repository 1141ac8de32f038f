"""Faults that people make, planted in the built-in simulator, controllers, tasks and the environments that join them."""

from __future__ import annotations

from collections.abc import Iterator

from planting import Fault, replaced

_ROBOT, _SIMULATION = "frobs_sim_mujoco.robot", "frobs_sim_mujoco.simulation"
_BODY, _SCENERY = "frobs_sim_mujoco.body", "frobs_sim_mujoco.scenery"
_WRENCHES, _BASE = "frobs_sim_mujoco.wrenches", "frobs_core.contracts.simulation"
_CONTACTS, _SCENE = "frobs_core.contracts.contacts", "frobs_core.description.scene"
_HANDLE, _COMMANDED = "frobs_core.contracts.robot_handle", "frobs_controllers.commanded_positions"
_ENV = "frobs_core.kernel.env"
_CONTROL, _GROUP = "frobs_core.contracts.control", "frobs_core.contracts.joint_group"
_ATTACHMENT, _CONTEXT = "frobs_models.mount", "frobs_core.contracts.step_context"
_WRAPPER = _DISCRETE = "frobs_controllers.discrete"
_ARTICULATION, _RENDERING = "frobs_sim_mujoco.articulation", "frobs_sim_mujoco.rendering"
_MUJOCO_CONTACTS = "frobs_sim_mujoco.contacts"
_DELTA = "frobs_controllers.joint_delta_position"
_VELOCITY, _DRIVE = "frobs_controllers.joint_velocity", "frobs_controllers.differential_drive"
_REACH, _SAMPLING = "frobs_tasks_reach.reach", "frobs_tasks_reach.sampling"
_TASK, _GOAL = "frobs_core.contracts.task", "frobs_core.contracts.goal_task"
_START, _MOTION = "frobs_tasks_reach.start", "frobs_tasks_reach.motion"
_OBSERVATION = "frobs_core.sensing.observation"
_VECTOR = "frobs_core.kernel.vector_env"
_PACED, _PACER = "templates.my_paced_simulator", "frobs_core.contracts.pacing"
_WAIT = "self._pacer.wait(decimation * self.physics_timestep)"

_TABLE = (
    # -- simulator --
    ("a quaternion written scalar last", _ROBOT,
     '"mocap_quat"][rows, self._mocap] = quat_wxyz', '"mocap_quat"][rows, self._mocap] = np.roll(quat_wxyz, -1, -1)'),
    ("joints commanded in reverse order", _ROBOT,
     "np.multiply(self._factor, values, out=self._ctrl)", "np.multiply(self._factor, values[:, ::-1], out=self._ctrl)"),
    ("the effort limit not read", _HANDLE,
     "self.expand([limit.effort for limit in limits])", "self.expand([np.inf for limit in limits])"),
    ("the drives' two gains exchanged", _HANDLE,
     "self._stiffness, self._damping = map", "self._damping, self._stiffness = map"),
    ("gains written without what the drives hold", _ROBOT, "self._ctrl[rows] *= ratio", "pass"),
    ("the velocity of the centre of mass for that of the frame", _ROBOT,
     "return views.linear + cross(views.angular, views.pose[0] - views.center), views.angular",
     "return views.linear, views.angular"),
    ("an angular velocity in the body's frame", _BODY,
     "quat_rotate(quat, np.broadcast_to(ang_vel_world, (len(quat), 3)))", "ang_vel_world"),
    ("a lidar that sees its own robot", _ROBOT,
     "seen_except(group)", "seen_except()"),
    ("joints that do not move a frame in its Jacobian", _ROBOT,
     "return jacobian if views.moved is None else jacobian * views.moved", "return jacobian"),
    ("given joints without the place of the base", _ROBOT,
     "return self.planned_frame_pose(frame, joint_positions)",
     "return self.model.frame_pose(self.frame_name(frame), joint_positions)"),
    ("the joints' velocity forgotten in a write", _ROBOT,
     "put(self._qvel, rows, self.dofs, velocities)", "put(self._qvel, rows, self.dofs, 0.0)"),
    ("a mask of the reset ignored", _SIMULATION,
     "ids = None if mask is None else np.flatnonzero(mask)\n        self.batch.reset",
     "ids = None\n        self.batch.reset"),
    ("readings a step old", _SIMULATION,
     "self.batch.step(nstep=decimation, stage=self._stage)", "self.batch.step(nstep=decimation, stage=_NONE)"),
    ("a reading that is not refreshed after a write", _SIMULATION,
     "self.stale = mask.copy()", "self.stale = None"),
    ("contacts of the last physics step only", _CONTACTS, "closed.any(axis=1)", "closed[:, -1]"),
    ("a wrench that never ends", _SIMULATION, 'self.states["xfrc_applied"][:] = 0.0', "pass"),
    ("a snapshot that is the state itself", _SIMULATION, "self.batch.state.copy(), ", "self.batch.state, "),
    ("a snapshot without the physical parameters", _SIMULATION,
     "self._applied.snapshot(), parameters.snapshot(self))",
     "self._applied.snapshot(), {k: v for k, v in parameters.snapshot(self).items() if not k.startswith('parameter/')})"),
    ("rays that miss at distance 0", _SIMULATION,
     "np.where((distances < 0) | (distances > max_range), max_range, distances)",
     "np.where(distances > max_range, max_range, np.maximum(distances, 0.0))"),
    ("the wrench of the child on the parent", _WRENCHES,
     'Floats = recorded["sensordata"][..., self._columns] + np', 'Floats = -recorded["sensordata"][..., self._columns] - np'),
    ("a wrench in the frame of the world", _WRENCHES,
     "added = [(part[..., None] * turn).sum(axis=-2) for part in (force, torque)]",
     'found = recorded["sensordata"][..., self._columns]\n'
     "        wrench = [(turn * part[..., None, :]).sum(-1) for part in (found[..., :3], found[..., 3:])]\n"
     "        return np.concatenate(wrench, axis=-1)\n"
     "        added = [(part[..., None] * turn).sum(axis=-2) for part in (force, torque)]"),
    ("a sensor that is tared at its first reading", _WRENCHES,
     "return {name: sensor.read(recorded, difference).mean(axis=1) for name, sensor in self._sensors.items()}",
     "read = {name: sensor.read(recorded, difference).mean(axis=1) for name, sensor in self._sensors.items()}\n"
     "        self._tare = getattr(self, '_tare', read)\n"
     "        return {name: value - self._tare[name] for name, value in read.items()}"),
    ("a sensor that leaves out its own link", _WRENCHES,
     'name, body = f"{robot}/{sensor}", spec.body(f"{robot}/{link}")',
     'name, body = f"{robot}/{sensor}", next(iter(spec.body(f"{robot}/{link}").bodies), spec.body(f"{robot}/{link}"))'),
    ("wrenches of another environment", _SIMULATION,
     "self.sensor_wrenches[name][:] = wrench\n", "self.sensor_wrenches[name][:] = np.roll(wrench, 1, axis=0)\n"),
    ("wrenches of explicit accelerations", _WRENCHES,
     'self._timestep - recorded["qacc"]  # (num_envs, decimation, nv)', 'self._timestep * 0.0'),
    ("wrenches that outlive a reset", _SIMULATION, "wrench[rows] = 0.0", "pass"),
    ("wrenches of the last physics step only", _BASE, "means[name] += read / decimation", "means[name][:] = read / decimation"),
    # -- joint groups, several robots, wrapped controllers, the physics rate --
    ("commands of all groups in the first columns", _CONTROL,
     "whole[..., columns] = command if", "whole[..., : command.shape[-1]] = command if"),
    ("joints without a controller sent to zero", _CONTROL, "np.repeat(robot.home[:1], robot.num_envs, axis=0)", "np.zeros((robot.num_envs, robot.dof))"),
    ("limits of the first joints for every group", _GROUP,
     "getattr(whole, limit)[:, self.columns])", "getattr(whole, limit)[:, : len(numbers)])"),
    ("positions of the first joints for every group", _GROUP,
     "self._whole.joint_positions[:, self.columns]", "self._whole.joint_positions[:, : self.dof]"),
    ("the first robot's action for all robots", _CONTROL,
     "for robot, parts in zip(self.robots.values(), self._parts, strict=True)",
     "for robot, parts in zip(self.robots.values(), self._parts[:1] * len(self._parts), strict=True)"),
    ("a snapshot of the first controller", _CONTROL,
     '        return self.controllers\n', '        return dict([*self.controllers.items()][:1])\n'),
    ("a reset of the first controller", _CONTROL,
     "for controller in self.controllers.values():\n            controller.reset(mask)", "next(iter(self.controllers.values())).reset(mask)"),
    ("a wrapper that does not reset", _WRAPPER, "self.inner.reset(mask)", "pass"),
    ("a wrapper without a snapshot", _WRAPPER, "return self.inner.snapshot()", "return {}"),
    ("a wrapper that does not restore", _WRAPPER, "self.inner.restore(snapshot)", "pass"),
    ("an update before the first physics step", _BASE, "            if i:\n", "            if True:\n"),
    ("wrenches in the first physics step only", _BASE,
     "for wrench in wrenches:\n                    self.apply_wrench(*wrench)", "pass"),
    ("contacts of the last physics step after an update", _BASE,
     "self.contacts.merge(contacts)", "self.contacts.merge(contacts[-1:])"),
    # -- end effectors --
    ("a tool at the origin of its link", _ATTACHMENT, '"xyz": _numbers(pos)', '"xyz": "0 0 0"'),
    ("a home position without the tool's", _ATTACHMENT,
     "home={**arm.home, **prefixed(tool.home)}", "home={**arm.home}"),
    ("open and closed exchanged", _ATTACHMENT, "open=prefixed(described.open)", "open=prefixed(described.closed)"),
    ("joints of the tool in reverse order", _ATTACHMENT,
     "for joint in tool_model.joint_names)\n    title", "for joint in tool_model.joint_names[::-1])\n    title"),
    # -- capabilities --
    ("a capability without its method", _SIMULATION,
     "def rays(self, origins: Floats, directions: Floats, max_range: float, exclude: str",
     "def cast_rays(self, origins: Floats, directions: Floats, max_range: float, exclude: str"),
    ("wrenches that are declared, not implemented", _SIMULATION, "    def apply_wrench(", "    def push("),
    ("force-torque sensors that are declared, not implemented", _SIMULATION,
     "self.sensor_wrenches = {name: np.zeros((num_envs, 6)) for name in self._wrench_reader.names}",
     "self._unread = {name: np.zeros((num_envs, 6)) for name in self._wrench_reader.names}"),
    # -- added terms --
    ("an action of the episode before", _CONTEXT, "self.raw_action[rows] = 0", "pass"),
    ("an action that is never reported", _CONTEXT,
     "return self._clipped(self.raw_action)", "return 0 * self.raw_action"),
    ("terms in reverse order", _OBSERVATION,
     "[term.read for term in part.values()]", "[term.read for term in reversed(part.values())]"),
    # -- scenes --
    ("products of inertia exchanged", _ARTICULATION,
     "inertia[0, 1], inertia[0, 2], inertia[1, 2]]", "inertia[0, 2], inertia[0, 1], inertia[1, 2]]"),
    ("rolling friction without an effect", _SCENERY, "geom.condim = 6", "geom.condim = 4"),
    ("the friction of a prop's joints ignored", _ARTICULATION, "damping=[joint.damping, 0, 0]", "damping=[0, 0, 0]"),
    ("a prop that is not turned", _SCENE,
     "model=model, pose=self.pose, command_mode=CommandMode.EFFORT",
     "model=model, pose=Pose(self.pose.pos), command_mode=CommandMode.EFFORT"),
    ("a prop at another place", _SCENE,
     "pose=self.pose, command_mode=CommandMode.EFFORT",
     "pose=Pose((self.pose.pos[1], self.pose.pos[0], 0.0)), command_mode=CommandMode.EFFORT"),
    ("an attachment that is a soft spring", _SCENERY, "solref=(2.0 * spec.option.timestep, 1.0),\n        solimp=HARD,", "solref=(0.5, 1.0),"),
    ("an attachment without the turn", _SCENERY, "*pose.pos, *pose.quat_wxyz, torque_scale", "*pose.pos, 0.5, 0.5, 0.5, 0.5, torque_scale"),
    # -- contacts --
    ("the force on the second side", _MUJOCO_CONTACTS, "= -mean[:, at : at + 3]", "= mean[:, at : at + 3]"),
    ("a contact that needs two points", _MUJOCO_CONTACTS, "@ self._counted > 0", "@ self._counted > 1"),
    ("what a contact ignores counted", _MUJOCO_CONTACTS, "contact)], i] = -1.0", "contact)], i] = 0.0"),
    ("contacts that outlive a reset", _CONTACTS, "array[rows_of(mask)] = 0", "pass"),
    # -- rendering --
    ("images of the first environment for all", _RENDERING,
     "self._drawn.show(env)", "self._drawn.show(0)"),
    ("fast images of one size for all", _RENDERING, "key = (*size, fast)", "key = (0, 0, True) if fast else (*size, fast)"),
    ("an image for each environment, whatever the mask", _SIMULATION,
     "chosen = list(range(self.num_envs)) if mask is None else np.flatnonzero(mask).tolist()",
     "chosen = list(range(self.num_envs))"),
    # -- controllers --
    ("a body's twist at its center of mass", _BODY,
     'read_only(self._simulation.states["qvel"][:, dof : dof + 3])', "twist[:, 3:]"),
    ("a scene's twist forgotten at reset", _BODY, "if self._initial_twist != AT_REST:", "if False:"),
    ("all shapes of a body at its origin", _SCENERY, "part.geometry, part.pose, group", "part.geometry, body.pose, group"),
    ("an attachment where both origins are the same", _SCENERY, "*pose.pos, *pose", "*anchor, *pose"),
    ("torsional friction without an effect", _SCENERY, "geom.condim = 4", "geom.condim = 3"),
    ("actions that are not clipped", _DELTA, "np.minimum(delta, self._ones, out=delta)", "pass"),
    ("a joint limit ignored", _DELTA, "np.minimum(target, self._upper, out=target)", "pass"),
    ("a reset of all controllers", _COMMANDED,
     "self._target[rows_of(mask)] = self._joints.joint_positions[rows_of(mask)]",
     "self._target[:] = self._joints.joint_positions"),
    ("steps from the measured positions", _DELTA,
     "np.add(target, delta, out=target)", "np.add(self._joints.joint_positions, delta, out=target)"),
    ("a target that the snapshot does not have", _COMMANDED,
     'return {"target": self._target}', 'return {}'),
    ("a snapshot that keeps changing", _COMMANDED,
     'def stored_arrays(self)', 'def snapshot(self)'),
    ("a velocity beyond the limit", _VELOCITY, "np.minimum(velocity, self._upper, out=velocity)", "pass"),
    ("wheels beyond what was asked", _DRIVE, "np.minimum(requested, self._ones, out=requested)", "pass"),
    # -- paced simulators --
    ("a step that does not wait for the world", _PACED, _WAIT,
     "self._pacer.time = self._pacer.time + decimation * self.physics_timestep"),
    ("a reset that teleports", _PACED, "self._connection.send((engine, robots, scene, physics_timestep))",
     "self._connection.send((engine, robots, scene, physics_timestep))\n"
     "            self._drive_home = lambda: self._ask('__init__', engine, robots, scene, physics_timestep)"),
    ("a reset that does not wait until the robot is home", _PACED, "while not self._is_home(targets):",
     "if not self._is_home(targets):"),
    ("a missed deadline that is forgotten", _PACED, _WAIT,
     f"{_WAIT}\n        self._pacer.missed, self._pacer.lateness = 0, 0.0"),
    ("a lateness that is not counted", _PACER, "self.lateness += max(0.0, late)", "pass"),
    ("a clock that loses the steps that were missed", _PACER,
     "self.time = self.time + (1 + missed) * duration", "self.time = self.time + duration"),
    # -- tasks --
    ("a seed ignored", _SAMPLING,
     "vectors = rng.uniform(stream", "vectors = RandomSource(self._robot.num_envs).uniform(stream"),
    ("random numbers of NumPy's own", _SAMPLING,
     "vectors = rng.uniform(stream, self.lower, self.upper, (count, len(self.lower)), mask)",
     "vectors = np.random.default_rng().uniform("
     "self.lower, self.upper, (1 if mask is None else int(mask.sum()), count, len(self.lower)))"),
    ("a reward of the step before", _REACH,
     "function=lambda task: task.distance,",
     "function=lambda task: [getattr(task, '_late', task.distance), setattr(task, '_late', task.distance.copy())][0],"),
    ("a reward in single precision", _TASK, "return reduce(add, self._reward_terms.values())",
     "return reduce(add, self._reward_terms.values()).astype(np.float32)"),
    ("a reward term left out of the sum", _TASK, "return reduce(add, self._reward_terms.values())",
     "return next(iter(self._reward_terms.values()))"),
    ("a statistic over the batch", _TASK, "return reduce(add, self._reward_terms.values())",
     "return reduce(add, [term - 1e-9 * term.mean() for term in self._reward_terms.values()])"),
    ("an observation that is never measured", _REACH,
     '"""Measure the tool position."""\n        self._measure()', '"""Measure the tool position."""'),
    ("a given start ignored", _START, "if given is not None:\n            robot.write", "if False:\n            robot.write"),
    ("a start that teleports and does not say so", _START,
     'self._start is None and "joint_positions" not in options', "self._start is None"),
    ("a goal that the snapshot does not bring back", _REACH,
     'return {"goal": self._goal, "tcp": self._tcp}', 'return {"goal": self._goal.copy(), "tcp": self._tcp}'),
    ("shared observation memory", _ENV,
     "return np.concatenate(list(map(call, self._reads)), axis=1).astype(np.float32)",
     "values = np.concatenate(list(map(call, self._reads)), axis=1).astype(np.float32)\n"
     "        self._kept = getattr(self, '_kept', values.copy())\n"
     "        self._kept[...] = values\n        return self._kept"),
    ("observations in double precision", _ENV, "axis=1).astype(np.float32)", "axis=1)"),
    ("columns that overlap", _OBSERVATION, "slice(start, start + len(term.low))",
     "slice(max(start - 1, 0), start + len(term.low))"),
    ("a reward of goals that are not those of the step", _GOAL,
     "goal_distance=distance_between(achieved_goal, desired_goal)",
     "goal_distance=distance_between(achieved_goal, desired_goal) + 1e-3"),
    ("a reward of one goal for all", _GOAL,
     "term.function(measured) for", "np.mean(term.function(measured)) * np.ones(np.shape(achieved_goal)[:-1]) for"),
    ("a moving goal that forgets its phase in a snapshot", _MOTION,
     '"goal_phase": self._phase', '"goal_phase": 0.0 * self._phase'),
    # -- environments --
    ("terminated for truncated", _VECTOR,
     "return observation, reward, terminated, truncated, info", "return observation, reward, truncated, terminated, info"),
    ("a time limit one step late", _VECTOR,
     "self._elapsed >= self.max_episode_steps", "self._elapsed > self.max_episode_steps"),
    ("the last observation lost", _VECTOR, "merged = rows.copy()", "merged = rows"),
)  # fmt: skip


def faults() -> Iterator[Fault]:
    """Yield them, in the order of the table."""
    for name, module, old, new in _TABLE:
        yield replaced(name, module, old, new)
