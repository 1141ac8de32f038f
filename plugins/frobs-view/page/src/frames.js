/** Poses, velocities and Jacobians of the model's bodies, and positions of its joints. */

import { add, cross, subtract } from "./vectors.js";

/** Read-only view of a MuJoCo state. The arrays are read again each time, because they move when the memory grows. */
export class Frames {
  constructor(mujoco, model, data) {
    Object.assign(this, { mujoco, model, data });
    this.bodies = new Map();
  }

  /** Return the number of a body. An unknown name is an error. */
  body(name) {
    if (!this.bodies.has(name)) this.bodies.set(name, this.model.body(name).id);
    return this.bodies.get(name);
  }

  /** Return the addresses of joints in qpos and in qvel, and the numbers of their actuators or -1. */
  joints(names) {
    return names.map((name) => {
      const id = this.model.jnt(name).id;
      const targets = this.model.actuator_trnid;
      let actuator = -1;
      for (let i = 0; i < this.model.nu; i++) if (targets[2 * i] === id) actuator = i;
      return { position: this.model.jnt_qposadr[id], velocity: this.model.jnt_dofadr[id], actuator };
    });
  }

  position(body) {
    return [...this.data.xpos.subarray(3 * body, 3 * body + 3)];
  }

  quaternion(body) {
    return [...this.data.xquat.subarray(4 * body, 4 * body + 4)];
  }

  /** Return the x and y axes of a body, six numbers. */
  axes(body) {
    const m = this.data.xmat.subarray(9 * body, 9 * body + 9);
    return [m[0], m[3], m[6], m[1], m[4], m[7]];
  }

  /** Return the vector from the center of mass of a body's tree, about which MuJoCo gives velocities, to its origin. */
  arm(body) {
    const root = this.model.body_rootid[body];
    return subtract(this.position(body), [...this.data.subtree_com.subarray(3 * root, 3 * root + 3)]);
  }

  angularVelocity(body) {
    return [...this.data.cvel.subarray(6 * body, 6 * body + 3)];
  }

  velocity(body) {
    const linear = [...this.data.cvel.subarray(6 * body + 3, 6 * body + 6)];
    return add(linear, cross(this.angularVelocity(body), this.arm(body)));
  }

  /** Return the Jacobian of a body's origin for some degrees of freedom: three linear and three angular rows. */
  jacobian(body, freedoms) {
    const chain = new Set();
    for (let at = body; at > 0; at = this.model.body_parentid[at]) chain.add(at);
    const owners = this.model.dof_bodyid;
    const motions = this.data.cdof;
    const arm = this.arm(body);
    const rows = [[], [], [], [], [], []];
    for (const freedom of freedoms) {
      const moves = chain.has(owners[freedom]);
      const angular = [...motions.subarray(6 * freedom, 6 * freedom + 3)];
      const linear = add([...motions.subarray(6 * freedom + 3, 6 * freedom + 6)], cross(angular, arm));
      [...linear, ...angular].forEach((value, i) => rows[i].push(moves ? value : 0));
    }
    return rows;
  }

  /** Compute poses and velocities for the current state, and nothing on which the next step depends. */
  update() {
    this.mujoco.mj_kinematics(this.model, this.data);
    this.mujoco.mj_comPos(this.model, this.data);
    this.mujoco.mj_comVel(this.model, this.data);
  }
}
