/** The task in MuJoCo: physics, controllers, observation, goal and success. It works without a page, too. */

import { Control } from "./controllers.js";
import { Frames } from "./frames.js";
import { Observation } from "./observation.js";
import { Success } from "./success.js";
import { add, clip, cross, scale, subtract } from "./vectors.js";

const FORMAT = 1;

export class Simulation {
  /**
   * @param mujoco The module of MuJoCo.
   * @param facts Content of `page.json`.
   * @param xml Content of `model.xml`.
   */
  constructor(mujoco, facts, xml) {
    if (facts.format !== FORMAT) throw new Error(`page.json has the format ${facts.format}; this page reads ${FORMAT}.`);
    this.mujoco = mujoco;
    this.facts = facts;
    this.model = mujoco.MjModel.from_xml_string(xml);
    for (const [name, rows] of Object.entries(facts.arrays)) setArray(this.model[name], name, rows);
    this.data = new mujoco.MjData(this.model);
    this.frames = new Frames(mujoco, this.model, this.data);
    this.goal = [0, 0, 0];
    this.observation = new Observation(this, facts.terms);
    this.control = new Control(this.frames, facts.controllers);
    this.success = new Success(this, facts.success);
    this.pull = null;
    this.reset(0);
  }

  /** Return the goal, or the position of a body. */
  point(name) {
    return name === "goal" ? this.goal : this.frames.position(this.frames.body(name));
  }

  /** Begin an episode at one of the stored starts. */
  reset(number) {
    const start = { ...this.facts.start, ...this.facts.starts[number % this.facts.starts.length] };
    this.mujoco.mj_resetData(this.model, this.data);
    for (const name of ["qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat"]) {
      if (start[name]?.length) this.data[name].set(start[name]);
    }
    this.goal = [...start.goal];
    this.step_number = 0;
    this.pull = null;
    this.frames.update();
    this.control.reset();
    this.success.reset();
  }

  observe() {
    return this.observation.read();
  }

  /** Advance by one control step. */
  step(action) {
    const { mujoco, model, data, facts } = this;
    this.control.apply(action);
    for (let i = 1; i <= facts.decimation; i++) {
      this.control.write(i / facts.decimation);
      this.applyPull();
      mujoco.mj_step(model, data);
    }
    this.frames.update();
    this.success.advance();
    this.step_number += 1;
    if (!data.qpos.every(Number.isFinite)) throw new Error("The physics diverged.");
  }

  get ended() {
    return this.step_number >= this.facts.max_episode_steps;
  }

  /** Move the goal within its limits, and give the policy the time of an episode to reach it. */
  setGoal(position) {
    const { low, high } = this.facts.goal;
    this.goal = position.map((x, i) => clip(x, low[i], high[i]));
    this.step_number = 0;
    this.success.reset();
  }

  /**
   * Pull a body toward a point with a damped spring, until `release`.
   * @param body Number of the body.
   * @param local Place where the spring is attached, in the frame of the body [m].
   * @param target Place to which it is pulled [m].
   */
  pullTo(body, local, target) {
    this.pull = { body, local, target };
  }

  release() {
    this.pull = null;
    this.data.xfrc_applied.fill(0);
  }

  /** Return the point in the world where the spring is attached, or null. */
  pulledPoint() {
    if (!this.pull) return null;
    const { body, local } = this.pull;
    const m = this.data.xmat.subarray(9 * body, 9 * body + 9);
    const turned = [0, 1, 2].map((i) => m[3 * i] * local[0] + m[3 * i + 1] * local[1] + m[3 * i + 2] * local[2]);
    return add(this.frames.position(body), turned);
  }

  applyPull() {
    if (!this.pull) return;
    const { body, target } = this.pull;
    const { model, data } = this;
    const root = model.body_rootid[body];
    const free = model.body_dofnum[root] === 6;
    const mass = model.body_subtreemass[root];
    // A loose object is pulled at its natural pace. An arm holds its position with strong drives.
    const [stiffness, damping, most] = free ? [mass * 120, mass * 20, mass * 60] : [1500, 60, 250];
    const point = this.pulledPoint();
    const speed = this.frames.velocity(body);
    let force = subtract(scale(subtract(target, point), stiffness), scale(speed, damping));
    const size = Math.hypot(...force);
    if (size > most) force = scale(force, most / size);
    const center = [...data.xipos.subarray(3 * body, 3 * body + 3)];
    const torque = cross(subtract(point, center), force);
    data.xfrc_applied.fill(0);
    data.xfrc_applied.set([...force, ...torque], 6 * body);
  }
}

/**
 * Set an array of the model to exact values, because the text of the model rounds numbers to six digits.
 *
 * The version of MuJoCo that wrote the text may have arrays and columns that this version does not use.
 */
function setArray(array, name, rows) {
  if (!array || !rows.length) return;
  const width = array.length / rows.length;
  if (!Number.isInteger(width) || width > rows[0].length) throw new Error(`The array '${name}' has another size.`);
  rows.forEach((row, i) => array.set(row.slice(0, width), i * width));
}
