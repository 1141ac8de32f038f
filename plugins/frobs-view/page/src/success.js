/** The rule of success: a body at a goal or at a height, at rest, for a number of control steps. */

import { length, subtract } from "./vectors.js";

/** Counts the control steps in which the condition of a task has held. */
export class Success {
  constructor(task, rule) {
    Object.assign(this, { task, rule, body: task.frames.body(rule.of) });
  }

  reset() {
    this.held = 0;
  }

  /** Distance from the body to the goal, or to the tool if there is no goal [m]. */
  distance() {
    const { task, rule } = this;
    const round = rule.rounded ? (point) => point.map(Math.fround) : (point) => point;
    return length(subtract(round(task.point(rule.to)), round(task.frames.position(this.body))));
  }

  holds() {
    const { frames } = this.task;
    const { tolerance, max_speed: fastest, heights } = this.rule;
    if (this.distance() > tolerance) return false;
    if (fastest !== null && length(frames.velocity(this.body)) > fastest) return false;
    const height = frames.position(this.body)[2];
    return heights === null || (height >= heights[0] && height <= heights[1]);
  }

  /** Measure the state after a control step. */
  advance() {
    this.held = this.holds() ? this.held + 1 : 0;
  }

  get reached() {
    return this.held >= this.rule.hold_steps;
  }
}
