// The panel of a page: a baseline and a variation that its reader simulates and compares.
// What it shows is exploration; only known settings come from the address, and nothing is sent.

(() => {
"use strict";
const NARROW = "(max-width: 40rem)"; // where settings are folded at first
const SIDES = ["a", "b"];
const [controlsA, controlsB] = SIDES.map((side) => new Controls(root, side, data.settings)), prices = new Prices(root, data.prices, data.priced);
const missions = named("missions");
const required = [...root.querySelectorAll("[data-panel=requirement]")].map((line, n) =>
    ({line, metric: named(`require-${n}`), bound: named(`bound-${n}`), slider: named(`slide-${n}`)}));
/** @type {(key: string) => Metric | undefined} */
const metricOf = (key) => data.metrics.find((metric) => metric.key === key);

/** @type {WorkerPool} */
let pool;
/** @type {Runs} */
let runs;
/** @type {Comparison<Run> | null} */
let comparison = null; // of the runs that are shown
let shownKey = "", shownCommand = ""; // what they are of
/** @type {Grid | null} */
let grid = null;
let gridKey = "", gridCommand = "";

const choices = () => [controlsA.choice, controlsB.choice];
// What the results depend on; not the number of missions, nor what is required.
const chosenKey = () => choices().map((choice) => keyOfRun(choice, prices.amounts)).join(" ");
const chosenCommand = () => studyCommand(data, controlsA.choice, controlsB.choice, prices.options, wholeNumber(missions));
const isStale = () => comparison !== null && shownKey !== chosenKey();

function tidy() {
    missions.value = wholeNumber(missions);
    prices.amounts = prices.amounts;
}

// Simulate the missions of A and B that no run has.
function start() {
    stop();
    tidy();
    const [a, b] = choices().map((choice) => {
        const changes = [...changesInWords(data.check, choice), ...prices.changesInWords(prices.amounts)];
        return runs.runOf(choice, prices.amounts, changes, wholeNumber(missions));
    });
    present(a === b ? [a] : [a, b], wholeNumber(missions));
}

/**
 * Show the runs that the reader has chosen, with their settings; of the prices, those of the last.
 * @param {Run[]} chosen
 */
function choose(chosen) {
    stop();
    const last = chosen[chosen.length - 1];
    controlsA.choice = chosen[0].choice;
    controlsB.choice = last.choice;
    prices.amounts = last.prices;
    missions.value = Math.max(Math.min(...chosen.map(({count}) => count)), 1);
    present(chosen, 0);
}

/** @type {(tracks: Run[], target: number) => void} */
function present(tracks, target) {
    find("mission").hidden = true;
    comparison = new Comparison(tracks, target);
    [shownKey, shownCommand] = [chosenKey(), chosenCommand()];
    pool.begin(comparison);
    show();
}

function stop() {
    pool.end();
    show();
}

// What is shown.
let isScheduled = false;
function schedule() {
    if (isScheduled) return;
    isScheduled = true;
    setTimeout(() => { isScheduled = false; show(); }, 100);
}

function show(why = "") {
    find("run").disabled = pool.isDoing(comparison);
    find("stop").disabled = !pool.isDoing(comparison);
    if (data.grid) showGrid();
    controlsA.show();
    controlsB.show(controlsA.positions);
    const changes = changesInWords(controlsA.choice, controlsB.choice);
    find("differing").textContent = changes.length ? `A → B: ${changes.join("; ")}` : "A and B are the same";
    find("command").textContent = chosenCommand();
    showRequired();
    if (!comparison) return;
    find("runs").hidden = find("results").hidden = false;
    markStale(isStale());
    showComparison(comparison);
    const listed = requirements().map(({metric}) => metric);
    runs.show([...listed, ...data.metrics.filter((metric) => !listed.includes(metric) && metric.isListed)], comparison.tracks);
    showVerdicts();
    showDots();
    const states = isStale() ? [BEFORE] : [stateInWords(), why, ...comparison.tracks.map(({checkInWords}) => checkInWords)];
    find("status").textContent = [...new Set(states)].filter(Boolean).join(" ");
}

// The grid: every number of UAVs with every number of pads, with the other settings of A.
function choicesOfGrid() {
    const [uavs, pads] = ["uavs", "pads"].map((key) => data.settings.findIndex((setting) => setting.key === key));
    const {positions, policy} = controlsA.choice;
    return data.grid.uavs.flatMap((uav) => data.grid.pads.map((pad) => {
        const moved = positions.map((position, n) => n === uavs ? uav : n === pads ? pad : position);
        return {place: root.querySelector(`[data-cell="${uav} ${pad}"]`), choice: {positions: moved, policy}};
    }));
}

// What the numbers of the grid depend on; not the bounds of the requirements.
const keyOfGrid = () => [
    ...choicesOfGrid().map(({choice}) => keyOf(choice)), prices.amounts, ...requirements().map(({metric}) => metric.key),
].join(" ");

// The search of which the grid is an exploration, where the command can require the metrics.
function sweepCommand() {
    const required = requirements(), axes = ["uavs", "pads"].map((key) =>
        `${key}=${data.grid[key].map((position) => data.settings.find((setting) => setting.key === key).texts[position]).join(",")}`);
    if (!required.every(({metric}) => metric.option)) return "";
    return commandLine("sweep", {
        policy: controlsA.choice.policy,
        set: [...valuesOf(data, controlsA.choice).filter((value) => !/^(uavs|pads)=/.test(value)), ...axes],
        require: required.map(({metric, bound}) => `${metric.option}=${bound}${metric.suffix}`),
        price: prices.options,
        scenario: data.scenario,
        seed: data.seed,
    });
}

function fill() {
    stop();
    tidy();
    if (keyOfGrid() !== gridKey) {
        const required = requirements(), choices = choicesOfGrid(), {rule} = data.grid;
        const error = rule.error / choices.length / (required.length + 1); // an interval of each, and of the cost
        const heads = find("grid").tHead.rows[0].cells;
        const cells = choices.map(({place, choice}) => {
            const name = `${heads[place.cellIndex].textContent}, ${place.parentElement.cells[0].textContent}`;
            return {name, place, track: new Track(pool.simulator, name, choice, prices.amounts, error), wanted: rule.first};
        });
        grid = new Grid(cells, required, metricOf("cost"), rule);
        gridKey = keyOfGrid();
    }
    grid.requirements = requirements();
    grid.resume();
    pool.begin(grid);
    show();
}

function showGrid() {
    const isRunning = pool.isDoing(grid), isNew = keyOfGrid() !== gridKey, isAsked = requirements().length > 0;
    find("fill").disabled = isRunning || !isAsked;
    find("fill-stop").disabled = !isRunning;
    find("fill-csv").disabled = grid === null || isNew;
    find("grid").classList.toggle("stale", grid !== null && isNew);
    find("grid-status").textContent = !isAsked ? "Choose what is required."
        : grid && isNew ? "The grid is of the settings before: press Fill the grid." : "";
    find("grid-bar").hidden = !isAsked || !grid || isNew;
    if (!isAsked || !grid || isNew) return;
    grid.requirements = requirements();
    gridCommand = sweepCommand();
    find("fill-command").textContent = gridCommand;
    find("grid-bar").value = grid.count / (grid.count + grid.missing) || 0;
    const open = isRunning ? "" : grid.openInWords();
    const sentences = [grid.inWords(), open, `${grouped(grid.count)} missions${isRunning ? ", running" : ""}.`];
    find("grid-status").textContent = sentences.filter(Boolean).join(" ");
    grid.show();
}

// Requirements that the reader has chosen: a metric, and a number for its bound.
/** @returns {Requirement[]} */
function requirements() {
    return required.flatMap(({metric, bound}) => {
        const chosen = metricOf(metric.value);
        if (!chosen || bound.value === "" || !Number.isFinite(Number(bound.value))) return [];
        return [{metric: chosen, bound: Number(bound.value) / (chosen.percent ? 100 : 1)}];
    });
}

function showRequired() {
    required.forEach(({line, metric, bound, slider}) => {
        const chosen = metricOf(metric.value);
        line.querySelector(".bound").hidden = !chosen;
        slider.hidden = !chosen?.percent;
        if (!chosen) return;
        line.querySelector(".sense").textContent = chosen.less ? "of at most" : "of at least";
        line.querySelector(".unit").textContent = chosen.percent ? "%" : chosen.unit;
        if (document.activeElement !== slider) slider.value = bound.value;
    });
}

// Whether A and B meet what is required.
function showVerdicts() {
    find("verdicts").replaceChildren(...requirements().map((requirement) => {
        const item = document.createElement("li");
        item.append(`${requirementInWords(requirement)}: `);
        comparison.tracks.forEach((track, n) => {
            const word = verdict(requirement, track.estimate(requirement.metric)), mark = document.createElement("strong");
            mark.className = word;
            mark.textContent = word;
            item.append(`${n ? ", " : ""}${NAMES[n]} `, mark);
        });
        return item;
    }));
}

function stateInWords() {
    const {count, seconds, target, tracks} = comparison;
    const whose = tracks.length > 1 ? "missions of A and of B" : "missions of A (B is the same)";
    if (!target) return `${grouped(count)} ${whose}, which were simulated before.`;
    const text = `${grouped(count)} of ${grouped(target)} ${whose}`;
    if (pool.isDoing(comparison)) return `${text}, running.`;
    if (!comparison.isComplete) return `${text}, stopped.`;
    return `${text}, in ${seconds.toFixed(1)} s.`;
}

const products = () => comparison.tracks.map((track) => track.products(comparison.count));

// The least and the largest product of both sides, in steps of 5 %.
function rangeOfDots() {
    const all = products().flat();
    const least = all.reduce((end, product) => Math.min(end, Math.floor(20 * product) / 20), 1);
    const most = all.reduce((end, product) => Math.max(end, Math.ceil(20 * product) / 20), 0);
    return least < most ? [least, most] : [0, 1];
}

// A dot per mission: the product of A along, of B upwards.
function showDots() {
    const canvas = find("dots"), context = canvas.getContext("2d");
    canvas.closest("figure").hidden = !comparison.difference;
    if (!comparison.difference) return;
    const side = canvas.width, [least, most] = rangeOfDots(), [a, b] = products();
    find("range").textContent = `${quantity(100 * least)} to ${quantity(100 * most)} %`;
    const scaled = (product) => (product - least) / (most - least);
    const style = getComputedStyle(root);
    context.clearRect(0, 0, side, side);
    context.strokeStyle = style.getPropertyValue("--line");
    context.beginPath();
    context.rect(0.5, 0.5, side - 1, side - 1);
    context.moveTo(0, side);
    context.lineTo(side, 0);
    context.stroke();
    context.fillStyle = style.getPropertyValue("--accent");
    context.globalAlpha = 0.4;
    a.forEach((product, row) => {
        context.beginPath();
        context.arc(side * scaled(product), side * (1 - scaled(b[row])), 3, 0, 7);
        context.fill();
    });
    context.globalAlpha = 1;
    context.fillStyle = style.getPropertyValue("--muted");
    context.font = "20px system-ui, sans-serif";
    context.textAlign = "right";
    context.fillText(EXPLORATION, side - 10, side - 12);
}

// The missions of the sides: a line for each, with the metrics that they have.
function rowsOfMissions() {
    const {tracks, count} = comparison, told = data.metrics.filter((metric) => tracks.some((track) => track.estimate(metric).count));
    const head = ["mission", ...tracks.flatMap((_, n) => told.map(({key}) => `${key}_${SIDES[n]}`))];
    const rows = Array.from({length: count}, (_, row) =>
        [row, ...tracks.flatMap(({values, width}) => told.map(({column}) => values[row * width + column]))]);
    return [head, ...rows];
}

/**
 * The mission of a dot, and how to see it.
 * @param {MouseEvent} event
 */
function pick(event) {
    const frame = find("dots").getBoundingClientRect(), [a, b] = products();
    const [least, most] = rangeOfDots(), scaled = (share) => least + share * (most - least);
    const x = scaled((event.clientX - frame.left) / frame.width), y = scaled(1 - (event.clientY - frame.top) / frame.height);
    const distances = a.map((product, row) => Math.hypot(product - x, b[row] - y));
    showMission(distances.indexOf(distances.reduce((least, distance) => Math.min(least, distance), Infinity)));
}

/**
 * The mission with the largest loss from A to B, with the median difference, or the worst of B.
 * @param {"loss" | "typical" | "worst"} kind
 */
function pickKind(kind) {
    const [a, b] = products(), value = (row) => b[row] - (kind === "worst" ? 0 : a[row]);
    const rows = [...a.keys()].sort((one, other) => value(one) - value(other));
    showMission(rows[kind === "typical" ? (rows.length - 1) >> 1 : 0]);
}

/** @param {number} row */
function showMission(row) {
    const {tracks} = comparison, [a, b] = products().map((side) => `${percent(side[row])} %`);
    find("mission").hidden = false;
    find("mission-text").textContent = `Mission ${row}: the product is ${a} in A and ${b} in B. `;
    playMissions(find("players"), Object.fromEntries(tracks.map(({choice}, n) =>
        [`panel-player-${SIDES[n]}`, {engine: engineOf(pool.simulator, choice), title: `Mission ${row} of ${NAMES[n]}`}])), row);
    find("mission-command").textContent = tracks.map(({choice}) => simulateCommand(data, choice, row)).join("\n");
}

// The state of the panel in the address, after #: text of strangers, of which only known names and
// values within their limits count. It starts nothing.
/** @type {any[]} */
const inputs = [...root.querySelectorAll("[name]:not([name^=slide])")];
const addressOf = () => `${location.href.split("#")[0]}#${new URLSearchParams(inputs.map(({name, value}) => [name, value]))}`;

// Whether the address has anything for the panel.
function readAddress() {
    const state = new URLSearchParams(location.hash.slice(1)), asked = inputs.filter(({name}) => state.has(name));
    for (const input of asked) {
        const text = state.get(input.name), isPosition = /^\d{1,2}$/.test(text) && Number(text) <= Number(input.max);
        const isAmount = /^\d{1,12}(\.\d{1,6})?$/.test(text), most = Number(input.max || Infinity);
        if (input.type === "range" && isPosition) input.value = text;
        if (input.type === "number" && isAmount) input.value = Math.min(Number(text), most);
        if (input.options && [...input.options].some(({value}) => value === text)) input.value = text;
    }
    return asked.length > 0;
}

async function copy(button, text) {
    const label = button.textContent;
    try {
        await navigator.clipboard.writeText(text);
        button.textContent = "Copied";
    } catch {
        find("command").textContent = text;
        button.textContent = "Select the text below";
    }
    setTimeout(() => { button.textContent = label; }, 1500);
}

// The intervals hold for any requirement, so that it may be changed without new missions.
/** @param {Event} event */
function require(event) {
    event.stopPropagation(); // no setting has changed
    const {metric, bound, slider} = required.find(({line}) => line.contains(event.target));
    if (event.target === slider) bound.value = slider.value;
    if (event.target === metric) bound.value = metricOf(metric.value)?.percent ? "90" : "";
    show();
}

// All settings become as they were when the page was opened.
function reset() {
    for (const input of root.querySelectorAll("fieldset [name]"))
        input.value = input.defaultValue ?? ([...input.options].find(({defaultSelected}) => defaultSelected) ?? input.options[0]).value;
    stop();
}

// At once: a reader may open the settings while the simulator is unpacked.
find("choices").open = !matchMedia(NARROW).matches;

openPanel((simulator) => {
    pool = new WorkerPool(simulator, (why) => why ? show(why) : schedule());
    runs = new Runs(simulator, choose);
    const isAsked = readAddress();
    document.querySelectorAll("[data-to=panel]").forEach((/** @type {any} */ link) => { link.hidden = false; });
    document.querySelectorAll("[data-replaced-by=panel]").forEach((element) => element.classList.add("replaced"));
    root.addEventListener("input", stop);
    required.forEach(({line}) => line.addEventListener("input", require));
    const actions = {
        reset, run: start, stop, dots: pick, fill, "fill-stop": stop,
        same: () => { controlsB.choice = controlsA.choice; stop(); },
        link: (event) => copy(event.target, addressOf()),
        copy: (event) => copy(event.target, chosenCommand()),
        csv: () => saveTable("exploration.csv", rowsOfMissions(), shownCommand),
        "fill-csv": () => saveTable("exploration-grid.csv", grid.rows(), gridCommand),
        picture: () => find("dots").toBlob((content) => save("exploration.png", content)),
        loss: () => pickKind("loss"), typical: () => pickKind("typical"), worst: () => pickKind("worst"),
    };
    for (const [name, act] of Object.entries(actions)) find(name)?.addEventListener("click", act);
    show();
    if (isAsked) root.scrollIntoView();
});
})();
