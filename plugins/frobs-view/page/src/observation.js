/** The terms of an observation. Each kind of term is a function that returns a function of the state. */

import { clip, subtract, turnBack } from "./vectors.js";

/** Kinds of terms by name. `task` has the goal and the frames; `term` has the settings of the term. */
export const KINDS = {
  joint_positions: (task, term) => {
    const joints = task.frames.joints(term.joints);
    return () => joints.map((joint) => task.frames.data.qpos[joint.position]);
  },
  joint_velocities: (task, term) => {
    const joints = task.frames.joints(term.joints);
    return () => joints.map((joint) => task.frames.data.qvel[joint.velocity]);
  },
  position: (task, term) => () => task.point(term.of),
  offset: (task, term) => () => subtract(task.point(term.to), task.point(term.from)),
  offset_in_frame: (task, term) => {
    const frame = task.frames.body(term.frame);
    return () => turnBack(task.frames.quaternion(frame), subtract(task.point(term.to), task.point(term.from)));
  },
  velocity: (task, term) => {
    const body = task.frames.body(term.of);
    return () => task.frames.velocity(body);
  },
  angular_velocity: (task, term) => {
    const body = task.frames.body(term.of);
    return () => task.frames.angularVelocity(body);
  },
  axes: (task, term) => {
    const body = task.frames.body(term.of);
    return () => task.frames.axes(body);
  },
  opening: (task, term) => {
    const joints = task.frames.joints(term.joints);
    return () => {
      const shares = joints.map((joint, i) => (task.frames.data.qpos[joint.position] - term.closed[i]) / term.stroke[i]);
      return [shares.reduce((sum, share) => sum + share, 0) / shares.length];
    };
  },
};

/** The observation of a task: vectors by key, of which each consists of terms. */
export class Observation {
  constructor(task, terms) {
    this.terms = terms.map((term) => {
      if (!KINDS[term.kind]) throw new Error(`The observation term '${term.kind}' is unknown.`);
      return { ...term, read: KINDS[term.kind](task, term) };
    });
  }

  /** Return the current vectors by key. A term with fewer bounds than numbers consists of the first numbers. */
  read() {
    const vectors = {};
    for (const { key, low, high, read } of this.terms) {
      const values = read();
      (vectors[key] ??= []).push(...low.map((lowest, i) => clip(values[i], lowest, high[i])));
    }
    return vectors;
  }
}
