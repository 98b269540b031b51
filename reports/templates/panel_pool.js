// Who simulates the missions of a panel: Web Workers, which are given orders.

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

const MOST_WORKERS = 8;

// The workers, which do one job at a time.
class WorkerPool {
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
        const most = Math.min(navigator.hardwareConcurrency || 2, MOST_WORKERS);
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
        this.wake();
        this.changed();
    }
}
