// The missions of a panel: Web Workers simulate them in portions, and the module adds them up.

/**
 * What a worker is asked for: some missions of a setting.
 * @typedef {object} Order
 * @property {string} name - of the track
 * @property {Choice} choice
 * @property {number[]} prices
 * @property {boolean} wantsRecords
 * @property {number} first - the replication of the first mission
 * @property {number} count
 */

/**
 * What a worker answers.
 * @typedef {object} Answer
 * @property {number} job
 * @property {string} name
 * @property {number} first
 * @property {number} count
 * @property {Float64Array} values
 * @property {Uint8Array[] | null} records
 * @property {number} took - the time [ms]
 */

/**
 * What workers do: it gives out orders until there is nothing to do, and takes the answers.
 * @typedef { {isOver: boolean, next: () => Order | null, take: (answer: Answer) => void}} Job
 */

/** @typedef { {worker: Worker, isBusy: boolean}} Member */

const PORTION = 120; // the time that a portion of missions should take [ms]
const MOST_WORKERS = 8;
const SUMMED = ["values", "baseline", "totals", "sequences", "ends"]; // what a series needs
// Numbers of a metric in the array of that name: the least and the largest value, by how much a
// failure changes a value, and the error.
const BOUNDS = 4, FAILURE = 2;
const ENDS = 4; // of a metric: those of its interval, then those of what was seen
const rowsOf = (/** @type {Image} */ image, /** @type {string} */ name) =>
    image.arrays.find((array) => array.name === name)?.shape[0] ?? 0;

// Sums and intervals of a series of missions, or of the differences of two, computed by the module.
class Series {
    /**
     * @param {Simulator} simulator
     * @param {number[]} positions
     * @param {number[]} prices
     * @param {number | null} error - the probability that an interval fails, if not that of the image
     */
    constructor(simulator, positions = [], prices = [], error = null) {
        const {image} = simulator, arrays = image.arrays.map((array) =>
            array.bytes || SUMMED.includes(array.name) ? array : {...array, shape: array.shape.map(() => 0)});
        this.simulator = simulator;
        this.width = image.metrics.length;
        this.engine = new Engine({...simulator, image: {...image, arrays, isBare: true}}, positions);
        this.count = 0;
        if (error !== null) {
            const bounds = this.engine.floats("bounds");
            for (let place = BOUNDS - 1; place < bounds.length; place += BOUNDS) bounds[place] = error;
        }
        this.engine.floats("prices").set(prices);
        this.engine.call("begin", 0);
    }

    /**
     * The differences of two series, which have values between the bounds of both.
     * @param {Series} before
     * @param {Series} after
     */
    static ofDifferences(before, after) {
        const series = new Series(before.simulator), bounds = series.engine.floats("bounds");
        const [ours, theirs] = [before, after].map(({engine}) => engine.floats("bounds"));
        for (let metric = 0; metric < bounds.length; metric += BOUNDS) {
            bounds[metric] = Math.min(ours[metric], theirs[metric]);
            for (const place of [metric + 1, metric + FAILURE]) bounds[place] = Math.max(ours[place], theirs[place]);
        }
        series.engine.call("begin", 1);
        return series;
    }

    /**
     * Add the values of missions; less those of the same missions of a baseline, if there is one.
     * @param {Float64Array} values
     * @param {Float64Array | null} baseline
     */
    add(values, baseline = null) {
        const {width} = this, most = rowsOf(this.simulator.image, "values") * width;
        for (let begin = 0; begin < values.length; begin += most) {
            const rows = values.subarray(begin, begin + most), count = rows.length / width;
            this.engine.floats("values").set(rows);
            if (baseline) {
                this.engine.floats("baseline").set(baseline.subarray(begin, begin + most));
                this.engine.call("subtract", count);
            }
            this.engine.call("add", count);
            this.count += count;
        }
    }

    /**
     * @param {Metric} metric
     * @returns {Estimate}
     */
    estimate({column}) {
        const [totals, ends] = [this.engine.floats("totals"), this.engine.floats("ends")];
        const [count, sum] = totals.slice(column * totals.length / this.width);
        const [low, high, lowSeen, highSeen] = ends.slice(ENDS * column);
        return {mean: sum / count, low, high, lowSeen, highSeen, count};
    }
}

// The missions of a setting, of which only the unbroken beginning counts.
class Track extends Series {
    /**
     * @param {Simulator} simulator
     * @param {string} name
     * @param {Choice} choice
     * @param {number[]} prices
     * @param {number | null} error
     */
    constructor(simulator, name, choice, prices = [], error = null) {
        super(simulator, choice.positions, prices, error);
        this.name = name;
        this.choice = choice;
        this.prices = prices;
        this.asked = 0;
        this.took = 0; // by a mission [ms]
        /** @type {Map<number, Float64Array>} */
        this.waiting = new Map();
        /** @type {Float64Array[]} */
        this.parts = [];
    }

    /**
     * The order of the next missions, at most so many.
     * @param {number} most
     * @returns {Order}
     */
    next(most) {
        const {name, choice, prices, asked: first} = this, fit = this.took ? Math.floor(PORTION / this.took) : 1;
        const count = Math.min(Math.max(fit, 1), rowsOf(this.simulator.image, "values"), most);
        this.asked += count;
        return {name, choice, prices, first, count, wantsRecords: false};
    }

    /**
     * Take what a worker answers.
     * @param {Answer} answer
     */
    take({first, count, values, took}) {
        this.took = took / count;
        this.waiting.set(first, values);
        for (let rows; (rows = this.waiting.get(this.count)); this.parts.push(rows)) {
            this.waiting.delete(this.count);
            this.add(rows);
        }
    }

    // Forget the missions after the unbroken beginning, so that they are asked for again.
    rewind() {
        this.waiting.clear();
        this.asked = this.count;
    }

    // The values of the missions, in their order.
    get values() {
        if (this.parts.length !== 1) this.parts = [joined(Float64Array, this.parts)];
        return this.parts[0];
    }
}

/**
 * The missions of one or two tracks, and the differences of two, B - A.
 * @template {Track} [T=Track]
 */
class Comparison {
    /**
     * @param {T[]} tracks
     * @param {number} target - the missions of each
     */
    constructor(tracks, target) {
        this.tracks = tracks;
        this.target = target;
        this.seconds = 0;
        this.began = performance.now();
        /** @type {Series | null} */
        this.difference = tracks.length > 1 ? Series.ofDifferences(tracks[0], tracks[1]) : null;
        this.addDifferences();
        this.isOver = this.isComplete;
        tracks.forEach((track) => track.rewind());
    }

    // The number of missions that all tracks have.
    get count() {
        return Math.min(...this.tracks.map(({count}) => count));
    }

    get isComplete() {
        return this.count >= this.target;
    }

    // The next missions of the track of which fewer have been given out.
    next() {
        const track = this.tracks.reduce((least, other) => other.asked < least.asked ? other : least);
        return track.asked < this.target ? track.next(this.target - track.asked) : null;
    }

    /** @param {Answer} answer */
    take(answer) {
        this.tracks.find(({name}) => name === answer.name).take(answer);
        this.addDifferences();
        this.isOver = this.isComplete;
        if (this.isOver) this.seconds = (performance.now() - this.began) / 1000;
    }

    // The differences of the missions that both tracks have.
    addDifferences() {
        if (!this.difference) return;
        const [a, b] = this.tracks.map(({values}) => values), from = this.difference.count * this.difference.width;
        const end = Math.min(a.length, b.length);
        if (end > from) this.difference.add(b.subarray(from, end), a.subarray(from, end));
    }

    /**
     * What a table says of a metric: A, B, the difference, and whether it is decided; nothing if
     * no mission has it.
     * @param {Metric} metric
     */
    inWords(metric) {
        const estimates = this.tracks.map((track) => track.estimate(metric));
        if (!estimates.some(({count}) => count)) return null;
        const texts = estimates.map((estimate) => estimate.count ? interval(metric, estimate) : "");
        if (!this.difference) return [...texts, "the same as A", "", ""];
        const gap = this.difference.estimate(metric);
        return [...texts, gap.count ? difference(metric, gap) : "", gap.count ? decision(metric, gap) : ""];
    }
}

// The workers, which do one job at a time.
class Crew {
    /**
     * @param {Simulator} simulator
     * @param {(why?: string) => void} changed - called after each answer, and with the reason when a worker dies
     */
    constructor(simulator, changed) {
        this.simulator = simulator;
        this.changed = changed;
        this.number = 0;
        /** @type {Member[]} */
        this.members = [];
        /** @type {Job | null} */
        this.job = null;
        this.hasWorked = false;
    }

    /** @param {Job} job */
    begin(job) {
        this.end();
        this.job = job;
        this.number += 1;
        const most = Math.min(Math.max((navigator.hardwareConcurrency || 2) - 1, 1), MOST_WORKERS);
        try {
            while (this.members.length < most) this.members.push(this.hire());
            this.wake();
        } catch (error) { // where workers are forbidden, some browsers throw, and others send an event
            this.lose(error.message);
        }
    }

    end() {
        if (this.job) this.job.isOver = true;
        this.job = null;
        this.members.filter(({isBusy}) => isBusy).forEach(({worker}) => worker.terminate());
        this.members = this.members.filter(({isBusy}) => !isBusy);
    }

    /** @param {Job} job */
    isDoing(job) {
        return job !== null && this.job === job && !job.isOver;
    }

    /** @returns {Member} */
    hire() {
        const source = document.getElementById("panel-worker").textContent;
        const address = URL.createObjectURL(new Blob([source], {type: "text/javascript"}));
        const member = {worker: new Worker(address), isBusy: false};
        URL.revokeObjectURL(address);
        member.worker.onmessage = (event) => this.take(member, event.data);
        member.worker.onerror = (event) => {
            event.preventDefault();
            this.lose(event.message || "a worker died");
        };
        member.worker.postMessage(this.simulator);
        return member;
    }

    /**
     * Say why a worker was lost.
     * @param {string} why
     */
    lose(why) {
        this.end();
        this.changed(this.hasWorked
            ? `The browser ended the simulation (${why}); what is shown is of the missions before.`
            : `This page cannot simulate missions here: its workers cannot start (${why}). ${FORBIDDEN}`);
    }

    // Give orders to those who have none.
    wake() {
        this.members.filter(({isBusy}) => !isBusy).forEach((member) => this.give(member));
    }

    /** @param {Member} member */
    give(member) {
        const order = this.job?.next();
        if (!order) return;
        member.isBusy = true;
        member.worker.postMessage({...order, job: this.number});
    }

    /**
     * @param {Member} member
     * @param {Answer} answer
     */
    take(member, answer) {
        member.isBusy = false;
        this.hasWorked = true;
        if (!this.job || answer.job !== this.number) return;
        this.job.take(answer);
        this.give(member);
        this.changed();
    }
}
