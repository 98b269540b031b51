// The part of a page that simulates: what it is made of, how it opens, and what all of them show.

/** @type {any} */
const root = document.querySelector(".panel");
const data = JSON.parse(document.getElementById("panel-data").textContent);
const BEFORE = "The results below are of the settings before. Press Run for those of the new settings.";
/** @type {(name: string) => any} */
const find = (name) => root.querySelector(`[data-panel="${name}"]`);
/** @type {(name: string) => any} */
const named = (name) => root.querySelector(`[name="${name}"]`);

/**
 * The whole number that is nearest to what an input says, within its limits.
 * @param {HTMLInputElement} input
 */
const wholeNumber = ({value, min, max}) => Math.min(Math.max(Math.round(Number(value)) || 0, Number(min)), Number(max));

/**
 * Unpack the engine, and let the reader use the panel; otherwise say there why the page cannot simulate.
 * @param {(simulator: Simulator) => void} begin
 */
async function openPanel(begin) {
    try {
        for (const name of ["WebAssembly", "DecompressionStream", "Worker"])
            if (!(/** @type {any} */ (window))[name]) throw new Error(`the browser has no ${name}`);
        const simulator = await unpackEngine("panel");
        root.hidden = false;
        root.querySelectorAll("fieldset").forEach((fieldset) => { fieldset.disabled = false; });
        begin(simulator);
        root.dataset.ready = "yes";
    } catch (error) {
        const line = document.createElement("p");
        line.className = "note";
        line.textContent = `This page cannot simulate missions here: ${error.message}. ${FORBIDDEN}`;
        root.replaceChildren(line);
        root.hidden = false;
    }
}

/**
 * The hashes of the first missions of a choice in Python, where the page knows them.
 * @type {(choice: Choice) => string[]}
 */
const hashesOf = (choice) => keyOf(choice) === keyOf(data.check) ? data.check.hashes : [];

/**
 * Mark that the results are not of the settings that are chosen now.
 * @param {boolean} isStale
 */
function markStale(isStale) {
    find("results").classList.toggle("stale", isStale);
    find("before").hidden = !isStale;
}

/**
 * Write into the table of metrics.
 * @param {Comparison} comparison
 */
function showComparison(comparison) {
    for (const metric of data.metrics) {
        const row = root.querySelector(`tr[data-metric="${metric.column}"]`), texts = comparison.inWords(metric);
        row.hidden = texts === null;
        texts?.forEach((text, n) => { row.cells[n + 1].textContent = text; });
    }
}

/**
 * Simulate missions slot by slot, and play each below the other.
 * @param {any} place
 * @param {Record<string, {engine: Engine, title: string}>} missions - by the ids of their players
 * @param {number} replication
 */
function playMissions(place, missions, replication) {
    place.replaceChildren();
    for (const [id, {engine, title}] of Object.entries(missions)) {
        const figure = document.createElement("figure");
        figure.className = "player";
        figure.id = id;
        figure.append(/** @type {any} */ (document.getElementById("panel-player")).content.cloneNode(true));
        place.append(figure);
        playMission(id, [replay(engine, replication, data.sea, title)]);
    }
}
