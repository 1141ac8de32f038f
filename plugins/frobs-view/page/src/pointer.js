/** Dragging with the mouse, a pen or a finger: the goal moves, bodies are pulled, and elsewhere the view turns. */

import { add, dot, scale, subtract, turnBack } from "./vectors.js";

export class Pointer {
  constructor(canvas, drawing, simulation, onGoal) {
    Object.assign(this, { canvas, drawing, simulation, onGoal, held: null });
    const stage = canvas.parentElement;
    // In the capturing phase, so that the view does not turn as well.
    stage.addEventListener("pointerdown", (event) => this.begin(event), { capture: true });
    stage.addEventListener("pointermove", (event) => this.move(event), { capture: true });
    for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, () => this.end(), { capture: true });
  }

  begin(event) {
    if (event.target !== this.canvas || event.button !== 0 || this.held) return;
    this.held = this.drawing.pick(event.clientX, event.clientY);
    this.canvas.classList.add("dragging");
    if (!this.held) return;
    event.stopPropagation();
    this.canvas.setPointerCapture(event.pointerId);
    const { body, point } = this.held;
    if (body === undefined) return;
    const { frames } = this.simulation;
    this.held.local = turnBack(frames.quaternion(body), subtract(point, frames.position(body)));
    this.simulation.pullTo(body, this.held.local, point);
  }

  move(event) {
    if (!this.held) {
      if (!event.buttons) this.canvas.classList.toggle("over", this.drawing.pick(event.clientX, event.clientY) !== null);
      return;
    }
    event.stopPropagation();
    const place = this.placeOf(event);
    if (!place) return;
    if (this.held.goal) this.onGoal(place);
    else this.simulation.pullTo(this.held.body, this.held.local, place);
  }

  end() {
    this.canvas.classList.remove("dragging");
    if (this.held?.body !== undefined) this.simulation.release();
    this.held = null;
  }

  /** Return the point under the pointer, in the floor's plane for goals on the floor, and else across the view. */
  placeOf(event) {
    const { origin, direction, ahead } = this.drawing.ray(event.clientX, event.clientY);
    const { goal } = this.simulation.facts;
    const flat = this.held.goal && goal.high[2] - goal.low[2] < 1e-6;
    const normal = flat ? [0, 0, 1] : ahead;
    const slope = dot(direction, normal);
    const distance = dot(subtract(this.held.point, origin), normal) / slope;
    return distance > 0 && distance < 10 ? add(origin, scale(direction, distance)) : null;
  }
}
