// Another mission: its reader changes settings, and the page simulates and plays one mission.

(() => {
"use strict";
/** @type {any} */
const root = document.getElementById("another");
const data = JSON.parse(document.getElementById("panel-data").textContent);
const MOST = 99_999; // the largest number of a mission
const BEFORE = "The mission below is of the settings before. Press Show this mission for the new one.";
/** @type {(name: string) => any} */
const find = (name) => root.querySelector(`[data-panel="${name}"]`);
/** @type {(name: string) => any} */
const named = (name) => root.querySelector(`[name="${name}"]`);
const sliders = data.settings.map(({key}) => named(`a-${key}`)), policy = named("a-policy"), number = named("number");
/** @type {WebAssembly.Module} */
let module;
/** @type {Image} */
let image;
let shown = ""; // what the mission that is shown was simulated with

/** @returns {Choice} */
const choice = () => ({positions: sliders.map((input) => Number(input.value)), policy: policy.value});
const asked = () => Math.min(Math.max(Math.round(Number(number.value)) || 0, 0), MOST);

function show() {
    data.settings.forEach(({texts, unit}, n) => {
        const text = `${texts[choice().positions[n]]} ${unit}`.trim();
        sliders[n].setAttribute("aria-valuetext", text);
        sliders[n].parentElement.querySelector("output").textContent = text;
    });
    const command = simulateCommand(data, choice(), asked()), isStale = shown !== "" && command !== shown;
    find("command").textContent = shown || command;
    find("results").classList.toggle("stale", isStale);
    find("before").hidden = !isStale;
    find("before").textContent = isStale ? BEFORE : "";
}

// Simulate the mission and show it from its beginning.
function play() {
    const chosen = choice(), replication = asked();
    number.value = replication;
    shown = simulateCommand(data, chosen, replication);
    const setting = Object.fromEntries(data.settings.map(({key}, n) => [key, chosen.positions[n]]));
    const engine = new Engine(module, image, setting);
    engine.follow(image.policies[chosen.policy]);
    const mission = replay(engine, replication, data.sea, `Mission ${replication} of ${chosen.policy}`);
    const figure = document.createElement("figure");
    figure.className = "player";
    figure.id = "panel-player";
    figure.append(/** @type {any} */ (document.getElementById("panel-player-parts")).content.cloneNode(true));
    find("player").replaceChildren(figure);
    playMission(figure.id, [mission]);
    engine.call("play", replication, 1);
    engine.call("measure", 1);
    const values = engine.floats("values"), told = data.metrics.filter(({isOffered}) => isOffered);
    const texts = told.filter(({column}) => !Number.isNaN(values[column]))
        .map((metric) => `${metric.name.toLowerCase()} ${written(metric, values[metric.column])}`);
    find("status").textContent = `Mission ${replication}: ${texts.join(", ")}. ${checkInWords(chosen, replication, engine.record(0))}`;
    show();
}

// Whether a mission of the page's own settings is what it is in Python, where the page knows that.
/** @type {(chosen: Choice, replication: number, record: Uint8Array) => string} */
function checkInWords(chosen, replication, record) {
    const {hashes} = data.check;
    if (keyOf(chosen) !== keyOf(data.check) || replication >= hashes.length) return "";
    if (sha256(record) !== hashes[replication]) return "It differs from the one that Python simulates.";
    return "It is the same as that of Python, bit for bit.";
}

async function open() {
    checkBrowser();
    ({module, image} = await unpackEngine("panel"));
    root.hidden = false;
    root.querySelectorAll("fieldset").forEach((fieldset) => { fieldset.disabled = false; });
    root.addEventListener("input", show);
    find("play").addEventListener("click", play);
    find("next").addEventListener("click", () => {
        number.value = (asked() + 1) % (MOST + 1);
        play();
    });
    show();
    root.dataset.ready = "yes";
}

open().catch((error) => sayWhyNot(root, error));
})();
