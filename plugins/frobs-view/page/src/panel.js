/** The panel beside the picture: figures, buttons, sliders of the goal, and pushes. */

import { Vector3 } from "three";

const AXES = ["x", "y", "z"];
const PUSH_TIME = 0.35; // [s]
const PUSH_REACH = 0.3; // [m]
const KEYS = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.08], ArrowDown: [0, 0.08], "+": [0, 0, 0.9], "-": [0, 0, 1.11] };

const find = (id) => document.getElementById(id);

export class Panel {
  constructor(app) {
    Object.assign(this, { app, pushEnds: 0 });
    this.facts = app.simulation.facts;
    this.describe();
    find("pause").onclick = () => app.setPaused(!app.paused);
    find("next").onclick = () => app.skip();
    find("restart").onclick = () => app.startOver();
    for (const button of document.querySelectorAll("[data-push]")) button.onclick = () => this.push(button.dataset.push);
    for (const part of [find("pause"), find("next"), find("restart"), find("push")]) part.disabled = false;
    this.addSliders();
    this.addPushed();
    document.addEventListener("keydown", (event) => this.onKey(event));
  }

  describe() {
    const { id, instruction, success_rule: rule, training, robot } = this.facts;
    const name = id.replace(/^frobs\//, "");
    document.title = `${name} – FRobs`;
    find("title").textContent = name;
    find("instruction").textContent = instruction;
    const rate = training.success_rate;
    const measured = rate === null ? "" : ` It was evaluated in Python, with a success rate of ${(100 * rate).toFixed(1)} %.`;
    find("about").textContent =
      `The robot is ${robot}. The policy was trained with ${training.algorithm} for ` +
      `${training.steps.toLocaleString("en")} steps.${measured} An episode is a success if ${rule}.`;
    if (!this.facts.goal) find("distance-name").textContent = "tool to object";
  }

  addSliders() {
    const { goal } = this.facts;
    find("goal").hidden = !goal;
    if (!goal) return;
    find("goal").disabled = false;
    this.sliders = AXES.map((axis, i) => {
      const slider = find(`goal-${axis}`);
      Object.assign(slider, { min: goal.low[i], max: goal.high[i], step: "any" });
      slider.closest("label").hidden = goal.high[i] - goal.low[i] < 1e-6;
      slider.oninput = () => {
        const place = [...this.app.simulation.goal];
        place[i] = Number(slider.value);
        this.app.moveGoal(place);
      };
      slider.onkeydown = (event) => this.nudge(event, i);
      return slider;
    });
  }

  /** Move the goal by 1 cm with the arrow keys, because a slider without steps moves by hardly anything. */
  nudge(event, i) {
    const sign = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    const place = [...this.app.simulation.goal];
    place[i] += 0.01 * sign;
    this.app.moveGoal(place);
  }

  addPushed() {
    const { success, tool } = this.facts;
    const names = { [tool]: "the tool of the robot" };
    if (success.of !== tool) names[success.of] = `the ${success.of}`;
    for (const [value, text] of Object.entries(names)) find("pushed").add(new Option(text, value));
  }

  push(direction) {
    const { simulation, drawing } = this.app;
    const ahead = drawing.camera.getWorldDirection(new Vector3()).setZ(0).normalize();
    const right = new Vector3().crossVectors(ahead, drawing.camera.up);
    const ways = { left: right.clone().negate(), right, away: ahead, near: ahead.clone().negate() };
    const way = ways[direction] ?? new Vector3(0, 0, direction === "up" ? 1 : -1);
    const body = simulation.frames.body(find("pushed").value);
    const target = new Vector3(...simulation.frames.position(body)).addScaledVector(way, PUSH_REACH);
    simulation.pullTo(body, [0, 0, 0], target.toArray());
    this.pushEnds = simulation.data.time + PUSH_TIME;
  }

  /** End a push after its time. */
  endPush() {
    if (!this.pushEnds || this.app.simulation.data.time < this.pushEnds) return;
    this.pushEnds = 0;
    this.app.simulation.release();
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const inside = event.target.closest("button, input, select, summary, a");
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (event.target.id === "view" && KEYS[event.key]) this.app.drawing.turn(...KEYS[event.key]);
    else if (key === " " && !inside) this.app.setPaused(!this.app.paused);
    else if (key === "n" && !event.target.closest("select")) this.app.skip();
    else if (key === "r" && !event.target.closest("select")) this.app.startOver();
    else return;
    event.preventDefault();
  }

  showPaused() {
    find("pause").textContent = this.app.paused ? "Resume" : "Pause";
  }

  showGoal() {
    this.sliders?.forEach((slider, i) => {
      slider.value = this.app.simulation.goal[i];
      const text = `${this.app.simulation.goal[i].toFixed(2)} m`;
      slider.setAttribute("aria-valuetext", text);
      slider.nextElementSibling.value = text;
    });
  }

  /** Report the end of an episode, also to screen readers. */
  announce(text, good) {
    find("outcome").textContent = text;
    find("outcome").className = good ? "good" : "bad";
  }

  /** Show the figures of the current state. */
  show() {
    const { simulation, episodes, successes, paused } = this.app;
    const left = (this.facts.max_episode_steps - simulation.step_number) * this.facts.control_timestep;
    find("successes").textContent = `${successes} of ${episodes}`;
    find("distance").textContent = `${(100 * simulation.success.distance()).toFixed(1)} cm`;
    find("left").textContent = `${left.toFixed(1)} s`;
    const badge = find("badge");
    const good = simulation.success.held > 0;
    badge.hidden = !good && !paused;
    badge.textContent = paused ? "Paused" : this.facts.goal ? "At the goal" : "Lifted";
    badge.className = good && !paused ? "good" : "";
  }
}
