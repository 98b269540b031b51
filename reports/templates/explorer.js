// The explorer: sliders over settings that were simulated beforehand, and the metrics of every policy.

(() => {
"use strict";
/** @type {any} */
const root = document.getElementById("explorer");
const {settings, estimates} = JSON.parse(document.getElementById("explorer-data").textContent);
const controls = new Controls(root, "explorer", settings);
const metrics = [...root.querySelectorAll("[data-metric]")];
const boxes = [...root.querySelectorAll("[name=policy]")];
const colours = [...metrics[0].querySelectorAll("tr")].map((row) => row.dataset.colour);
const dashes = ["none", "7 4", "2 3", "9 3 2 3"];
const curve = root.querySelector(".curve svg");
const SHARE = /** @type {Metric} */ ({percent: true});

// The estimate of a policy and a metric at the present setting: mean, low, high [0.1 %], missions.
function estimate(positions, policy, metric) {
    const point = positions.reduce((sum, position, n) => sum * settings[n].texts.length + position, 0);
    return estimates[(point * boxes.length + policy) * metrics.length + metric];
}

const inPercent = (number) => `${number / 10}%`;
const inside = (number) => Math.min(Math.max(number, 0), 1000);

function words([mean, low, high, missions]) {
    return `${interval(SHARE, {mean: mean / 1000, low: low / 1000, high: high / 1000})}, n = ${grouped(missions)}`;
}

function drawn(name, attributes, text = "") {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.textContent = text;
    return element;
}

const line = (x1, y1, x2, y2, style) => drawn("line", {x1, y1, x2, y2, "stroke-width": 2, ...style});

function drawDot(svg, [mean, low, high], colour) {
    const ends = [low, high].map((end) => inPercent(inside(end)));
    svg.replaceChildren(
        ...["0%", "50%", "100%"].map((x) => line(x, "0%", x, "100%", {stroke: "var(--line)", "stroke-width": 1})),
        line(ends[0], "50%", ends[1], "50%", {stroke: colour}),
        ...ends.map((x) => line(x, "25%", x, "75%", {stroke: colour})),
        drawn("circle", {cx: inPercent(inside(mean)), cy: "50%", r: 5, fill: colour}),
    );
}

function axes(slider, position) {
    const width = 100 / slider.texts.length, grid = {stroke: "var(--line)", "stroke-width": 1};
    const band = {x: `${position * width}%`, width: `${width}%`, y: 0, height: "100%", fill: "var(--pale)"};
    return [
        drawn("rect", band),
        ...[0, 25, 50, 75, 100].flatMap((y) => [
            line("0%", `${100 - y}%`, "100%", `${100 - y}%`, grid),
            drawn("text", {x: -6, y: `${100 - y}%`, dy: "0.35em", "text-anchor": "end"}, `${y} %`),
        ]),
        ...slider.texts.map((value, n) =>
            drawn("text", {x: `${(n + 0.5) * width}%`, y: "100%", dy: "1.5em", "text-anchor": "middle"}, value)),
        drawn("text", {x: "50%", y: "100%", dy: "3em", "text-anchor": "middle"},
            slider.unit ? `${slider.plain} [${slider.unit}]` : slider.plain),
    ];
}

// The means of a policy along a slider, with the other sliders at their present values.
function means(positions, along, policy, shift, metric) {
    const colour = colours[policy], count = settings[along].texts.length, marks = [];
    const moved = (place) => positions.map((position, n) => n === along ? place : position);
    let before = null;
    for (let n = 0; n < count; n++) {
        const [mean, low, high] = estimate(moved(n), policy, metric).map(inside);
        const x = `${100 * (n + 0.5 + shift) / count}%`, y = (number) => inPercent(1000 - number);
        if (before) marks.push(line(...before, x, y(mean), {stroke: colour, "stroke-dasharray": dashes[policy % 4]}));
        marks.push(line(x, y(low), x, y(high), {stroke: colour, opacity: 0.6}));
        marks.push(drawn("circle", {cx: x, cy: y(mean), r: 4.5, fill: colour}));
        before = [x, y(mean)];
    }
    return marks;
}

function drawCurve(positions, policies) {
    const [metric, along] = ["metric", "along"].map((name) => Number(root.querySelector(`[name=${name}]`).value));
    const shift = (n) => 0.08 * (n - (policies.length - 1) / 2);
    curve.replaceChildren(
        ...axes(settings[along], positions[along]),
        ...policies.flatMap((policy, n) => means(positions, along, policy, shift(n), metric)),
    );
    const name = root.querySelector("[name=metric]").selectedOptions[0].text;
    curve.setAttribute("aria-label", `${name} along ${settings[along].plain}, a line per policy`);
}

function show() {
    const {positions} = controls;
    const policies = [...boxes.keys()].filter((n) => boxes[n].checked);
    controls.show();
    metrics.forEach((section, metric) => section.querySelectorAll("tr").forEach((row, policy) => {
        const found = estimate(positions, policy, metric);
        row.hidden = !boxes[policy].checked;
        row.querySelector(".estimate").textContent = words(found);
        drawDot(row.querySelector("svg"), found, colours[policy]);
    }));
    root.querySelector(".setting code").textContent = optionsInWords({set: settings.map(({options}, n) => options[positions[n]])});
    drawCurve(positions, policies);
}

root.querySelectorAll("[hidden]").forEach((element) => { element.hidden = false; });
root.querySelectorAll("fieldset").forEach((fieldset) => { fieldset.disabled = false; });
root.addEventListener("input", show);
show();
})();
