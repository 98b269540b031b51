// Simulates missions of a baseline and a variation in portions, for a page that asks for them.

const MOST_MEMORY = 2 ** 27; // of the engines that a worker keeps [bytes]

/** @type {Simulator} */
let simulator;
/** @type {Map<string, Engine>} */
const engines = new Map(); // by the positions of their sliders, the one used last at the end

onmessage = ({data}) => {
    if (data.module) {
        simulator = data;
        return;
    }
    const {name, first, count, job, wantsRecords} = data;
    const engine = keptEngine(data), began = performance.now();
    engine.exports.play(first, count);
    engine.exports.measure(count);
    const values = engine.floats("values").slice(0, count * engine.image.metrics.length);
    const records = wantsRecords ? Array.from({length: count}, (_, row) => engine.record(row)) : null;
    postMessage({name, first, count, job, values, records, took: performance.now() - began});
};

/**
 * The engine of a setting; those that were used long ago are forgotten.
 * @param {Order} order
 */
function keptEngine({choice: {positions, policy}, prices}) {
    const key = positions.join(" "), {arrays} = simulator.image;
    const size = arrays.reduce((sum, array) => sum + sizeOf(array), 0);
    const engine = engines.get(key) ?? new Engine(simulator, positions);
    engines.delete(key);
    for (const other of engines.keys()) if ((engines.size + 1) * size > MOST_MEMORY) engines.delete(other);
    engines.set(key, engine);
    engine.follow(policy);
    engine.floats("prices").set(prices);
    return engine;
}
