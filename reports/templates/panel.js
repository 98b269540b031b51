// The panel of a page: a baseline and a variation that its reader simulates and compares.
// What it shows is exploration; only known settings come from the address, and nothing is sent.
(() => {
"use strict";
const root = document.getElementById("panel");
const data = JSON.parse(document.getElementById("panel-data").textContent);
const SIDES = ["a", "b"], NAMES = {a: "A", b: "B"};
const MOST_MISSIONS = 100_000; // of a run
const PORTION = 120; // the time that a portion of missions should take [ms]
const SUMMED = ["values", "baseline", "totals", "sequences", "ends"]; // what a series needs
const BOUNDS = 3; // numbers of a metric in the array of that name
const find = (name) => root.querySelector(`[data-panel="${name}"]`);
const inputs = Object.fromEntries(SIDES.map((side) => [side, {
    sliders: data.settings.map(({key}) => root.querySelector(`[name="${side}-${key}"]`)),
    policy: root.querySelector(`[name="${side}-policy"]`),
}]));
const missions = root.querySelector("[name=missions]");
const priceInputs = data.prices.map(({name}) => root.querySelector(`[name="price-${name}"]`));
const prices = () => priceInputs.map((input) => Math.min(Math.max(Number(input.value) || 0, 0), 1e12));

// Numbers, written as everywhere on the page.
const minus = (text) => (Number(text.replaceAll(",", "")) ? text.replace("-", "−") : text.replace("-", ""));
const grouped = (number, digits = 0) => number.toLocaleString("en-US", {minimumFractionDigits: digits, maximumFractionDigits: digits});

// One decimal; a number in the middle of two becomes the even one, as in Python.
function tenths(number) {
    const isTie = Number.isInteger(number * 4) && !Number.isInteger(number * 2);
    if (!isTie) return number.toFixed(1);
    const below = Math.floor(number * 10);
    return ((below % 2 ? below + 1 : below) / 10).toFixed(1);
}

function quantity(number) {
    if (Math.abs(number) < 1e-12) return "0";
    if (Math.abs(number) >= 1000) return minus(grouped(number));
    return minus(String(Number(number.toPrecision(4))));
}

function written({percent, unit}, number) {
    if (percent) return `${minus(tenths(100 * number))} %`;
    return `${quantity(number)} ${unit}`.trim();
}

function interval(metric, {mean, low, high}) {
    const end = (number) => metric.percent ? minus(tenths(100 * number)) : quantity(number);
    const ends = [low, high].map((number) => Number.isFinite(number) ? end(number) : "?");
    return `${written(metric, mean)} [${ends.join(", ")}]`;
}

function difference(metric, {mean, low, high}) {
    const scale = metric.percent ? 100 : 1;
    const write = (number) => {
        if (!Number.isFinite(number)) return "?";
        const text = metric.percent ? minus(tenths(scale * number)) : quantity(number);
        return number > 0 && Number(text) !== 0 ? `+${text}` : text;
    };
    return `${write(mean)} [${write(low)}, ${write(high)}]`;
}

// What is chosen on a side.
const choice = (side) => ({
    positions: inputs[side].sliders.map((input) => Number(input.value)),
    policy: inputs[side].policy.value,
});
const keyOf = ({positions, policy}) => [policy, ...positions].join(" ");
const settingOf = ({positions}) => Object.fromEntries(data.settings.map(({key}, n) => [key, positions[n]]));
const rowsOf = (name) => image.arrays.find((array) => array.name === name).shape[0];
const isSame = () => keyOf(choice("a")) === keyOf(choice("b"));
const asked = () => Math.min(Math.max(Math.round(Number(missions.value)) || 0, 1), MOST_MISSIONS);

// The missions that have come, in the order of their replications.
let module, image, workers = [], run = null;

// Sums and intervals of a series of missions, or of the differences of two, computed by the module.
class Series {
    constructor(setting) {
        const arrays = image.arrays.map((array) =>
            array.bytes || SUMMED.includes(array.name) ? array : {...array, shape: array.shape.map(() => 0)});
        this.engine = new Engine(module, {...image, arrays, isBare: true}, setting);
        this.count = 0;
        this.engine.exports.begin(0);
    }

    // The differences of two series have values between the bounds of both.
    static ofDifferences(before, after) {
        const series = new Series({}), bounds = series.engine.floats("bounds");
        const [ours, theirs] = [before, after].map(({engine}) => engine.floats("bounds"));
        for (let metric = 0; metric < bounds.length; metric += BOUNDS) {
            bounds[metric] = Math.min(ours[metric], theirs[metric]);
            bounds[metric + 1] = Math.max(ours[metric + 1], theirs[metric + 1]);
        }
        series.engine.exports.begin(1);
        return series;
    }

    // Add the values of missions; less those of the same missions of a baseline, if there is one.
    add(values, baseline = null) {
        const width = image.metrics.length, most = rowsOf("values") * width;
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

    estimate({column}) {
        const [totals, ends] = [this.engine.floats("totals"), this.engine.floats("ends")];
        const width = totals.length / image.metrics.length;
        const [count, sum] = totals.slice(column * width);
        return {mean: sum / count, low: ends[2 * column], high: ends[2 * column + 1], count};
    }
}

function start() {
    stop();
    missions.value = asked();
    priceInputs.forEach((input, n) => { input.value = prices()[n]; });
    find("mission").hidden = true;
    find("results").classList.remove("stale");
    const sides = isSame() ? ["a"] : SIDES;
    run = {
        number: (run?.number ?? 0) + 1,
        sides,
        target: asked(),
        prices: prices(),
        isOver: false,
        choices: Object.fromEntries(sides.map((side) => [side, choice(side)])),
        asked: Object.fromEntries(sides.map((side) => [side, 0])),
        took: Object.fromEntries(sides.map((side) => [side, 0])), // by a mission [ms]
        waiting: Object.fromEntries(sides.map((side) => [side, new Map()])),
        values: Object.fromEntries(sides.map((side) => [side, []])),
        series: Object.fromEntries(sides.map((side) => [side, new Series(settingOf(choice(side)))])),
        began: performance.now(),
    };
    if (sides.length > 1) run.difference = Series.ofDifferences(run.series.a, run.series.b);
    data.check.compared = 0;
    data.check.differing = null;
    startWorkers();
    workers.forEach(give);
    show();
}

function stop(why = "") {
    if (run) run.isOver = true;
    workers.filter(({busy}) => busy).forEach(({worker}) => worker.terminate());
    workers = workers.filter(({busy}) => !busy);
    show(why);
}

function startWorkers() {
    const most = Math.min(Math.max((navigator.hardwareConcurrency || 2) - 1, 1), 8);
    while (workers.length < most) {
        const source = document.getElementById("panel-worker").textContent;
        const address = URL.createObjectURL(new Blob([source], {type: "text/javascript"}));
        const member = {worker: new Worker(address), busy: false};
        URL.revokeObjectURL(address);
        member.worker.onmessage = (event) => take(member, event.data);
        member.worker.onerror = (event) => {
            event.preventDefault();
            stop(`The browser ended the simulation (${event.message || "a worker died"}); what is shown is of the missions before.`);
        };
        member.worker.postMessage({module, image});
        workers.push(member);
    }
}

// Give a worker the next portion of missions: of the side of which fewer have been given out.
function give(member) {
    if (!run || run.isOver) return;
    const open = run.sides.filter((side) => run.asked[side] < run.target);
    if (!open.length) return;
    const side = open.reduce((least, other) => run.asked[other] < run.asked[least] ? other : least);
    const fit = run.took[side] ? Math.floor(PORTION / run.took[side]) : 1;
    const count = Math.min(Math.max(fit, 1), rowsOf("values"), run.target - run.asked[side]);
    const chosen = run.choices[side], first = run.asked[side];
    run.asked[side] += count;
    member.busy = true;
    member.worker.postMessage({
        side, first, count, run: run.number, key: `${keyOf(chosen)} ${run.prices}`, setting: settingOf(chosen),
        policy: image.policies[chosen.policy], prices: run.prices,
        wantsRecords: isChecked(chosen) && first < data.check.hashes.length,
    });
}

const isChecked = (chosen) => keyOf(chosen) === keyOf(data.check);

function take(member, portion) {
    member.busy = false;
    if (!run || portion.run !== run.number || run.isOver) return;
    const {side, first, count, values, records, took} = portion;
    run.took[side] = took / count;
    run.waiting[side].set(first, values);
    if (records) check(first, records);
    let before = run.series[side].count;
    while (run.waiting[side].has(before)) { // only the unbroken beginning counts
        const rows = run.waiting[side].get(before);
        run.waiting[side].delete(before);
        run.values[side].push(rows);
        run.series[side].add(rows);
        before = run.series[side].count;
    }
    addDifferences();
    run.isOver = run.sides.every((name) => run.series[name].count >= run.target);
    if (run.isOver) run.seconds = (performance.now() - run.began) / 1000;
    give(member);
    schedule();
}

// The differences B - A of the missions that both sides have.
function addDifferences() {
    if (!run.difference) return;
    const width = image.metrics.length;
    for (const side of SIDES) run.values[side] = [joined(run.values[side])];
    const [a, b] = SIDES.map((side) => run.values[side][0]), from = run.difference.count * width;
    const end = Math.min(a.length, b.length);
    if (end > from) run.difference.add(b.subarray(from, end), a.subarray(from, end));
}

function joined(parts) {
    if (parts.length === 1) return parts[0];
    const whole = new Float64Array(parts.reduce((sum, part) => sum + part.length, 0));
    parts.reduce((end, part) => (whole.set(part, end), end + part.length), 0);
    return whole;
}

// Compare the first missions of the page's own baseline with what the page was made of.
function check(first, records) {
    records.forEach((record, row) => {
        const replication = first + row;
        if (replication >= data.check.hashes.length) return;
        if (sha256(record) === data.check.hashes[replication]) data.check.compared += 1;
        else data.check.differing = Math.min(data.check.differing ?? Infinity, replication);
    });
}

// What is shown.
let isScheduled = false;

function schedule() {
    if (isScheduled) return;
    isScheduled = true;
    setTimeout(() => { isScheduled = false; show(); }, 100);
}

function show(why = "") {
    const isRunning = Boolean(run) && !run.isOver;
    find("run").disabled = isRunning;
    find("stop").disabled = !isRunning;
    SIDES.forEach(showChoice);
    find("command").textContent = commandOf();
    if (!run) return;
    find("results").hidden = false;
    data.metrics.forEach(showMetric);
    showDots();
    find("status").textContent = [stateInWords(isRunning), why, checkInWords()].filter(Boolean).join(" ");
}

function showChoice(side) {
    const {positions} = choice(side);
    data.settings.forEach(({texts, unit}, n) => {
        const input = inputs[side].sliders[n], text = `${texts[positions[n]]} ${unit}`.trim();
        input.setAttribute("aria-valuetext", text);
        input.parentElement.querySelector("output").textContent = text;
        input.parentElement.classList.toggle("differs", positions[n] !== choice("a").positions[n]);
    });
}

function stateInWords(isRunning) {
    const counts = run.sides.map((side) => run.series[side].count), least = Math.min(...counts);
    const of = run.sides.length > 1 ? "missions of A and of B" : "missions of A (B is the same)";
    const text = `${grouped(least)} of ${grouped(run.target)} ${of}`;
    if (isRunning) return `${text}, running.`;
    return run.seconds ? `${text}, in ${run.seconds.toFixed(1)} s.` : `${text}, stopped.`;
}

function checkInWords() {
    const {compared, differing, hashes} = data.check;
    if (differing !== null && differing !== undefined)
        return `Mission ${differing} of the page's baseline differs from the one that Python simulates.`;
    if (!compared) return "";
    if (compared < Math.min(hashes.length, run.target)) return "";
    return `The first ${compared} missions of the page's baseline are the same as those of Python, bit for bit.`;
}

function showMetric(metric) {
    const row = root.querySelector(`[data-metric="${metric.column}"]`);
    const cells = [...row.querySelectorAll("td")];
    const estimates = run.sides.map((side) => run.series[side].estimate(metric));
    row.hidden = !estimates.some(({count}) => count);
    estimates.forEach((estimate, n) => { cells[n].textContent = estimate.count ? interval(metric, estimate) : ""; });
    if (!run.difference) {
        cells[1].textContent = "the same as A";
        cells[2].textContent = cells[3].textContent = "";
        return;
    }
    const gap = run.difference.estimate(metric);
    cells[2].textContent = gap.count ? difference(metric, gap) : "";
    cells[3].textContent = gap.count ? verdict(metric, gap) : "";
}

function verdict(metric, {mean, low, high, count}) {
    if (low > 0 || high < 0) {
        const isBetter = metric.less ? high < 0 : low > 0;
        return `decided: B is ${low > 0 ? "higher" : "lower"}, which is ${isBetter ? "better" : "worse"}`;
    }
    if (!Number.isFinite(high - low)) return "not decided";
    if (low === high) return "no difference seen";
    if (!mean) return `no difference seen; at most ${difference(metric, {mean: high, low, high}).split(" ")[0].slice(1)}`;
    // An interval becomes narrower with about the root of the number of missions.
    const needed = count * ((high - low) / 2 / Math.abs(mean)) ** 2 - count;
    return `not decided${needed > 0 && needed < 1e6 ? `, about ${quantity(Number(needed.toPrecision(1)))} more missions` : ""}`;
}

// The least and the largest product of both sides, in steps of 5 %.
function rangeOfDots() {
    const width = image.metrics.length, ends = [1, 0];
    for (const side of SIDES)
        for (let row = 0; row < run.difference.count; row++) {
            const product = run.values[side][0][row * width + data.product];
            ends[0] = Math.min(ends[0], Math.floor(20 * product) / 20);
            ends[1] = Math.max(ends[1], Math.ceil(20 * product) / 20);
        }
    return ends[0] < ends[1] ? ends : [0, 1];
}

// A dot per mission: the product of A along, of B upwards.
function showDots() {
    const canvas = find("dots"), context = canvas.getContext("2d");
    const figure = canvas.closest("figure");
    figure.hidden = !run.difference;
    if (figure.hidden) return;
    const width = image.metrics.length, side = canvas.width, [least, most] = rangeOfDots();
    find("range").textContent = `${quantity(100 * least)} to ${quantity(100 * most)} %`;
    const place = (name, row) => (run.values[name][0][row * width + data.product] - least) / (most - least);
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
}

// The mission of a dot, and how to see it.
function pick(event) {
    const canvas = find("dots"), frame = canvas.getBoundingClientRect();
    const width = image.metrics.length, [a, b] = SIDES.map((name) => run.values[name][0]);
    const [least, most] = rangeOfDots(), scaled = (share) => least + share * (most - least);
    const x = scaled((event.clientX - frame.left) / frame.width), y = scaled(1 - (event.clientY - frame.top) / frame.height);
    let nearest = 0, shortest = Infinity;
    for (let row = 0; row < run.difference.count; row++) {
        const distance = Math.hypot(a[row * width + data.product] - x, b[row * width + data.product] - y);
        if (distance < shortest) [nearest, shortest] = [row, distance];
    }
    showMission(nearest);
}

// The mission with the largest loss from A to B, and the worst of each side.
function pickWorst(kind) {
    const width = image.metrics.length, [a, b] = SIDES.map((name) => run.values[name][0]);
    const value = (row) => b[row * width + data.product] - (kind === "loss" ? a[row * width + data.product] : 0);
    let worst = 0;
    for (let row = 1; row < run.difference.count; row++) if (value(row) < value(worst)) worst = row;
    showMission(worst);
}

function showMission(row) {
    const width = image.metrics.length, at = row * width + data.product;
    const [a, b] = SIDES.map((side) => `${minus(tenths(100 * run.values[side][0][at]))} %`);
    find("mission").hidden = false;
    find("mission-text").textContent = `Mission ${row}: the product is ${a} in A and ${b} in B. `;
    find("players").replaceChildren(...SIDES.map((side) => playerOf(side)));
    for (const side of SIDES) {
        const chosen = run.choices[side], engine = new Engine(module, image, settingOf(chosen));
        engine.follow(image.policies[chosen.policy]);
        playMission(`panel-player-${side}`, [replay(engine, row, data.sea, `Mission ${row} of ${NAMES[side]}`)]);
    }
    find("mission-command").textContent = SIDES.map((side) => simulateCommand(side, row)).join("\n");
}

// A player without a mission.
function playerOf(side) {
    const figure = document.createElement("figure");
    figure.className = "player";
    figure.id = `panel-player-${side}`;
    figure.append(document.getElementById("panel-player").content.cloneNode(true));
    return figure;
}

// Commands are made of the page's own names and numbers, and quoted for the shell.
const quoted = (text) => /^[\w.=,-]+$/.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`;
const isOfScenario = ({positions}) => ({default: position}, n) => positions[n] === position;
const optionsOf = ({positions}, option, isLeftOut) => data.settings.flatMap((setting, n) =>
    isLeftOut(setting, n) ? [] : [`${option} ${quoted(setting.options[positions[n]])}`]);
const allOptionsOf = (chosen, option) =>
    [...data.fixed.map((setting) => `${option} ${quoted(setting)}`), ...optionsOf(chosen, option, isOfScenario(chosen))];

function simulateCommand(side, replication) {
    const chosen = run.choices[side];
    return ["dess simulate", `--policy ${quoted(chosen.policy)}`, `--scenario ${quoted(data.scenario)}`,
        ...allOptionsOf(chosen, "--set"), `--seed ${data.seed}`, `--replication ${replication}`].join(" ");
}

function commandOf() {
    const [a, b] = SIDES.map(choice), count = Math.max(asked(), 2);
    const common = [`--scenario ${quoted(data.scenario)}`, `--seed ${data.seed}`, `--missions ${count}`];
    const isEqual = (_, n) => a.positions[n] === b.positions[n], areEqual = data.settings.every(isEqual);
    if (a.policy === b.policy && !areEqual)
        return ["dess what-if", `--policy ${quoted(a.policy)}`, ...allOptionsOf(a, "--baseline"),
            ...optionsOf(b, "--set", isEqual), ...common].join(" ");
    const evaluate = (chosen, policies) => ["dess evaluate", ...policies.map((policy) => `--policy ${quoted(policy)}`),
        ...allOptionsOf(chosen, "--set"), ...common].join(" ");
    if (areEqual) return evaluate(a, [...new Set([a.policy, b.policy])]);
    return [a, b].map((chosen) => evaluate(chosen, [chosen.policy])).join("\n");
}

// The state of the panel in the address, after #: text of strangers, of which only known names and
// positions within their limits count. It starts nothing.
function addressOf() {
    const state = new URLSearchParams();
    for (const side of SIDES) {
        const {positions, policy} = choice(side);
        data.settings.forEach(({key}, n) => state.set(`${side}-${key}`, positions[n]));
        state.set(`${side}-policy`, policy);
    }
    data.prices.forEach(({name}, n) => state.set(`price-${name}`, prices()[n]));
    state.set("missions", asked());
    return `${location.href.split("#")[0]}#${state}`;
}

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
        if (/^\d{1,12}(\.\d{1,6})?$/.test(price ?? "")) priceInputs[n].value = Number(price);
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

async function unpack(name) {
    const packed = bytesOfBase64(document.getElementById(name).textContent.trim());
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

// What is shown is of the settings before, until the reader runs the missions of the new ones.
function change() {
    const isRunning = Boolean(run) && !run.isOver;
    if (isRunning) stop();
    else show();
    find("results").classList.toggle("stale", Boolean(run));
    if (run) find("status").textContent = "These numbers are of the settings before: press Run.";
}

async function open() {
    if (!window.WebAssembly || !window.DecompressionStream || !window.Worker) return;
    module = await WebAssembly.compile(await unpack("panel-module"));
    image = JSON.parse(new TextDecoder().decode(await unpack("panel-image")));
    for (const array of image.arrays) if (array.bytes) array.bytes = bytesOfBase64(array.bytes);
    readAddress();
    root.hidden = false;
    document.querySelectorAll("[data-replaced-by=panel]").forEach((element) => element.classList.add("replaced"));
    root.querySelectorAll("fieldset").forEach((fieldset) => { fieldset.disabled = false; });
    root.addEventListener("input", change);
    find("run").addEventListener("click", start);
    find("stop").addEventListener("click", () => stop());
    find("link").addEventListener("click", (event) => copy(event.target, addressOf()));
    find("copy").addEventListener("click", (event) => copy(event.target, commandOf()));
    find("dots").addEventListener("click", pick);
    find("loss").addEventListener("click", () => pickWorst("loss"));
    find("worst").addEventListener("click", () => pickWorst("worst"));
    show();
    root.dataset.ready = "yes";
}

open().catch((error) => { root.hidden = true; console.warn(`The panel cannot start: ${error.message}`); });
})();
