/** The page: loads everything, runs episodes in real time, and connects the controls. */

import loadMujoco from "@mujoco/mujoco";
import * as ort from "onnxruntime-web/wasm";

import { loadBytes, loadText } from "./assets.js";
import { Drawing } from "./drawing.js";
import { Panel } from "./panel.js";
import { Pointer } from "./pointer.js";
import { Policy } from "./policy.js";
import { Simulation } from "./simulation.js";

const BUDGET = 80; // time of a frame for physics, or as much as drawing takes [ms]
const REST = 900; // time for which the end of an episode is shown [ms]

class App {
  constructor(simulation, policy) {
    Object.assign(this, { simulation, policy });
    this.canvas = document.getElementById("view");
    this.drawing = new Drawing(this.canvas, simulation);
    this.panel = new Panel(this);
    new Pointer(this.canvas, this.drawing, simulation, (place) => this.moveGoal(place));
    this.order = shuffled(simulation.facts.starts.length);
    this.episodes = this.successes = 0;
    this.paused = false;
    this.drawTime = 0;
    this.begin();
  }

  /** Begin the next episode. */
  begin() {
    this.simulation.reset(this.order[this.episodes % this.order.length]);
    this.policy.reset();
    this.due = performance.now();
    this.restUntil = 0;
    this.counted = false;
    this.panel.showGoal();
  }

  /** Leave out the rest of the episode, without counting it. */
  skip() {
    this.order.push(this.order.shift());
    this.begin();
  }

  startOver() {
    this.episodes = this.successes = 0;
    this.panel.announce("");
    this.begin();
  }

  moveGoal(place) {
    this.simulation.setGoal(place);
    this.restUntil = 0;
    this.counted = false;
    this.panel.showGoal();
  }

  setPaused(paused) {
    this.paused = paused;
    this.due = performance.now();
    this.panel.showPaused();
  }

  /** Run the policy until the simulation has caught up with the clock, and draw. */
  async frame() {
    const began = performance.now();
    if (this.paused) this.due = began;
    else if (this.counted) {
      this.due = began;
      if (began >= this.restUntil) this.begin();
    }
    while (!this.paused && !this.counted && performance.now() >= this.due) {
      await this.step();
      if (performance.now() - began > Math.max(BUDGET, this.drawTime)) this.due = performance.now(); // slower than real time
    }
    const drawn = performance.now();
    this.drawing.draw();
    this.panel.show();
    this.drawTime = performance.now() - drawn;
    requestAnimationFrame(() => this.frame().catch(fail));
  }

  async step() {
    const { simulation } = this;
    simulation.step(await this.policy.act(simulation.observe()));
    this.due += 1000 * simulation.facts.control_timestep;
    this.panel.endPush();
    if (!simulation.ended) return;
    this.episodes += 1;
    const reached = simulation.success.reached;
    this.successes += Number(reached);
    this.panel.announce(`Episode ${this.episodes}: ${reached ? "success" : "no success"}`, reached);
    this.counted = true;
    this.restUntil = performance.now() + REST;
  }
}

function shuffled(count) {
  const order = Array.from({ length: count }, (_, i) => i);
  for (let i = count - 1; i > 0; i--) {
    const k = Math.floor(Math.random() * (i + 1));
    [order[i], order[k]] = [order[k], order[i]];
  }
  return order;
}

/** Show an error in words. The simulation stops. */
function fail(error) {
  console.error(error);
  const message = document.getElementById("message");
  const advice =
    location.protocol === "file:"
      ? "A browser does not load the parts of this page from a file. Serve the folder instead, for example with\npython -m http.server\nand open the address that it prints."
      : "Reload the page. If this does not help, try a current version of Firefox, Chrome or Safari.";
  message.className = "error";
  message.setAttribute("role", "alert");
  message.hidden = false;
  message.replaceChildren(document.createElement("p"));
  message.firstChild.textContent = `The simulation cannot run. ${error.message ?? error}\n\n${advice}`;
  document.body.dataset.state = "failed";
}

async function named(what, work) {
  try {
    return await work();
  } catch (error) {
    throw new Error(`${what}: ${error.message ?? error}`);
  }
}

async function main() {
  if (typeof WebAssembly === "undefined") throw new Error("This browser does not support WebAssembly.");
  const [facts, xml, graph, physics, network] = await Promise.all([
    loadText("page.json").then(JSON.parse),
    loadText("model.xml"),
    loadBytes("policy.onnx"),
    loadBytes("mujoco.wasm.gz"),
    loadBytes("onnxruntime.wasm.gz"),
  ]);
  Object.assign(ort.env.wasm, { numThreads: 1, wasmBinary: network });
  const [simulation, session] = await Promise.all([
    named("The physics engine failed", async () => new Simulation(await loadMujoco({ wasmBinary: physics }), facts, xml)),
    named("The policy failed", () => ort.InferenceSession.create(graph, { executionProviders: ["wasm"] })),
  ]);
  const app = await named("The drawing failed", () => new App(simulation, new Policy(ort, session, facts)));
  app.drawing.draw();
  document.getElementById("message").hidden = true;
  document.body.dataset.state = "ready";
  app.ready = performance.now(); // [ms] after the page was opened
  window.frobs = app; // for scripts and tests
  await app.frame();
}

main().catch(fail);
