// Three controls on the index: what changes if the fleet of the example, or its data, changes.

(() => {
"use strict";
/** @type {any} */
const root = document.getElementById("try");
const data = JSON.parse(document.getElementById("panel-data").textContent);
const MISSIONS = 1000; // of each side
/** @type {(name: string) => any} */
const find = (name) => root.querySelector(`[data-panel="${name}"]`);
const sliders = data.settings.map(({key}) => root.querySelector(`[name="b-${key}"]`));
/** @type {WebAssembly.Module} */
let module;
/** @type {Image} */
let image;
/** @type {Crew} */
let crew;
/** @type {Comparison | null} */
let run = null;
let runKey = ""; // the positions of its settings
const BEFORE = "The results below are of the settings before. Press Run for those of the new settings.";
const keyOfChoice = () => sliders.map(({value}) => value).join(" ");

/** @type {(name: string, positions: number[]) => Track} */
function trackOf(name, positions) {
    const setting = Object.fromEntries(data.settings.map(({key}, n) => [key, positions[n]]));
    const order = {name, key: positions.join(" "), setting, policy: image.policies[data.policy], prices: []};
    return new Track(new Series(module, image, setting), order);
}

function start() {
    crew.end();
    runKey = keyOfChoice();
    const positions = sliders.map((input) => Number(input.value));
    const comparison = run = new Comparison({a: trackOf("a", data.start.a), b: trackOf("b", positions)}, MISSIONS);
    crew.begin({
        get isOver() { return comparison.isOver; },
        set isOver(isOver) { comparison.isOver = isOver; },
        next: () => comparison.next(),
        take: (answer) => { comparison.take(answer); show(); },
    });
    find("results").hidden = false;
    show();
}

function show(why = "") {
    data.settings.forEach(({texts, unit}, n) => {
        const text = `${texts[Number(sliders[n].value)]} ${unit}`.trim();
        sliders[n].setAttribute("aria-valuetext", text);
        sliders[n].parentElement.querySelector("output").textContent = text;
    });
    const isRunning = Boolean(crew.job && !crew.job.isOver);
    find("stop").disabled = !isRunning;
    if (!run) return;
    const count = Math.min(run.count("a"), run.count("b")), isStale = runKey !== keyOfChoice();
    find("results").classList.toggle("stale", isStale);
    find("status").textContent = isStale ? BEFORE : `${grouped(count)} missions of each${isRunning ? ", running" : ""}. ${why}`.trim();
    for (const metric of data.metrics)
        run.inWords(metric)?.forEach((text, n) => {
            root.querySelectorAll(`tr[data-metric="${metric.column}"] td`)[n].textContent = text;
        });
}

async function open() {
    checkBrowser();
    ({module, image} = await unpackEngine("panel"));
    const stop = (why = "") => { crew.end(); show(why); };
    crew = new Crew(document.getElementById("panel-worker").textContent, {module, image}, stop);
    root.hidden = false;
    root.querySelectorAll("fieldset").forEach((fieldset) => { fieldset.disabled = false; });
    root.addEventListener("input", () => stop());
    find("run").addEventListener("click", start);
    find("stop").addEventListener("click", () => stop());
    show();
    root.dataset.ready = "yes";
}

open().catch((error) => sayWhyNot(root, error));
})();
