// The runs of a panel: each is one record, the missions of a setting, and any two are compared.

const NAMES = ["A", "B"]; // of the runs that are shown
const MOST_RUNS = 20; // in the list

/** @type {(choice: Choice, prices: number[]) => string} */
const keyOfRun = (choice, prices) => [keyOf(choice), ...prices].join(" ");

/**
 * What changes from a choice to another one.
 * @type {(from: Choice, to: Choice) => string[]}
 */
function changesInWords(from, to) {
    const changes = data.settings.flatMap(({name, texts}, n) =>
        from.positions[n] === to.positions[n] ? [] : [`${name} ${texts[from.positions[n]]} → ${texts[to.positions[n]]}`]);
    return from.policy === to.policy ? changes : [`${from.policy} → ${to.policy}`, ...changes];
}

class Run extends Track {
    /**
     * @param {Simulator} simulator
     * @param {number} number
     * @param {Choice} choice
     * @param {number[]} prices
     */
    constructor(simulator, number, choice, prices) {
        super(simulator, `Run ${number}`, choice, prices);
        this.key = keyOfRun(choice, prices);
        this.hashes = hashesOf(choice);
        /** @type {Set<number>} */
        this.same = new Set(); // missions that are those of Python
        this.differing = Infinity; // the first one that is not
    }

    /**
     * As of any track, with the records that are compared with those of Python.
     * @param {number} most
     */
    next(most) {
        const order = super.next(most);
        return {...order, wantsRecords: order.first < this.hashes.length};
    }

    /** @param {Answer} answer */
    take(answer) {
        answer.records?.slice(0, this.hashes.length - answer.first).forEach((record, row) => {
            const replication = answer.first + row;
            if (sha256(record) === this.hashes[replication]) this.same.add(replication);
            else this.differing = Math.min(this.differing, replication);
        });
        super.take(answer);
    }

    // What the comparison with Python has found.
    get checkInWords() {
        if (this.differing < Infinity)
            return `Mission ${this.differing} of the page's baseline differs from the one that Python simulates.`;
        let compared = 0;
        while (this.same.has(compared)) compared += 1;
        return compared ? `The first ${compared} missions of the page's baseline are the same as those of Python, bit for bit.` : "";
    }

    /**
     * The products of the first missions.
     * @param {number} count
     */
    products(count) {
        const {values, width} = this;
        return Array.from({length: count}, (_, row) => values[row * width + data.product]);
    }
}

// The list of runs, of which the reader chooses one or two.
class Runs {
    /**
     * @param {Simulator} simulator
     * @param {(runs: Run[]) => void} choose
     */
    constructor(simulator, choose) {
        this.simulator = simulator;
        this.choose = choose;
        this.number = 0;
        /** @type {Map<Run, any>} */
        this.rows = new Map();
        /** @type {Run[]} */
        this.shown = [];
    }

    /**
     * The run of a setting that has at most so many missions; a new one if there is none.
     * @type {(choice: Choice, prices: number[], changes: string[], most: number) => Run}
     */
    runOf(choice, prices, changes, most) {
        const key = keyOfRun(choice, prices), runs = [...this.rows.keys()];
        const known = runs.find((run) => run.key === key && run.count <= most);
        if (known) return known;
        const run = new Run(this.simulator, ++this.number, choice, prices);
        const row = find("run-row").content.firstElementChild.cloneNode(true);
        row.cells[1].textContent = changes.join("; ") || "nothing";
        row.querySelector("button").addEventListener("click", () => this.press(run));
        find("run-rows").append(row);
        this.rows.set(run, row);
        if (runs.length === MOST_RUNS) {
            this.rows.get(runs[0]).remove();
            this.rows.delete(runs[0]);
        }
        return run;
    }

    /**
     * Choose a run; beside the one that is shown, if that is another one and alone.
     * @param {Run} run
     */
    press(run) {
        const [first, second] = this.shown;
        this.choose(second || first === run ? [run] : [first, run]);
    }

    /**
     * @param {Metric[]} metrics - whose means are listed
     * @param {Run[]} shown
     */
    show(metrics, shown) {
        this.shown = shown;
        for (const [run, row] of this.rows) {
            const side = shown.indexOf(run), button = row.querySelector("button");
            button.setAttribute("aria-pressed", String(side >= 0));
            button.textContent = side >= 0 ? `${run.name}: ${NAMES[side]}` : run.name;
            row.cells[2].textContent = grouped(run.count);
            const means = metrics.filter((metric) => run.estimate(metric).count)
                .map((metric) => `${metric.name} ${interval(metric, run.estimate(metric))}`);
            row.cells[3].textContent = means.join("; ");
        }
    }
}
