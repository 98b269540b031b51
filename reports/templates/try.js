// Three controls on the index: what changes if the fleet of the example, or its data, changes.

(() => {
"use strict";
const MISSIONS = 1000; // of each side
const controls = new Controls(root, "b", data.settings);
/** @type {WorkerPool} */
let pool;
/** @type {Comparison | null} */
let comparison = null;

/** @type {(name: string, positions: number[]) => Track} */
const trackOf = (name, positions) => new Track(pool.simulator, name, {positions, policy: data.policy});

function start() {
    comparison = new Comparison([trackOf("a", data.start.a), trackOf("b", controls.positions)], MISSIONS);
    pool.begin(comparison);
    find("results").hidden = false;
    show();
}

function stop() {
    pool.end();
    show();
}

function show(why = "") {
    controls.show();
    const isRunning = pool.isDoing(comparison);
    find("stop").disabled = !isRunning;
    if (!comparison) return;
    const isStale = comparison.tracks[1].choice.positions.join() !== controls.positions.join();
    markStale(isStale);
    find("status").textContent = isStale ? BEFORE
        : `${grouped(comparison.count)} missions of each${isRunning ? ", running" : ""}. ${why}`.trim();
    showComparison(comparison);
}

openPanel((simulator) => {
    pool = new WorkerPool(simulator, show);
    root.addEventListener("input", stop);
    find("run").addEventListener("click", start);
    find("stop").addEventListener("click", stop);
    show();
});
})();
