// The buyer's grid: fleets of UAVs and charging pads, and which of them are known to meet
// requirements. Its intervals hold together and for any bounds, so that these may be moved.

/**
 * A fleet in words, where the table has it, and its missions.
 * @typedef { {name: string, place: HTMLElement, track: Track}} Cell
 */

const GRID_ERROR = 0.05; // the probability that an interval of any cell fails
const BLOCK = 50; // missions of a cell before it is another one's turn
const FEWEST = 30; // missions of a cell, with which its cost has an interval

class Grid {
    /**
     * @param {Cell[]} cells
     * @param {Requirement[]} requirements
     * @param {Metric} cost
     * @param {number} indifference - the least saving that matters
     */
    constructor(cells, requirements, cost, indifference) {
        this.cells = cells;
        this.requirements = requirements;
        this.cost = cost;
        this.indifference = indifference;
        this.isOver = true;
        this.target = 0; // missions in all
        this.away = 0; // orders that are not answered
        this.columns = new Set([cost, ...requirements.map(({metric}) => metric)].map(({column}) => column));
    }

    /**
     * Go on, up to so many missions in all.
     * @param {number} missions
     */
    extend(missions) {
        this.cells.forEach(({track}) => track.rewind());
        this.target = missions;
        this.away = 0;
        this.isOver = !this.hasWork();
    }

    get count() {
        return this.cells.reduce((sum, {track}) => sum + track.count, 0);
    }

    get asked() {
        return this.cells.reduce((sum, {track}) => sum + track.asked, 0);
    }

    hasWork() {
        return this.asked < this.target && this.needed().length > 0;
    }

    /** @param {Cell} cell */
    costOf(cell) {
        return cell.track.estimate(this.cost);
    }

    /**
     * The cells whose missions decide which is the cheapest, as in the search of a study. First, all
     * have a few. Until a cell meets the requirements, they are those that cost no more than one
     * whose means meet them, or hardly more; then this cell and those that may be cheaper.
     * @returns {Cell[]}
     */
    needed() {
        const begun = this.cells.filter(({track}) => track.asked < FEWEST);
        if (begun.length) return begun;
        if (this.cells.some(({track}) => track.count < FEWEST)) return [];
        const answer = this.cheapest();
        if (answer) return answer.rivals.length ? [answer.cell, ...answer.rivals] : [];
        const possible = this.cells.filter((cell) => this.verdict(cell) === "open");
        const isPromising = (/** @type {Cell} */ {track}) => this.requirements.every((required) =>
            roomOf(required, track.estimate(required.metric).mean) >= 0);
        const most = Math.min(...possible.filter(isPromising).map((cell) => this.costOf(cell).mean)) + this.indifference;
        return possible.filter((cell) => this.costOf(cell).mean <= most);
    }

    // The next missions of a cell that is needed, the cheapest first. The cells take turns by blocks,
    // since a worker has the arrays of few cells at a time.
    next() {
        if (!this.hasWork()) return null;
        const needed = this.needed(), turns = (/** @type {Cell} */ {track}) => Math.floor(track.asked / BLOCK);
        const isBefore = (/** @type {Cell} */ one, /** @type {Cell} */ other) => {
            if (turns(one) !== turns(other)) return turns(one) < turns(other);
            if (one.track.asked !== other.track.asked) return one.track.asked > other.track.asked;
            return this.costOf(one).mean < this.costOf(other).mean;
        };
        const {track} = needed.reduce((first, other) => isBefore(other, first) ? other : first);
        const most = track.asked < FEWEST ? FEWEST - track.asked : Infinity;
        this.away += 1;
        return track.next(Math.min(most, this.target - this.asked));
    }

    /** @param {Answer} answer */
    take(answer) {
        const {values} = answer, {width} = this.cells[0].track;
        for (let place = 0; place < values.length; place++) // what no requirement asks for needs no interval
            if (!this.columns.has(place % width)) values[place] = NaN;
        this.cells.find(({track}) => track.name === answer.name)?.track.take(answer);
        this.away -= 1;
        this.isOver = this.away === 0 && !this.hasWork();
    }

    /**
     * What is known of the requirements together, within their tolerances: the most serious of what is known of each.
     * @param {Cell} cell
     * @returns {string}
     */
    verdict({track}) {
        const verdicts = this.requirements.map((required) =>
            verdict(required, track.estimate(required.metric), required.metric.tolerance));
        return VERDICTS.mostSeriousFirst.find((word) => verdicts.includes(word));
    }

    /**
     * The cell with the least mean cost that meets the requirements, and those that may be cheaper,
     * by more than the indifference, and do not miss them.
     * @returns { {cell: Cell, rivals: Cell[]} | null}
     */
    cheapest() {
        const costs = new Map(this.cells.map((cell) => [cell, this.costOf(cell)]));
        const good = this.cells.filter((cell) => this.verdict(cell) === "met" && costs.get(cell).count >= FEWEST);
        if (!good.length) return null;
        const cell = good.reduce((least, other) => costs.get(other).mean < costs.get(least).mean ? other : least);
        const rivals = this.cells.filter((other) =>
            other !== cell && !(costs.get(cell).high - costs.get(other).low <= this.indifference) && this.verdict(other) !== "missed");
        return {cell, rivals};
    }

    // Which cell is the cheapest, in words.
    inWords() {
        const answer = this.cheapest();
        if (answer === null) {
            const possible = this.cells.some((cell) => this.verdict(cell) === "open");
            return possible ? "No cell is known to meet the requirements." : "No cell meets the requirements.";
        }
        const {cell, rivals} = answer, amount = written(this.cost, cell.track.estimate(this.cost).mean);
        if (!rivals.length) return `The cheapest is ${cell.name} for ${amount}: every cheaper cell misses the requirements.`;
        return `The cheapest so far is ${cell.name} for ${amount}; ${rivals.map(({name}) => name).join("; ")} may be cheaper.`;
    }

    /**
     * What is known of each cell, as lines of a table.
     * @returns {(string | number)[][]}
     */
    rows() {
        const metrics = [...this.requirements.map(({metric}) => metric), this.cost];
        const head = metrics.flatMap(({key}) => [key, `${key}_low`, `${key}_high`]);
        return [["fleet", "verdict", "missions", ...head], ...this.cells.map((cell) => {
            const {track} = cell, estimates = metrics.map((metric) => track.estimate(metric));
            return [cell.name, this.verdict(cell), track.count, ...estimates.flatMap(({mean, low, high}) => [mean, low, high])];
        })];
    }

    // Write into the table what is known of each cell, and frame the cheapest.
    show() {
        const answer = this.cheapest();
        for (const cell of this.cells) {
            const {place, track} = cell, word = this.verdict(cell), mark = document.createElement("strong");
            mark.textContent = word;
            const isFramed = answer?.cell === cell;
            place.className = `${track.count ? word : ""} ${isFramed ? (answer.rivals.length ? "leading" : "cheapest") : ""}`.trim();
            if (!track.count) {
                place.textContent = "";
                continue;
            }
            const details = this.requirements.map(({metric}) => `${metric.name} ${interval(metric, track.estimate(metric))}`);
            details.push(`${grouped(track.count)} missions`);
            const lines = [written(this.cost, track.estimate(this.cost).mean), ...details];
            if (isFramed) lines.unshift(answer.rivals.length ? "cheapest so far" : "cheapest");
            place.replaceChildren(mark, ...lines.map((line) => {
                const part = document.createElement("span");
                part.className = details.includes(line) ? "detail" : "";
                part.textContent = line;
                return part;
            }));
        }
    }
}
