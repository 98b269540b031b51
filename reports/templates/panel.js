// The panel of a page: a baseline and a variation that its reader simulates and compares.
// What it shows is exploration; only known settings come from the address, and nothing is sent.

(() => {
"use strict";
/** @type {any} */
const root = document.getElementById("panel");
const data = JSON.parse(document.getElementById("panel-data").textContent);
const SIDES = ["a", "b"], NAMES = {a: "A", b: "B"};
const MOST_MISSIONS = 100_000; // of a run
const BEFORE = "The results below are of the settings before. Press Run for those of the new settings.";
const NARROW = "(max-width: 40rem)"; // where settings are folded at first

/** @type {(name: string) => any} */
const find = (name) => root.querySelector(`[data-panel="${name}"]`);
/** @type {(name: string) => any} */
const named = (name) => root.querySelector(`[name="${name}"]`);
const inputs = Object.fromEntries(SIDES.map((side) => [side, {
    sliders: data.settings.map(({key}) => named(`${side}-${key}`)),
    policy: named(`${side}-policy`),
}]));
const missions = named("missions");
const priceInputs = data.prices.map(({name}) => named(`price-${name}`));
// An empty price of a lost UAV is what the UAV was bought for, where the page has that.
const isAsBought = (/** @type {any} */ input) => input.value === "" && input.placeholder !== "";
const prices = () => priceInputs.map((input, n) => {
    if (isAsBought(input)) return NaN;
    const {least, most, isWhole} = data.prices[n], amount = Math.min(Math.max(Number(input.value) || 0, least), most);
    return isWhole ? Math.round(amount) : amount;
});
const required = [...root.querySelectorAll("[data-panel=requirement]")].map((line, n) =>
    ({line, metric: named(`require-${n}`), bound: named(`bound-${n}`), slider: named(`slide-${n}`)}));

/** @type {WebAssembly.Module} */
let module;
/** @type {Image} */
let image;
/** @type {Crew} */
let crew;
/** @type {Run | null} */
let run = null;
/** @type {Grid | null} */
let grid = null;

/**
 * What is chosen on a side.
 * @type {(side: string) => Choice}
 */
const choice = (side) => ({
    positions: inputs[side].sliders.map((input) => Number(input.value)),
    policy: inputs[side].policy.value,
});
/** @type {(choice: Choice) => Record<string, number>} */
const settingOf = ({positions}) => Object.fromEntries(data.settings.map(({key}, n) => [key, positions[n]]));
const isSame = () => keyOf(choice("a")) === keyOf(choice("b"));
const asked = () => Math.min(Math.max(Math.round(Number(missions.value)) || 0, 1), MOST_MISSIONS);
// What the results of a run depend on; not the number of missions, nor what is required.
const keyOfRun = () => [...SIDES.map((side) => keyOf(choice(side))), ...prices()].join(" ");
const isStale = () => run !== null && run.key !== keyOfRun();
/** @type {(chosen: Choice) => boolean} */
const isChecked = (chosen) => keyOf(chosen) === keyOf(data.check);

/**
 * The missions of a choice that are to come.
 * @type {(name: string, chosen: Choice, error?: number | null) => Track}
 */
function trackOf(name, chosen, error = null) {
    const paid = prices(), series = new Series(module, image, settingOf(chosen), paid, error);
    return new Track(series, {
        name, key: `${keyOf(chosen)} ${paid}`, setting: settingOf(chosen), policy: image.policies[chosen.policy], prices: paid,
    });
}

// The missions of A and B as the reader has chosen them, with those of the page's own baseline checked.
class Run extends Comparison {
    constructor() {
        const sides = isSame() ? ["a"] : SIDES;
        super(Object.fromEntries(sides.map((side) => [side, trackOf(side, choice(side))])), asked());
        /** @type {Record<string, Choice>} */
        this.choices = Object.fromEntries(sides.map((side) => [side, choice(side)]));
        this.key = keyOfRun();
        this.command = commandOf();
    }

    next() {
        const order = super.next();
        if (!order) return null;
        return {...order, wantsRecords: isChecked(this.choices[order.name]) && order.first < data.check.hashes.length};
    }

    /** @param {Answer} answer */
    take(answer) {
        if (answer.records) check(answer.first, answer.records);
        super.take(answer);
        schedule();
    }

    /**
     * The product of a mission.
     * @param {string} side
     * @param {number} row
     */
    product(side, row) {
        return this.valuesOf(side)[row * image.metrics.length + data.product];
    }
}

/**
 * Compare the first missions of the page's own baseline with what the page was made of.
 * @type {(first: number, records: Uint8Array[]) => void}
 */
function check(first, records) {
    records.forEach((record, row) => {
        const replication = first + row;
        if (replication >= data.check.hashes.length) return;
        if (sha256(record) === data.check.hashes[replication]) data.check.compared += 1;
        else data.check.differing = Math.min(data.check.differing ?? Infinity, replication);
    });
}

function tidy() {
    missions.value = asked();
    priceInputs.forEach((input, n) => { if (!isAsBought(input)) input.value = prices()[n]; });
}

function start() {
    stop();
    tidy();
    find("mission").hidden = true;
    data.check.compared = 0;
    data.check.differing = null;
    run = new Run();
    crew.begin(run);
    show();
}

function stop(why = "") {
    crew.end();
    show(why);
}

// What is shown.
let isScheduled = false;

function schedule() {
    if (isScheduled) return;
    isScheduled = true;
    setTimeout(() => { isScheduled = false; show(); }, 100);
}

function show(why = "") {
    const isRunning = run !== null && crew.job === run && !run.isOver;
    find("run").disabled = isRunning;
    find("stop").disabled = !isRunning;
    if (data.grid) showGrid();
    SIDES.forEach(showChoice);
    find("differing").textContent = choicesInWords();
    find("command").textContent = commandOf();
    showRequired();
    if (!run) return;
    find("results").hidden = false;
    find("results").classList.toggle("stale", isStale());
    find("before").hidden = !isStale();
    data.metrics.forEach(showMetric);
    showVerdicts();
    showDots();
    const states = isStale() ? [BEFORE] : [stateInWords(isRunning), why, checkInWords()];
    find("status").textContent = states.filter(Boolean).join(" ");
}

/** @param {string} side */
function showChoice(side) {
    const {positions} = choice(side);
    data.settings.forEach(({texts, unit}, n) => {
        const input = inputs[side].sliders[n], text = `${texts[positions[n]]} ${unit}`.trim();
        input.setAttribute("aria-valuetext", text);
        input.parentElement.querySelector("output").textContent = text;
        input.parentElement.classList.toggle("differs", positions[n] !== choice("a").positions[n]);
    });
}

// The grid: every number of UAVs with every number of pads, with the other settings of A.
/** @returns {[number, number, Choice][]} */
function choicesOfGrid() {
    const [uavs, pads] = ["uavs", "pads"].map((key) => data.settings.findIndex((setting) => setting.key === key));
    const {positions, policy} = choice("a");
    return data.grid.uavs.flatMap((uav) => data.grid.pads.map((pad) => {
        const moved = positions.map((position, n) => n === uavs ? uav : n === pads ? pad : position);
        return [uav, pad, {positions: moved, policy}];
    }));
}

// What the numbers of the grid depend on; not the bounds of the requirements.
const keyOfGrid = () => [
    ...choicesOfGrid().map(([, , chosen]) => keyOf(chosen)), prices(), ...requirements().map(({metric}) => metric.key),
].join(" ");

const askedOfGrid = () => Math.min(Math.max(Math.round(Number(named("grid-missions").value)) || 0, 1), MOST_MISSIONS);
let gridKey = "", gridCommand = "";

// The search of which the grid is an exploration, where the command can require the metrics.
function sweepCommand() {
    const required = requirements(), a = choice("a");
    if (!required.every(({metric}) => metric.option)) return "";
    const isAxis = ({key}) => key === "uavs" || key === "pads";
    const axes = data.settings.filter(isAxis).map(({key, texts}) => `--set ${key}=${data.grid[key].map((position) => texts[position]).join(",")}`);
    const isLeftOut = (setting, n) => isAxis(setting) || a.positions[n] === setting.default;
    return ["dess sweep", `--policy ${quoted(a.policy)}`, ...data.fixed.map((setting) => `--set ${quoted(setting)}`),
        ...optionsOf(data, a, "--set", isLeftOut), ...axes,
        ...required.map(({metric, bound}) => `--require ${quoted(`${metric.option}=${bound}${metric.suffix}`)}`),
        ...data.prices.flatMap(({name}, n) => isAsBought(priceInputs[n]) ? [] : [`--price ${quoted(`${name}=${prices()[n]}`)}`]),
        ...data.priced.map((price) => `--price ${quoted(price)}`),
        `--scenario ${quoted(data.scenario)}`, `--seed ${data.seed}`].join(" ");
}

function fill() {
    stop();
    tidy();
    named("grid-missions").value = askedOfGrid();
    const required = requirements(), choices = choicesOfGrid();
    if (!required.length) return;
    if (keyOfGrid() !== gridKey) {
        const error = GRID_ERROR / choices.length / required.length;
        const counted = (key, position, noun) => {
            const {texts, place} = data.settings.find((setting) => setting.key === key);
            return `${texts[position]} ${noun}${texts[position] === "1" ? "" : "s"}${place}`;
        };
        const cells = choices.map(([uavs, pads, chosen]) => {
            const name = `${counted("uavs", uavs, "UAV")}, ${counted("pads", pads, "pad")}`;
            return {uavs, pads, name, track: trackOf(`${uavs} ${pads}`, chosen, error)};
        });
        grid = new Grid(cells, required, data.metrics.find(({key}) => key === "cost"), data.indifference, data.rule);
        gridKey = keyOfGrid();
    }
    grid.extend(Math.min(grid.count + askedOfGrid(), MOST_MISSIONS));
    crew.begin({
        get isOver() { return grid.isOver; },
        set isOver(isOver) { grid.isOver = isOver; },
        next: () => grid.next(),
        take: (answer) => { grid.take(answer); schedule(); },
    });
    show();
}

function showGrid() {
    const isRunning = grid !== null && crew.job !== run && !grid.isOver, isNew = keyOfGrid() !== gridKey;
    find("fill").disabled = isRunning || !requirements().length;
    find("fill-stop").disabled = !isRunning;
    find("fill-csv").disabled = grid === null || isNew;
    find("grid").classList.toggle("stale", grid !== null && isNew);
    if (!requirements().length) find("grid-status").textContent = "Choose what is required.";
    else if (grid && isNew) find("grid-status").textContent = "The grid is of the settings before: press Fill the grid.";
    else if (grid) {
        grid.requirements = requirements();
        gridCommand = sweepCommand();
        find("fill-command").textContent = gridCommand;
        if (isRunning) crew.wake(); // a bound that has moved may have opened a cell
        find("grid-status").textContent = `${grid.inWords()} ${grouped(grid.count)} missions${isRunning ? ", running" : ""}.`;
        grid.show(find("grid"));
    } else find("grid-status").textContent = "";
}

// By what A and B differ, for readers of a narrow screen, on which the settings are folded.
function choicesInWords() {
    const [a, b] = SIDES.map(choice);
    const parts = data.settings.flatMap(({name, texts}, n) =>
        a.positions[n] === b.positions[n] ? [] : [`${name} ${texts[a.positions[n]]} → ${texts[b.positions[n]]}`]);
    if (a.policy !== b.policy) parts.unshift(`${a.policy} → ${b.policy}`);
    return parts.length ? `A → B: ${parts.join("; ")}` : "A and B are the same";
}

// Requirements that the reader has chosen: a metric, and a number for its bound.
/** @returns {Requirement[]} */
function requirements() {
    return required.flatMap(({metric, bound}) => {
        const chosen = data.metrics.find(({key}) => key === metric.value);
        if (!chosen || bound.value === "" || !Number.isFinite(Number(bound.value))) return [];
        return [{metric: chosen, bound: Number(bound.value) / (chosen.percent ? 100 : 1)}];
    });
}

function showRequired() {
    required.forEach(({line, metric, bound, slider}) => {
        const chosen = data.metrics.find(({key}) => key === metric.value);
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
        run.sides.forEach((side, n) => {
            const word = verdict(data.rule, requirement, run.tracks[side].series.estimate(requirement.metric));
            const mark = document.createElement("strong");
            mark.className = word;
            mark.textContent = word;
            item.append(`${n ? ", " : ""}${NAMES[side]} `, mark);
        });
        return item;
    }));
}

/** @param {boolean} isRunning */
function stateInWords(isRunning) {
    const least = Math.min(...run.sides.map((side) => run.count(side)));
    const whose = run.sides.length > 1 ? "missions of A and of B" : "missions of A (B is the same)";
    const text = `${grouped(least)} of ${grouped(run.target)} ${whose}`;
    if (isRunning) return `${text}, running.`;
    return run.seconds ? `${text}, in ${run.seconds.toFixed(1)} s.` : `${text}, stopped.`;
}

function checkInWords() {
    const {compared, differing, hashes} = data.check;
    if (differing !== null && differing !== undefined)
        return `Mission ${differing} of the page's baseline differs from the one that Python simulates.`;
    if (!compared || compared < Math.min(hashes.length, run.target)) return "";
    return `The first ${compared} missions of the page's baseline are the same as those of Python, bit for bit.`;
}

/** @param {Metric} metric */
function showMetric(metric) {
    const row = root.querySelector(`tr[data-metric="${metric.column}"]`);
    const cells = [...row.querySelectorAll("td")];
    const texts = run.inWords(metric);
    row.hidden = texts === null;
    texts?.forEach((text, n) => { cells[n].textContent = text; });
}

// The least and the largest product of both sides, in steps of 5 %.
function rangeOfDots() {
    const ends = [1, 0];
    for (const side of SIDES)
        for (let row = 0; row < run.difference.count; row++) {
            ends[0] = Math.min(ends[0], Math.floor(20 * run.product(side, row)) / 20);
            ends[1] = Math.max(ends[1], Math.ceil(20 * run.product(side, row)) / 20);
        }
    return ends[0] < ends[1] ? ends : [0, 1];
}

// A dot per mission: the product of A along, of B upwards.
function showDots() {
    const canvas = find("dots"), context = canvas.getContext("2d");
    const figure = canvas.closest("figure");
    figure.hidden = !run.difference;
    if (figure.hidden) return;
    const side = canvas.width, [least, most] = rangeOfDots();
    find("range").textContent = `${quantity(100 * least)} to ${quantity(100 * most)} %`;
    const place = (name, row) => (run.product(name, row) - least) / (most - least);
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
    for (let row = 0; row < run.difference.count; row++) {
        context.beginPath();
        context.arc(side * place("a", row), side * (1 - place("b", row)), 3, 0, 7);
        context.fill();
    }
    context.globalAlpha = 1;
    context.fillStyle = style.getPropertyValue("--muted");
    context.font = "20px system-ui, sans-serif";
    context.textAlign = "right";
    context.fillText(EXPLORATION, side - 10, side - 12);
}

// The missions of the sides: a line for each, with the metrics that they have.
function rowsOfMissions() {
    const told = data.metrics.filter((metric) => run.sides.some((side) => run.tracks[side].series.estimate(metric).count));
    const width = image.metrics.length, count = Math.min(...run.sides.map((side) => run.count(side)));
    const head = ["mission", ...run.sides.flatMap((side) => told.map(({key}) => `${key}_${side}`))];
    const rows = Array.from({length: count}, (_, row) =>
        [row, ...run.sides.flatMap((side) => told.map(({column}) => run.valuesOf(side)[row * width + column]))]);
    return [head, ...rows];
}

/**
 * The mission of a dot, and how to see it.
 * @param {MouseEvent} event
 */
function pick(event) {
    const frame = find("dots").getBoundingClientRect();
    const [least, most] = rangeOfDots(), scaled = (share) => least + share * (most - least);
    const x = scaled((event.clientX - frame.left) / frame.width), y = scaled(1 - (event.clientY - frame.top) / frame.height);
    let nearest = 0, shortest = Infinity;
    for (let row = 0; row < run.difference.count; row++) {
        const distance = Math.hypot(run.product("a", row) - x, run.product("b", row) - y);
        if (distance < shortest) [nearest, shortest] = [row, distance];
    }
    showMission(nearest);
}

/**
 * The mission with the largest loss from A to B, with the median difference, or the worst of B.
 * @param {"loss" | "typical" | "worst"} kind
 */
function pickKind(kind) {
    const value = (row) => run.product("b", row) - (kind === "worst" ? 0 : run.product("a", row));
    const rows = Array.from({length: run.difference.count}, (_, row) => row).sort((one, other) => value(one) - value(other));
    showMission(rows[kind === "typical" ? (rows.length - 1) >> 1 : 0]);
}

/** @param {number} row */
function showMission(row) {
    const [a, b] = SIDES.map((side) => `${minus(tenths(100 * run.product(side, row)))} %`);
    find("mission").hidden = false;
    find("mission-text").textContent = `Mission ${row}: the product is ${a} in A and ${b} in B. `;
    find("players").replaceChildren(...SIDES.map((side) => playerOf(side)));
    for (const side of SIDES) {
        const chosen = run.choices[side], engine = new Engine(module, image, settingOf(chosen));
        engine.follow(image.policies[chosen.policy]);
        playMission(`panel-player-${side}`, [replay(engine, row, data.sea, `Mission ${row} of ${NAMES[side]}`)]);
    }
    find("mission-command").textContent = SIDES.map((side) => simulateCommand(data, run.choices[side], row)).join("\n");
}

// A player without a mission.
function playerOf(side) {
    const figure = document.createElement("figure");
    figure.className = "player";
    figure.id = `panel-player-${side}`;
    figure.append(/** @type {any} */ (document.getElementById("panel-player")).content.cloneNode(true));
    return figure;
}

// The study of what is chosen: both settings with both policies.
function commandOf() {
    const [a, b] = SIDES.map(choice), policies = [...new Set([a.policy, b.policy])].join(",");
    const common = [`--policy ${quoted(policies)}`, `--scenario ${quoted(data.scenario)}`,
        `--seed ${data.seed}`, `--missions ${Math.max(asked(), 2)}`];
    const isEqual = (_, n) => a.positions[n] === b.positions[n];
    if (data.settings.every(isEqual)) return ["dess sweep", ...allOptionsOf(data, a, "--set"), ...common].join(" ");
    return ["dess what-if", ...allOptionsOf(data, a, "--baseline"), ...optionsOf(data, b, "--set", isEqual), ...common].join(" ");
}

// The state of the panel in the address, after #: text of strangers, of which only known names and
// positions within their limits count. It starts nothing.
function addressOf() {
    const state = new URLSearchParams();
    for (const side of SIDES) {
        const {positions, policy} = choice(side);
        data.settings.forEach(({key}, n) => state.set(`${side}-${key}`, String(positions[n])));
        state.set(`${side}-policy`, policy);
    }
    data.prices.forEach(({name}, n) => { if (!isAsBought(priceInputs[n])) state.set(`price-${name}`, String(prices()[n])); });
    required.forEach(({metric, bound}, n) => {
        state.set(`require-${n}`, metric.value);
        if (metric.value) state.set(`bound-${n}`, bound.value);
    });
    state.set("missions", String(asked()));
    return `${location.href.split("#")[0]}#${state}`;
}

const isAmount = (/** @type {string | null} */ text) => /^\d{1,12}(\.\d{1,6})?$/.test(text ?? "");

function readAddress() {
    const state = new URLSearchParams(location.hash.slice(1));
    for (const side of SIDES) {
        data.settings.forEach(({key, texts}, n) => {
            const position = state.get(`${side}-${key}`);
            if (/^\d{1,2}$/.test(position ?? "") && Number(position) < texts.length) inputs[side].sliders[n].value = position;
        });
        const policy = state.get(`${side}-policy`);
        if (data.policies.includes(policy)) inputs[side].policy.value = policy;
    }
    data.prices.forEach(({name}, n) => {
        const price = state.get(`price-${name}`);
        if (isAmount(price)) priceInputs[n].value = Number(price);
    });
    required.forEach(({metric, bound}, n) => {
        const key = state.get(`require-${n}`), amount = state.get(`bound-${n}`);
        if (key === "" || data.metrics.some((offered) => offered.isOffered && offered.key === key)) metric.value = key;
        if (isAmount(amount)) bound.value = Number(amount);
    });
    if (/^\d{1,6}$/.test(state.get("missions") ?? "")) missions.value = Math.min(Number(state.get("missions")), MOST_MISSIONS);
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

function change() {
    if (crew.job) stop();
    else show();
}

// The intervals hold for any requirement, so that it may be changed without new missions.
/** @param {Event} event */
function require(event) {
    event.stopPropagation(); // no setting has changed
    const {metric, bound, slider} = required.find(({line}) => line.contains(event.target));
    if (event.target === slider) bound.value = slider.value;
    if (event.target === metric) bound.value = data.metrics.find(({key}) => key === metric.value)?.percent ? "90" : "";
    show();
}

// B becomes as A is.
function copyAToB() {
    inputs.b.policy.value = inputs.a.policy.value;
    inputs.a.sliders.forEach((input, n) => { inputs.b.sliders[n].value = input.value; });
    change();
}

// All settings become as they were when the page was opened.
function reset() {
    for (const input of root.querySelectorAll("fieldset input")) input.value = input.defaultValue;
    for (const select of root.querySelectorAll("fieldset select"))
        select.value = [...select.options].find((option) => option.defaultSelected)?.value ?? select.options[0].value;
    change();
}

async function open() {
    checkBrowser();
    ({module, image} = await unpackEngine("panel"));
    crew = new Crew(document.getElementById("panel-worker").textContent, {module, image}, stop);
    const isAsked = [...new URLSearchParams(location.hash.slice(1)).keys()].some((name) => named(name));
    readAddress();
    root.hidden = false;
    find("choices").open = !matchMedia(NARROW).matches;
    document.querySelectorAll("[data-to=panel]").forEach((/** @type {any} */ link) => { link.hidden = false; });
    document.querySelectorAll("[data-replaced-by=panel]").forEach((element) => element.classList.add("replaced"));
    root.querySelectorAll("fieldset").forEach((fieldset) => { fieldset.disabled = false; });
    root.addEventListener("input", change);
    required.forEach(({line}) => line.addEventListener("input", require));
    if (data.grid) {
        find("fill").addEventListener("click", fill);
        find("fill-csv").addEventListener("click", () => save("exploration-grid.csv",
            new Blob([csvOf(grid.rows(), gridCommand)], {type: "text/csv"})));
        find("fill-stop").addEventListener("click", () => stop());
        named("grid-missions").addEventListener("input", (event) => event.stopPropagation());
    }
    find("same").addEventListener("click", copyAToB);
    find("reset").addEventListener("click", reset);
    find("run").addEventListener("click", start);
    find("stop").addEventListener("click", () => stop());
    find("link").addEventListener("click", (event) => copy(event.target, addressOf()));
    find("copy").addEventListener("click", (event) => copy(event.target, commandOf()));
    find("dots").addEventListener("click", pick);
    find("csv").addEventListener("click", () => save("exploration.csv",
        new Blob([csvOf(rowsOfMissions(), run.command)], {type: "text/csv"})));
    find("picture").addEventListener("click", () => find("dots").toBlob((content) => save("exploration.png", content)));
    for (const kind of /** @type {const} */ (["typical", "loss", "worst"])) find(kind).addEventListener("click", () => pickKind(kind));
    show();
    if (isAsked) root.scrollIntoView();
    root.dataset.ready = "yes";
}

open().catch((error) => sayWhyNot(root, error));
})();
