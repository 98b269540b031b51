// The engine of dess in a page: the WebAssembly module, with the arrays of a scenario.
// See docs/reference/webassembly.md. Used by the page and by its workers.

const FORBIDDEN = "The server of the page, or the browser, may forbid it. A copy of the page that you save and open as a file may be able to.";
const WORDS = 5; // of the table of arrays, for each array: its address and up to four sizes

/**
 * The arrays of a scenario, and what settings change in them.
 * @typedef { {name: string, item: number, shape: number[], bytes?: any, fill?: string}} ArrayOfImage
 * @typedef { {
 *     setting: string, values: any[], recipe?: [string, number, string, number][],
 *     patches?: Record<string, [number, string][]>[],
 * }} Slider
 * @typedef { {
 *     arrays: ArrayOfImage[], fields: Record<string, Record<string, [number, string, number]>>,
 *     metrics: string[], totals: string[], policies: Record<string, number>, network: string[], sliders: Slider[],
 *     isBare?: boolean,
 * }} Image
 * @typedef { {module: WebAssembly.Module, image: Image}} Simulator
 */

/**
 * The positions of all sliders, and the policy.
 * @typedef { {positions: number[], policy: string}} Choice
 */

/** @param {string} text */
function bytesOfBase64(text) {
    return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
}

/**
 * A text of the page that is packed: base64 of bytes compressed by gzip.
 * @param {string} id
 */
async function unpack(id) {
    const packed = bytesOfBase64(document.getElementById(id).textContent.trim());
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** @type {(array: ArrayOfImage) => number} */
const sizeOf = ({item, shape}) => shape.reduce((product, length) => product * length, item);

/**
 * The module and the image that a page contains, with the arrays of the network, which lie one behind the other.
 * @param {string} name - the beginning of the ids of both
 * @returns {Promise<Simulator>}
 */
async function unpackEngine(name) {
    const module = await WebAssembly.compile(await unpack(`${name}-module`));
    const image = JSON.parse(new TextDecoder().decode(await unpack(`${name}-image`)));
    for (const array of image.arrays) if (array.bytes) array.bytes = bytesOfBase64(array.bytes);
    const network = await unpack(`${name}-network`);
    let end = 0;
    for (const array of image.arrays.filter((other) => image.network.includes(other.name)))
        array.bytes = network.subarray(end, end += sizeOf(array));
    return {module, image};
}

/**
 * Arrays of a kind, one behind the other.
 * @type {(kind: any, parts: any[]) => any}
 */
function joined(kind, parts) {
    const whole = new kind(parts.reduce((sum, part) => sum + part.length, 0));
    parts.reduce((end, part) => (whole.set(part, end), end + part.length), 0);
    return whole;
}

class Engine {
    // Lay out the arrays of an image. A bare image has no scenario, and only adds up values.
    /**
     * @param {Simulator} simulator
     * @param {number[]} positions - of the sliders; by default they change nothing
     */
    constructor({module, image}, positions = []) {
        /** @type {any} */
        this.exports = new WebAssembly.Instance(module, {}).exports;
        this.image = image;
        /** @type {Record<string, number>} */
        this.places = {};
        const rows = image.arrays.map((array) => {
            this.places[array.name] = this.exports.reserve(sizeOf(array));
            return [this.places[array.name], ...array.shape];
        });
        const table = this.view(BigInt64Array, this.exports.arrays(), WORDS * rows.length);
        rows.forEach((words, row) => words.forEach((word, n) => { table[WORDS * row + n] = BigInt(word); }));
        for (const array of image.arrays) {
            if (array.bytes) this.write(array.name, 0, array.bytes);
            if (array.fill === "nan") this.floats(array.name).fill(NaN);
        }
        positions.forEach((position, n) => this.move(image.sliders[n], position));
        if (!image.isBare) this.exports.prepare();
    }

    // Memory may have grown, so that views have to be made again after each call of the module.
    view(kind, place, length) {
        return new kind(this.exports.memory.buffer, place, length);
    }

    write(name, offset, bytes) {
        this.view(Uint8Array, this.places[name] + offset, bytes.length).set(bytes);
    }

    bytes(name) {
        return this.view(Uint8Array, this.places[name], sizeOf(this.image.arrays.find((array) => array.name === name)));
    }

    floats(name) {
        return this.view(Float64Array, this.places[name], this.bytes(name).length / 8);
    }

    /**
     * The bytes of the records of a mission: of itself, of its UAVs, and of what was measured.
     * @param {number} row
     */
    record(row) {
        const parts = ["mission_records", "uav_records", "operations"].map((name) => {
            const bytes = this.bytes(name), {shape} = this.image.arrays.find((array) => array.name === name);
            const size = bytes.length / shape[0];
            return bytes.subarray(row * size, (row + 1) * size);
        });
        return joined(Uint8Array, parts);
    }

    // A field of all records of an array.
    field(array, name) {
        const [offset, kind] = this.image.fields[array][name], bytes = this.bytes(array);
        const {item} = this.image.arrays.find((other) => other.name === array);
        const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
        const read = {
            i8: (place) => Number(view.getBigInt64(place, true)),
            f8: (place) => view.getFloat64(place, true),
            b1: (place) => view.getUint8(place) > 0,
        }[kind];
        return Array.from({length: bytes.length / item}, (_, row) => read(row * item + offset));
    }

    // Change what a slider changes, for the value at a position.
    move(slider, position) {
        for (const [array, offset, kind, factor] of slider.recipe ?? []) {
            const content = slider.values[position] * factor;
            const word = kind === "i8" ? BigInt64Array.of(BigInt(content)) : Float64Array.of(content);
            this.write(array, offset, new Uint8Array(word.buffer));
        }
        for (const [array, parts] of Object.entries(slider.patches?.[position] ?? {}))
            for (const [offset, part] of parts) this.write(array, offset, bytesOfBase64(part));
    }

    /**
     * All UAVs follow a policy.
     * @param {string} policy
     */
    follow(policy) {
        const words = this.bytes("policies").length / 8;
        this.view(BigInt64Array, this.places.policies, words).fill(BigInt(this.image.policies[policy]));
    }
}

/**
 * The engine of a choice.
 * @type {(simulator: Simulator, choice: Choice) => Engine}
 */
function engineOf(simulator, {positions, policy}) {
    const engine = new Engine(simulator, positions);
    engine.follow(policy);
    return engine;
}
