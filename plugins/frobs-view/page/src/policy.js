/** The policy of a bundle in onnxruntime, with its memory. */

import { clip } from "./vectors.js";

const isMemory = ({ name }) => name.startsWith("state/");

export class Policy {
  /**
   * @param ort The module of onnxruntime.
   * @param session A session with the graph of the bundle.
   * @param facts Content of `page.json`, with the bounds of an action.
   */
  constructor(ort, session, facts) {
    Object.assign(this, { ort, session, facts });
    this.reset();
  }

  /** Forget the episode. */
  reset() {
    this.start = true;
    this.memory = {};
    for (const { name, shape: [, ...shape] } of this.session.inputMetadata.filter(isMemory)) {
      const size = shape.reduce((product, n) => product * n, 1);
      this.memory[name] = new this.ort.Tensor("float32", new Float32Array(size), [1, ...shape]);
    }
  }

  /** Return the action for the vectors of an observation by key. */
  async act(observation) {
    const feeds = { ...this.memory };
    if (this.session.inputNames.includes("episode_start")) {
      feeds.episode_start = new this.ort.Tensor("bool", Uint8Array.of(this.start ? 1 : 0), [1]);
    }
    for (const [key, values] of Object.entries(observation)) {
      const vector = Float32Array.from(values);
      const name = this.facts.dictionary ? `observation/${key}` : "observation";
      feeds[name] = new this.ort.Tensor("float32", vector, [1, vector.length]);
    }
    const results = await this.session.run(feeds);
    for (const name of Object.keys(this.memory)) this.memory[name] = results[`next_${name}`];
    this.start = false;
    const { low, high } = this.facts.action;
    const action = [...results.action.data].map((value, i) => clip(value, low[i], high[i]));
    if (!action.every(Number.isFinite)) throw new Error("The policy returned an action that is not finite.");
    return action;
  }
}
