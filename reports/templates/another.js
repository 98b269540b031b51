// Another mission: its reader changes settings, and the page simulates and plays one mission.

(() => {
"use strict";
const controls = new Controls(root, "a", data.settings), number = named("number");
/** @type {Simulator} */
let simulator;
let shown = ""; // the command of the mission that is shown

function show() {
    controls.show();
    const command = simulateCommand(data, controls.choice, wholeNumber(number));
    find("command").textContent = shown || command;
    markStale(shown !== "" && command !== shown);
}

// Simulate the mission and show it from its beginning.
function play() {
    const {choice} = controls, replication = wholeNumber(number), engine = engineOf(simulator, choice);
    number.value = replication;
    shown = simulateCommand(data, choice, replication);
    playMissions(find("player"), {"panel-player-a": {engine, title: `Mission ${replication} of ${choice.policy}`}}, replication);
    engine.exports.play(replication, 1);
    engine.exports.measure(1);
    const values = engine.floats("values"), told = data.metrics.filter(({isOffered, column}) => isOffered && !Number.isNaN(values[column]));
    const texts = told.map((metric) => `${metric.name.toLowerCase()} ${written(metric, values[metric.column])}`);
    const hash = hashesOf(choice)[replication], isSame = hash === sha256(engine.record(0));
    const check = isSame ? "It is the same as that of Python, bit for bit." : "It differs from the one that Python simulates.";
    find("status").textContent = `Mission ${replication}: ${texts.join(", ")}. ${hash ? check : ""}`;
    show();
}

openPanel((unpacked) => {
    simulator = unpacked;
    root.addEventListener("input", show);
    find("play").addEventListener("click", play);
    find("next").addEventListener("click", () => {
        number.value = (wholeNumber(number) + 1) % (Number(number.max) + 1);
        play();
    });
    show();
});
})();
