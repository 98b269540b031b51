// The buyer's grid: fleets of UAVs and charging pads, and which of them are known to meet
// requirements. It spends missions as the search of its page does, whose rule it has as data. Its
// intervals hold together and for any bounds, so that these may be moved.

/**
 * A fleet in words, where the table has it, its missions, and how many it needs so far.
 * @typedef { {name: string, place: HTMLElement, track: Track, wanted: number}} Cell
 */

/**
 * How a search spends its missions (`Cheapest.for_pages`).
 * @typedef {object} SearchRule
 * @property {number} first - the missions of every cell in the first round
 * @property {number} growth - the share that a round adds to the missions of the cells that are needed
 * @property {number} budget - the most missions in all
 * @property {number} error - the probability that an interval of any cell fails
 * @property {number} indifference - the least saving that matters
 */

const MOST_NAMED = 4; // of the cells that are open

class Grid {
    /**
     * @param {Cell[]} cells
     * @param {Requirement[]} requirements
     * @param {Metric} cost
     * @param {SearchRule} rule
     */
    constructor(cells, requirements, cost, rule) {
        this.cells = cells;
        this.requirements = requirements;
        this.cost = cost;
        this.rule = rule;
        this.isOver = false;
        this.columns = new Set([cost, ...requirements.map(({metric}) => metric)].map(({column}) => column));
    }

    // Go on where it was stopped, or with what a moved bound has opened.
    resume() {
        this.cells.forEach(({track}) => track.rewind());
        this.isOver = false;
        if (this.isRoundComplete) this.beginRound();
    }

    get count() {
        return this.cells.reduce((sum, {track}) => sum + track.count, 0);
    }

    get isRoundComplete() {
        return this.cells.every(({track, wanted}) => track.count >= wanted);
    }

    /** @param {Cell} cell */
    costOf(cell) {
        return cell.track.estimate(this.cost);
    }

    // More missions for the cells that are needed, as far as the budget reaches.
    beginRound() {
        const needed = this.needed(), room = this.rule.budget - this.count;
        let steps = needed.map(({wanted}) => Math.floor(this.rule.growth * wanted));
        if (steps.reduce((sum, step) => sum + step, 0) > room)
            steps = steps.map((step) => Math.min(step, Math.floor(room / needed.length)));
        needed.forEach((cell, n) => { cell.wanted += steps[n]; });
        this.cells.sort((one, other) => this.costOf(one).mean - this.costOf(other).mean);
        this.isOver = this.isRoundComplete;
    }

    /**
     * The cells whose missions decide which is the cheapest. Until a cell meets the requirements, they are
     * those that cost no more than one whose means meet them, or hardly more; then this cell and those that
     * may be cheaper.
     * @returns {Cell[]}
     */
    needed() {
        const answer = this.cheapest();
        if (answer) return answer.rivals.length ? [answer.cell, ...answer.rivals] : [];
        const possible = this.cells.filter((cell) => this.verdict(cell) === "open");
        const promising = possible.filter((cell) => this.isPromising(cell));
        const most = Math.min(...promising.map((cell) => this.costOf(cell).mean)) + this.rule.indifference;
        return possible.filter((cell) => this.costOf(cell).mean <= most);
    }

    // The next missions of the round, of the cheapest cell first. A worker has the arrays of few cells at a time.
    next() {
        const cell = this.cells.find(({track, wanted}) => track.asked < wanted);
        return cell ? cell.track.next(cell.wanted - cell.track.asked) : null;
    }

    /** @param {Answer} answer */
    take(answer) {
        const {values} = answer, {width} = this.cells[0].track;
        for (let place = 0; place < values.length; place++) // what no requirement asks for needs no interval
            if (!this.columns.has(place % width)) values[place] = NaN;
        this.cells.find(({track}) => track.name === answer.name)?.track.take(answer);
        if (this.isRoundComplete) this.beginRound();
    }

    /**
     * Whether the means of a cell meet the requirements.
     * @param {Cell} cell
     */
    isPromising({track}) {
        return this.requirements.every((required) => roomOf(required, track.estimate(required.metric).mean) >= 0);
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
        const good = this.cells.filter((cell) => this.verdict(cell) === "met");
        if (!good.length) return null;
        const cell = good.reduce((least, other) => costs.get(other).mean < costs.get(least).mean ? other : least);
        const rivals = this.cells.filter((other) =>
            other !== cell && !(costs.get(cell).high - costs.get(other).low <= this.rule.indifference) && this.verdict(other) !== "missed");
        return {cell, rivals};
    }

    // About how many more missions decide which cell is the cheapest, if all are like those so far.
    get missing() {
        const leader = this.cheapest()?.cell, needed = this.needed();
        return this.cells.reduce((sum, cell) => {
            const ofRound = cell.wanted - cell.track.count;
            const isOpen = cell !== leader && needed.includes(cell);
            return sum + Math.max(ofRound, isOpen ? this.missingOf(cell, leader) : 0);
        }, 0);
    }

    /**
     * About how many more missions show whether a cell meets the requirements, or that it is hardly cheaper
     * than the one that is known to.
     * @type {(cell: Cell, leader?: Cell) => number}
     */
    missingOf(cell, leader) {
        const {track} = cell, ways = [];
        if (this.verdict(cell) === "open") {
            const judged = (/** @type {Requirement} */ required) => missionsToJudge(required, track.estimate(required.metric));
            const broken = this.requirements.filter((required) => roomOf(required, track.estimate(required.metric).mean) < 0);
            // It misses if one is broken, and meets them once all are kept.
            ways.push(broken.length ? Math.min(...broken.map(judged)) : Math.max(...this.requirements.map(judged)));
        }
        if (leader) {
            const [costs, least] = [cell, leader].map((each) => this.costOf(each));
            const gap = least.high - least.mean + costs.mean - costs.low, distance = costs.mean - least.mean + this.rule.indifference;
            if (distance > 0) ways.push(missionsUntil(track.count, gap, gap, distance));
        }
        return Math.max(Math.min(...ways) - track.count, 0);
    }

    // Which cell is the cheapest, in words.
    inWords() {
        const answer = this.cheapest();
        const isOpen = this.cells.some((cell) => this.verdict(cell) === "open");
        if (answer === null) return `No cell ${isOpen ? "is known to meet" : "meets"} the requirements.`;
        const {cell, rivals} = answer, amount = written(this.cost, this.costOf(cell).mean);
        if (rivals.length) return `The cheapest so far is ${cell.name} for ${amount}.`;
        return `The cheapest is ${cell.name} for ${amount}: every cheaper cell misses the requirements.`;
    }

    // Which cells are open, the cheapest first, and about how many missions are missing.
    openInWords() {
        const leader = this.cheapest()?.cell, open = this.needed().filter((cell) => cell !== leader);
        if (!open.length) return "";
        const names = open.slice(0, MOST_NAMED).map(({name}) => name), others = open.length - names.length;
        return `Open: ${names.join("; ")}${others ? `; and ${others} others` : ""}. To settle it would take ${aboutMissions(this.missing)} more missions.`;
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
