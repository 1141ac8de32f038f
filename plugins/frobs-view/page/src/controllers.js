/** The controllers: what a joint is commanded for an action. The numbers come from the controllers in Python. */

import { add, clip, conjugate, dot, multiply, solve, subtract } from "./vectors.js";

/** Steps that are added to the commanded joint positions. */
class JointDeltaPosition {
  constructor(frames, numbers) {
    Object.assign(this, { frames, numbers, joints: frames.joints(numbers.joints) });
  }

  measured() {
    return this.joints.map((joint) => this.frames.data.qpos[joint.position]);
  }

  reset() {
    this.target = this.measured();
  }

  apply(action) {
    const { scale, middle, lower, upper } = this.numbers;
    const start = middle ? add(this.measured(), middle) : this.target;
    this.target = start.map((at, i) => clip(at + clip(action[i], -1, 1) * scale[i], lower[i], upper[i]));
    return this.target;
  }
}

/** Damped least squares within joint limits: u += z + Jᵀ (J Jᵀ + λ²)⁻¹ (e − J z). */
class InverseKinematics {
  constructor(frames, numbers) {
    Object.assign(this, { frames, numbers, joints: frames.joints(numbers.joints) });
    this.frame = frames.body(numbers.body);
    this.freedoms = this.joints.map((joint) => joint.velocity);
  }

  reset() {
    this.commanded = this.joints.map((joint) => this.frames.data.qpos[joint.position]);
  }

  /** Read the Jacobian, and return how far the command is ahead of the arm. */
  lead() {
    const { home, posture_gain: gain, free_row: free } = this.numbers;
    this.jacobian = this.frames.jacobian(this.frame, this.freedoms);
    this.jacobian.length = this.numbers.steps.length; // without rotations if the target is a point
    if (free !== null) this.jacobian[free].fill(0);
    this.posture = this.commanded.map((u, i) => (home[i] - u) * gain[i]);
    const ahead = this.commanded.map((u, i) => u - this.frames.data.qpos[this.joints[i].position]);
    return this.jacobian.map((row) => dot(row, ahead));
  }

  move(error) {
    const { lower, upper } = this.numbers;
    const before = this.commanded;
    let change = this.step(error);
    const within = (u, i) => clip(u, lower[i], upper[i]);
    this.commanded = add(before, change).map(within);
    if (this.commanded.some((u, i) => u !== before[i] + change[i])) {
      const held = before.map((u, i) => (u <= lower[i] && change[i] < 0) || (u >= upper[i] && change[i] > 0));
      if (held.some(Boolean)) {
        this.jacobian = this.jacobian.map((row) => row.map((value, i) => (held[i] ? 0 : value)));
        this.posture = this.posture.map((value, i) => (held[i] ? 0 : value));
        change = this.step(error);
        this.commanded = add(before, change).map(within);
      }
    }
    return this.commanded;
  }

  step(error) {
    const { damping, max_change: fastest } = this.numbers;
    const rows = this.jacobian;
    const gram = rows.map((a, i) => rows.map((b, k) => dot(a, b) + (i === k ? damping : 0)));
    const task = solve(gram, subtract(error, rows.map((row) => dot(row, this.posture))));
    return this.posture.map((z, j) => {
      const change = rows.reduce((sum, row, i) => sum + row[j] * task[i], 0) + z;
      return clip(change, -fastest[j], fastest[j]);
    });
  }
}

/** Steps of the tool center point toward a target point or pose. */
class TcpDelta {
  constructor(frames, numbers) {
    Object.assign(this, { frames, numbers, joints: frames.joints(numbers.joints) });
    this.kinematics = new InverseKinematics(frames, numbers);
  }

  reset() {
    this.kinematics.reset();
    this.target = this.frames.position(this.kinematics.frame);
    this.turn = this.frames.quaternion(this.kinematics.frame);
  }

  apply(action) {
    const { columns, steps, target_low: low, target_high: high } = this.numbers;
    const step = steps.map(() => 0);
    columns.forEach((column, i) => (step[column] = clip(action[i], -1, 1) * steps[column]));
    for (let i = 0; i < 3; i++) {
      const inside = clip(this.target[i] + step[i], low[i], high[i]);
      step[i] = clip(inside - this.target[i], -steps[i], steps[i]);
    }
    const frame = this.kinematics.frame;
    const offset = subtract(this.target, this.frames.position(frame));
    const turn = rotationBetween(this.frames.quaternion(frame), this.turn);
    const left = subtract([...offset, ...turn].slice(0, steps.length), this.kinematics.lead());
    const rest = left.map((value, i) => clip(value, -steps[i], steps[i]));
    const moved = add(subtract(rest, left), step);
    this.target = add(this.target, moved.slice(0, 3));
    if (moved.slice(3).some((value) => value !== 0)) this.turn = rotated(this.turn, moved.slice(3));
    const before = this.kinematics.commanded;
    const after = this.kinematics.move(add(rest, step));
    if (!this.numbers.interpolate) return after;
    return (share) => before.map((u, i) => u + share * (after[i] - u));
  }
}

/** Opening of the fingers of a gripper, from 0 (closed) to 1 (open). */
class Gripper {
  constructor(frames, numbers) {
    Object.assign(this, { frames, numbers, joints: frames.joints(numbers.joints) });
  }

  reset() {
    const { closed, stroke } = this.numbers;
    const qpos = this.frames.data.qpos;
    this.opening = this.joints.map((joint, i) => (qpos[joint.position] - closed[i]) / stroke[i]);
    this.wanted = clip(this.opening.reduce((sum, value) => sum + value, 0) / this.opening.length, 0, 1);
  }

  apply([action]) {
    const { law, closed, stroke, max_change: fastest, max_delta: step } = this.numbers;
    const request = clip(action, -1, 1);
    if (law === "gripper_position") this.wanted = 0.5 * (request + 1);
    else if (law === "gripper_delta") this.wanted += step * request;
    else if (request !== 0) this.wanted = request > 0 ? 1 : 0;
    this.wanted = clip(this.wanted, 0, 1);
    this.opening = this.opening.map((at, i) => at + clip(this.wanted - at, -fastest[i], fastest[i]));
    return this.opening.map((at, i) => closed[i] + at * stroke[i]);
  }
}

/** Classes of controllers by the name of their law. */
export const LAWS = {
  joint_delta_position: JointDeltaPosition,
  tcp_delta_position: TcpDelta,
  tcp_delta_pose: TcpDelta,
  gripper_position: Gripper,
  gripper_delta: Gripper,
  gripper_binary: Gripper,
};

/** All controllers of a robot, which write the targets of its drives. */
export class Control {
  constructor(frames, controllers) {
    this.frames = frames;
    this.parts = controllers.map((numbers) => {
      if (!LAWS[numbers.law]) throw new Error(`The controller '${numbers.law}' is unknown.`);
      return { controller: new LAWS[numbers.law](frames, numbers), columns: numbers.action };
    });
  }

  reset() {
    for (const { controller } of this.parts) controller.reset();
  }

  /** Compute the commands for an action. They are written by `write`. */
  apply(action) {
    for (const part of this.parts) part.command = part.controller.apply(action.slice(...part.columns));
  }

  /** Write the commands for a physics step. `share` is the part of the control step that has passed after it. */
  write(share) {
    const { data, model } = this.frames;
    const controls = data.ctrl;
    const biases = model.actuator_biasprm;
    const width = biases.length / model.nu;
    for (const { controller, command } of this.parts) {
      const targets = typeof command === "function" ? command(share) : command;
      controller.joints.forEach(({ actuator }, i) => {
        controls[actuator] = -biases[width * actuator + 1] * targets[i]; // the drive's stiffness times its target
      });
    }
  }
}

/** Return the rotation from one orientation to another as 2 sin(angle / 2) times its axis. */
function rotationBetween(start, end) {
  const [w, ...axis] = multiply(end, conjugate(start));
  const double = w < 0 || Object.is(w, -0) ? -2 : 2;
  return axis.map((x) => double * x);
}

/** Return an orientation after a rotation vector of the world. */
function rotated(quaternion, vector) {
  const half = Math.max(0.5 * Math.sqrt(dot(vector, vector)), 1e-150);
  const factor = (0.5 * Math.sin(half)) / half;
  return multiply([Math.cos(half), ...vector.map((x) => factor * x)], quaternion);
}
