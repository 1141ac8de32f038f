/**
 * Plays stored episodes in an exported page without a browser, and prints how far it deviates from Python as JSON.
 *
 * Usage: node page_trials.mjs PAGE TRIALS, where TRIALS is a JSON file: a list of episodes with `start` (number of the
 * start). Episodes with `actions`, `observations` (vectors by key before each action), `controls` and `positions` (ctrl and
 * qpos after each action) are replayed. Episodes with `success` are also played by the policy.
 */
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const sources = new URL("../page/", import.meta.url);
const resolve = createRequire(new URL("package.json", sources)).resolve;
const { default: loadMujoco } = await import(pathToFileURL(resolve("@mujoco/mujoco")));
const modules = new URL("node_modules/onnxruntime-web/dist/", sources);
const ort = await import(new URL("ort.wasm.bundle.min.mjs", modules));
const { Policy } = await import(new URL("src/policy.js", sources));
const { Simulation } = await import(new URL("src/simulation.js", sources));

const [page, trials] = process.argv.slice(2);
const facts = JSON.parse(readFileSync(`${page}/page.json`, "utf8"));
const simulation = new Simulation(await loadMujoco(), facts, readFileSync(`${page}/model.xml`, "utf8"));
ort.env.wasm.numThreads = 1;
ort.env.wasm.wasmBinary = readFileSync(new URL("ort-wasm-simd-threaded.wasm", modules));
const graph = new Uint8Array(readFileSync(`${page}/policy.onnx`));
const session = await ort.InferenceSession.create(graph, { executionProviders: ["wasm"] });
const policy = new Policy(ort, session, facts);

const largest = (found, expected) => expected.reduce((most, x, i) => Math.max(most, Math.abs(x - found[i])), 0);
const result = { episodes: 0, successes: 0, different: 0, observation: {}, control: 0, positions: 0, action: 0, ms: 0 };
let steps = 0;
for (const episode of JSON.parse(readFileSync(trials, "utf8"))) {
  simulation.reset(episode.start);
  policy.reset();
  for (let k = 0; k < (episode.actions?.length ?? 0); k++) {
    for (const { name, key, low, offset, read } of offsets(simulation.observation.terms)) {
      const expected = episode.observations[k][key].slice(offset, offset + low.length);
      const found = [...simulation.observe()[key]].slice(offset, offset + low.length);
      result.observation[name] = Math.max(result.observation[name] ?? 0, largest(found, expected));
    }
    if (episode.success !== undefined) {
      const action = await policy.act(simulation.observe());
      result.action = Math.max(result.action, largest(action, episode.actions[k]));
    }
    simulation.step(episode.actions[k]);
    result.control = Math.max(result.control, largest([...simulation.data.ctrl], episode.controls[k]));
    result.positions = Math.max(result.positions, largest([...simulation.data.qpos], episode.positions[k]));
  }
  if (episode.success === undefined) continue;
  simulation.reset(episode.start);
  policy.reset();
  const began = performance.now();
  while (!simulation.ended) {
    simulation.step(await policy.act(simulation.observe()));
    steps += 1;
  }
  result.ms += performance.now() - began;
  result.episodes += 1;
  result.successes += Number(simulation.success.reached);
  result.different += Number(simulation.success.reached !== episode.success);
}
result.ms /= steps;
console.log(JSON.stringify(result));

function offsets(terms) {
  const ends = {};
  return terms.map((term) => {
    const offset = ends[term.key] ?? 0;
    ends[term.key] = offset + term.low.length;
    return { ...term, offset };
  });
}
