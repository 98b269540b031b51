// Simulates missions of a baseline and a variation in portions, for a page that asks for them.

const MOST_MEMORY = 2 ** 27; // of the engines that a worker keeps [bytes]

/** @type {WebAssembly.Module} */
let module;
/** @type {Image} */
let image;
/** @type {Map<string, Engine>} */
const engines = new Map(); // by the keys of their settings, the one used last at the end

onmessage = ({data}) => {
    if (data.module) {
        ({module, image} = data);
        return;
    }
    const {name, first, count, job, wantsRecords} = data;
    const engine = engineOf(data), began = performance.now();
    engine.call("play", first, count);
    engine.call("measure", count);
    const values = engine.floats("values").slice(0, count * image.metrics.length);
    const records = wantsRecords ? Array.from({length: count}, (_, row) => engine.record(row)) : null;
    postMessage({name, first, count, job, values, records, took: performance.now() - began});
};

/**
 * The engine of a setting; those that were used long ago are forgotten.
 * @param {Order} order
 */
function engineOf({key, setting, policy, prices}) {
    const size = image.arrays.reduce((sum, {item, shape}) => sum + shape.reduce((product, length) => product * length, item), 0);
    const engine = engines.get(key) ?? new Engine(module, image, setting);
    engines.delete(key);
    for (const other of engines.keys()) if ((engines.size + 1) * size > MOST_MEMORY) engines.delete(other);
    engines.set(key, engine);
    engine.follow(policy);
    engine.floats("prices").set(prices);
    return engine;
}
