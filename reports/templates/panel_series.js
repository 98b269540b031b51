// The missions of settings, and their differences: the module adds them up.

const PORTION = 120; // the time that a portion of missions should take [ms]
const SUMMED = ["values", "baseline", "totals", "sequences", "ends"]; // what a series needs
// Numbers of a metric in the array of that name: the least and the largest value, by how much a
// failure changes a value, and the error.
const BOUNDS = 4, FAILURE = 2;
const ENDS = 4; // of a metric: those of its interval, then those of what was seen

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
        this.room = image.arrays.find(({name}) => name === "values").shape[0]; // the most missions of a call
        this.engine = new Engine({...simulator, image: {...image, arrays, isBare: true}}, positions);
        this.count = 0;
        if (error !== null) {
            const bounds = this.engine.floats("bounds");
            for (let place = BOUNDS - 1; place < bounds.length; place += BOUNDS) bounds[place] = error;
        }
        this.engine.floats("prices").set(prices);
        this.engine.exports.begin(0);
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
        series.engine.exports.begin(1);
        return series;
    }

    /**
     * Add the values of missions; less those of the same missions of a baseline, if there is one.
     * @param {Float64Array} values
     * @param {Float64Array | null} baseline
     */
    add(values, baseline = null) {
        const {width} = this, most = this.room * width;
        for (let begin = 0; begin < values.length; begin += most) {
            const rows = values.subarray(begin, begin + most), count = rows.length / width;
            this.engine.floats("values").set(rows);
            if (baseline) {
                this.engine.floats("baseline").set(baseline.subarray(begin, begin + most));
                this.engine.exports.subtract(count);
            }
            this.engine.exports.add(count);
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
        const count = Math.min(Math.max(fit, 1), this.room, most);
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
