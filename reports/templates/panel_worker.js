// Simulates missions of a baseline and a variation in portions, for a page that asks for them.

let module, image;
const sides = {};

onmessage = ({data}) => {
    if (data.module) {
        ({module, image} = data);
        return;
    }
    const {side, key, setting, policy, prices, first, count, run, wantsRecords} = data;
    if (sides[side]?.key !== key) {
        sides[side] = {key, engine: new Engine(module, image, setting)};
        sides[side].engine.follow(policy);
        sides[side].engine.floats("prices").set(prices);
    }
    const {engine} = sides[side], began = performance.now();
    engine.exports.play(first, count);
    engine.exports.measure(count);
    const values = engine.floats("values").slice(0, count * image.metrics.length);
    const records = wantsRecords ? recordsOf(engine, count) : null;
    postMessage({side, first, count, run, values, records, took: performance.now() - began});
};

// The bytes of the records of each mission: of the mission, of its UAVs, and of what was measured.
function recordsOf(engine, count) {
    const parts = ["mission_records", "uav_records", "operations"].map((name) => {
        const bytes = engine.bytes(name), rows = image.arrays.find((array) => array.name === name).shape[0];
        return [bytes, bytes.length / rows];
    });
    return Array.from({length: count}, (_, row) => {
        const record = new Uint8Array(parts.reduce((sum, [, size]) => sum + size, 0));
        let end = 0;
        for (const [bytes, size] of parts) {
            record.set(bytes.subarray(row * size, (row + 1) * size), end);
            end += size;
        }
        return record;
    });
}
