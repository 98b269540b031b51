// Draws a mission slot by slot on a canvas: a map, and curves over time whose cursor is the slot.
// What it shows is computed in Python (reports/player.py); this file only draws it.
function sceneOf(mission, canvas) {
    "use strict";
    const INK = "{{ style.INK }}", MUTED = "{{ style.MUTED }}", GRID = "{{ style.GRID }}";
    const SEA = "{{ style.SEA }}", ZONE = "{{ style.ZONE }}", ZONE_EDGE = "{{ style.ZONE_EDGE }}";
    const LAND = "{{ style.LAND }}";
    const WIDE = 720; // width [px] from which the curves are beside the map, and not below it
    const NODE = 12.5, UAV = 8, PAD = 10.5; // radii of the largest disc and of a UAV, half a square
    const fleet = mission.fleet, residual = mission.residual, end = residual.length - 1;
    const uavs = mission.colours.uavs, nodes = mission.nodes;
    const range = (n) => [...Array(n).keys()];
    const ends = uavs.map((_, i) => fleet.over.findIndex((row) => row[i])).map((t) => t < 0 ? end : t);
    const most = nodes.map((_, k) => Math.max(...residual.map((row) => row[k])));
    const largest = Math.max(...most, 1e-9);
    const sums = residual.map((row) => row.reduce((a, b) => a + b, 0));
    const pen = canvas.getContext("2d", { willReadFrequently: true });
    let panels = [];

    // A panel is a box of the canvas with its own scales, and functions that draw into it.
    function panel(title, box, x, y, draw, move, ticks = {}) {
        const px = (v) => box.x + (v - x[0]) / (x[1] - x[0]) * box.w;
        const py = (v) => box.y + (v - y[0]) / (y[1] - y[0]) * box.h;
        return { title, box, x, y, px, py, draw, move, ...ticks };
    }

    function line(points, colour, width = 1.5, alpha = 1) {
        pen.globalAlpha = alpha;
        pen.strokeStyle = colour;
        pen.lineWidth = width;
        pen.beginPath();
        points.forEach(([x, y], n) => n ? pen.lineTo(x, y) : pen.moveTo(x, y));
        pen.stroke();
        pen.globalAlpha = 1;
    }

    function disc(x, y, radius, fill, edge = null, width = 1.5) {
        pen.beginPath();
        pen.arc(x, y, radius, 0, 2 * Math.PI);
        if (fill) { pen.fillStyle = fill; pen.fill(); }
        if (edge) { pen.strokeStyle = edge; pen.lineWidth = width; pen.stroke(); }
    }

    function rectangle(x, y, w, h, fill, edge, width = 1) {
        if (fill) { pen.fillStyle = fill; pen.fillRect(x, y, w, h); }
        if (edge) { pen.strokeStyle = edge; pen.lineWidth = width; pen.strokeRect(x, y, w, h); }
    }

    function text(words, x, y, align = "left", font = "12px", colour = INK, base = "middle") {
        pen.font = `${font} system-ui, sans-serif`;
        pen.fillStyle = colour;
        pen.textAlign = align;
        pen.textBaseline = base;
        pen.fillText(words, x, y);
    }

    // Round numbers of a unit of which 1 is so much, about as many as asked for, in the range.
    function steps([low, high], count, size = 1) {
        if (size !== 1) return steps([low * size, high * size], count).map((v) => v / size);
        const rough = Math.abs(high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
        const step = [1, 2, 5, 10].map((m) => m * power).find((m) => m >= rough);
        const [from, to] = [Math.min(low, high), Math.max(low, high)], first = Math.ceil(from / step);
        return range(Math.floor(to / step) - first + 1).map((n) => Number(((first + n) * step).toPrecision(9)));
    }

    function frame(p) {
        const { box } = p;
        text(p.title, box.x, box.y - 10, "left", "bold 12.5px");
        const written = (v, size = 1) => Number((v * size).toPrecision(9)).toLocaleString("en");
        for (const v of p.yTicks ?? steps(p.y, 4, p.ySize)) {
            if (!p.yTicks) line([[box.x, p.py(v)], [box.x + box.w, p.py(v)]], GRID, 1);
            text(written(v, p.ySize), box.x - 6, p.py(v), "right", "11px");
        }
        for (const v of p.xTicks ?? []) text(written(v, p.xSize), p.px(v), box.y + box.h + 10, "center", "11px");
        if (p.xTitle) text(p.xTitle, box.x + box.w / 2, box.y + box.h + 26, "center", "12px");
        rectangle(box.x, box.y, box.w, box.h, null, MUTED);
    }

    const radius = (data) => NODE * Math.sqrt(data / largest);

    function map(box) {
        const [columns, rows] = mission.size, longest = Math.max(columns, rows);
        const scale = box.w / longest;
        box = { ...box, w: scale * columns, h: scale * rows };
        const [unit, size] = mission.units.length;
        const numbers = (cells) => steps([0, longest - 1], 7, size).filter((v) => v < cells);
        const cells = (x, y, w, h, fill, edge) =>
            rectangle(p.px(x - 0.5), p.py(y - 0.5), w * scale, h * scale, fill, edge);
        const p = panel("", box, [-0.5, columns - 0.5], [-0.5, rows - 0.5], () => {
            mission.noFly.forEach(([x, y]) => cells(x, y, 1, 1, LAND));
            mission.zones.forEach((zone) => cells(...zone, ZONE, ZONE_EDGE));
            nodes.forEach(([x, y], k) => disc(p.px(x), p.py(y), radius(most[k]), "white", mission.colours.nodes[k]));
        }, (t) => {
            const at = (s, i) => [p.px(fleet.x[s][i]), p.py(fleet.y[s][i])];
            uavs.forEach((colour, i) =>
                line(range(mission.trail + 1).map((n) => at(Math.max(t - n, 0), i)), colour, 4, 0.35));
            uavs.forEach((_, i) => {
                const k = fleet.node[t][i];
                if (k >= 0) line([at(t, i), [p.px(nodes[k][0]), p.py(nodes[k][1])]], mission.colours.nodes[k], 2.5);
            });
            nodes.forEach(([x, y], k) => disc(p.px(x), p.py(y), radius(residual[t][k]), mission.colours.nodes[k]));
            uavs.forEach((colour, i) => {
                const [x, y] = at(t, i);
                if (fleet.waiting[t][i]) rectangle(x - PAD, y - PAD, 2 * PAD, 2 * PAD, null, INK, 1.8);
                if (fleet.charging[t][i]) rectangle(x - PAD, y - PAD, 2 * PAD, 2 * PAD, ZONE_EDGE, INK, 1.2);
                pen.globalAlpha = fleet.over[t][i] ? 0.4 : 1;
                disc(x, y, UAV, colour, "white");
                text(i + 1, x, y + 0.5, "center", "bold 11px", "white");
                pen.globalAlpha = 1;
            });
        }, { fill: SEA, xTicks: numbers(columns), yTicks: numbers(rows), xSize: size, ySize: size, xTitle: `x, east [${unit}]`, isMap: true });
        return p;
    }

    function overTime(title, y, draw, move, ticks) {
        return (box) => {
            const p = panel(title, box, [0, Math.max(end, 1)], y, () => draw(p), (t) => {
                line([[p.px(t), box.y], [p.px(t), box.y + box.h]], INK, 1.2);
                if (move) move(p, t);
            }, ticks);
            return p;
        };
    }

    const battery = overTime("Battery [%]", [103, 0], (p) => {
        for (const [name, level] of Object.entries(mission.thresholds)) {
            line([[p.px(0), p.py(level)], [p.px(p.x[1]), p.py(level)]], MUTED, 1);
            const x = p.box.x + p.box.w + 4, y = p.py(level);
            text("C", x, y, "left", "11px");
            text(name.slice(2), x + 8, y + 4, "left", "9px");
            text(level, x + 17, y, "left", "11px");
        }
        uavs.forEach((colour, i) =>
            line(range(ends[i] + 1).map((t) => [p.px(t), p.py(fleet.battery[t][i])]), colour));
    }, (p, t) => uavs.forEach((colour, i) => disc(p.px(t), p.py(fleet.battery[t][i]), 4.5, colour, "white")));

    const [time, perSlot] = mission.units.time, [amount, perUnit] = mission.units.data;
    const data = overTime(`Residual data [${amount}], a band per node`, [1.05 * Math.max(...sums, 1), 0], (p) => {
        let base = residual.map(() => 0);
        nodes.forEach((_, k) => {
            const top = base.map((b, t) => b + residual[t][k]);
            pen.globalAlpha = 0.75;
            pen.fillStyle = mission.colours.nodes[k];
            pen.beginPath();
            top.forEach((v, t) => pen.lineTo(p.px(t), p.py(v)));
            [...base].reverse().forEach((v, n) => pen.lineTo(p.px(end - n), p.py(v)));
            pen.fill();
            pen.globalAlpha = 1;
            base = top;
        });
    }, null, { ySize: perUnit });

    const age = mission.meanAge && overTime(
        `Mean age of the nodes [${time}]`, [1.05 * Math.max(...mission.meanAge.map((corner) => corner[1]), 1), 0],
        (p) => line(mission.meanAge.map(([t, v]) => [p.px(t), p.py(v)]), INK), null, { ySize: perSlot });

    const room = 0.6 + Math.max(0, 3 - uavs.length) / 2; // so that a single row does not fill the panel
    const waits = fleet.waiting.some((row) => row.some(Boolean));
    const pads = `${mission.pads} pad${mission.pads === 1 ? "" : "s"}`;
    const charging = overTime(`Charging, ${pads}${waits ? "; hollow: waiting" : ""}`, [1 - room, uavs.length + room], (p) => {
        uavs.forEach((colour, i) => {
            const y = p.py(i + 1), half = (p.py(1.3) - p.py(1));
            line([[p.px(0), y], [p.px(ends[i]), y]], colour);
            for (let t = 1; t <= end; t++) {
                const box = [p.px(t - 1), y - half, p.px(1) - p.px(0), 2 * half];
                if (fleet.charging[t][i]) rectangle(...box, colour, colour);
                if (fleet.waiting[t][i]) rectangle(...box, "white", colour);
            }
            text(mission.filled[i] ? "✓" : "✕", p.px(ends[i]) + 4, y);
        });
    }, null, {
        yTicks: range(uavs.length).map((i) => i + 1).filter((i) => (i - 1) % Math.ceil(uavs.length / 6) === 0),
        xTicks: steps([0, Math.max(end, 1)], 7, perSlot), xSize: perSlot, xTitle: `time [${time}]`,
    });

    function nodeAges(box) {
        const top = 1.05 * Math.max(...mission.ages.flat(), 1);
        const p = panel(`Age of each node [${time}]`, box, [-0.7, nodes.length - 0.3], [top, 0], () => {}, (t) =>
            mission.ages[t].forEach((value, k) => {
                line([[p.px(k), p.py(0)], [p.px(k), p.py(value)]], INK, 1);
                disc(p.px(k), p.py(value), 4, mission.colours.nodes[k]);
            }), { xTicks: steps([0, nodes.length - 1], 10), xTitle: "node", ySize: perSlot });
        return p;
    }

    // Where the panels are; beside each other if there is room, and otherwise one below the other.
    function arrange() {
        const width = canvas.clientWidth || 600, wide = width >= WIDE, left = 44, right = 44;
        const side = Math.min((wide ? 0.5 * width : width) - left - 8, 620);
        const x = wide ? left + side + 70 : left, w = width - x - right;
        let y = side + 50;
        panels = [map({ x: left, y: 8, w: side, h: side })];
        if (mission.ages) {
            panels.push(nodeAges({ x: left, y: y + 20, w: side, h: 90 }));
            y += 160;
        }
        const bottom = y;
        y = wide ? 28 : y + 20;
        /** @type {[any, number][]} */
        const every = [[battery, 1.5], [data, 1.5], [age, 1.5], [charging, 1]], curves = every.filter(([make]) => make);
        const share = curves.reduce((sum, [, part]) => sum + part, 0);
        const unit = wide ? (Math.max(bottom, 360) - 40 - 38 * curves.length) / share : 80;
        for (const [make, part] of curves) {
            panels.push(make({ x, y, w, h: part * unit }));
            y += part * unit + 38;
        }
        const height = Math.max(bottom, y + 4), scale = window.devicePixelRatio || 1;
        canvas.style.height = `${height}px`;
        canvas.width = Math.round(width * scale);
        canvas.height = Math.round(height * scale);
        pen.setTransform(scale, 0, 0, scale, 0, 0);
        still = null;
    }

    let still = null; // the picture of all that does not move
    function draw(slot) {
        pen.clearRect(0, 0, canvas.width, canvas.height);
        if (still) {
            pen.putImageData(still, 0, 0);
        } else {
            rectangle(0, 0, canvas.clientWidth, canvas.clientHeight, "white");
            for (const p of panels) {
                if (p.fill) rectangle(p.box.x, p.box.y, p.box.w, p.box.h, p.fill);
                frame(p);
                p.draw();
            }
            if (mission.note) text(mission.note, canvas.clientWidth - 4, canvas.clientHeight - 6, "right", "10px", MUTED);
            still = pen.getImageData(0, 0, canvas.width, canvas.height);
        }
        for (const p of panels) p.move(slot);
    }

    // The UAVs and nodes that a reader can ask about: a name, and what there is to tell in a slot.
    const things = [
        ...uavs.map((_, i) => ({ name: `UAV ${i + 1}`, tell: (t) => `battery ${fleet.battery[t][i]} %` })),
        ...nodes.map((_, k) => ({
            name: mission.names[k] ?? `node ${k}`,
            tell: (t) => `${(residual[t][k] * perUnit).toLocaleString("en", { maximumFractionDigits: 1 })} ${amount}`,
        })),
    ];

    // The panel at a place of the canvas, if there is one.
    function under(event) {
        const [x, y] = [event.offsetX, event.offsetY];
        const p = panels.find(({ box }) => x >= box.x && x <= box.x + box.w && y >= box.y && y <= box.y + box.h);
        return [p, x, y];
    }

    // The slot of a place on a curve, or undefined.
    function slotAt(event) {
        const [p, x] = under(event);
        if (p && !p.isMap && p.x[0] === 0) return (x - p.box.x) / p.box.w * p.x[1];
    }

    // The number of the thing at a place on the map, -1 for the sea between, or undefined.
    function thingAt(event, slot) {
        const [p, x, y] = under(event), reach = Math.max(NODE, event.pointerType === "touch" ? 22 : 0);
        if (!p || !p.isMap) return undefined;
        const places = [...uavs.map((_, i) => [fleet.x[slot][i], fleet.y[slot][i]]), ...nodes];
        const gaps = places.map(([a, b]) => Math.hypot(p.px(a) - x, p.py(b) - y));
        const nearest = gaps.indexOf(Math.min(...gaps));
        return gaps[nearest] <= reach ? nearest : -1;
    }

    return { end, things, arrange, draw, slotAt, thingAt };
}

// Plays one of several missions in the figure with this id.
function playMission(id, missions) {
    "use strict";
    const figure = document.getElementById(id), find = (selector) => figure.querySelector(selector);
    const canvas = find("canvas"), slider = find("input"), status = find("output"), title = find(".subject");
    const speed = find("[name=speed]"), choice = find("[name=mission]"), about = find("[name=about]");
    const button = (name) => find(`[data-go=${name}]`), playing = button("play");
    let mission, scene, slot = 0, timer = null;

    function draw() {
        scene.draw(slot);
        const event = mission.events.find(([time]) => time === slot), thing = scene.things[about.value];
        const told = thing ? `${thing.name}: ${thing.tell(slot)}` : "";
        status.textContent = [mission.status[slot], event ? event[1] : "", told].filter(Boolean).join(" · ");
        slider.value = slot;
    }

    // Shows another mission, at the same slot.
    function choose(number) {
        mission = missions[number];
        scene = sceneOf(mission, canvas);
        slider.max = scene.end;
        title.textContent = mission.title;
        title.hidden = !mission.title;
        const option = (name, n) => new Option(name, n);
        const before = about.value;
        about.replaceChildren(option("nothing", -1), ...scene.things.map(({ name }, n) => option(name, n)));
        about.value = before in scene.things ? before : -1;
        scene.arrange();
        show(slot);
    }

    // Players in the same element that is marked so show the same slot.
    const together = figure.closest(".together");
    function show(next) {
        slot = Math.max(0, Math.min(scene.end, Math.round(next)));
        draw();
        if (together) together.dispatchEvent(new CustomEvent("shown", { detail: { id, next } }));
    }

    function join(/** @type {CustomEvent} */ { detail }) {
        if (detail.id === id) return;
        pause();
        slot = Math.max(0, Math.min(scene.end, Math.round(detail.next)));
        draw();
    }

    function pause() {
        clearInterval(timer);
        timer = null;
        playing.textContent = "Play";
    }

    function play() {
        if (slot === scene.end) show(0);
        playing.textContent = "Pause";
        timer = setInterval(() => slot < scene.end ? show(slot + 1) : pause(), 1000 / Number(speed.value));
    }

    // The times of the events before and after the slot.
    const before = () => mission.events.map(([time]) => time).filter((time) => time < slot);
    const after = () => mission.events.map(([time]) => time).filter((time) => time > slot);
    const GO = {
        "play": () => timer === null ? play() : pause(),
        "slot-back": () => show(slot - 1),
        "slot-on": () => show(slot + 1),
        "event-back": () => show(Math.max(0, ...before())),
        "event-on": () => show(Math.min(scene.end, ...after())),
    };
    const KEYS = {
        " ": GO.play, ArrowRight: GO["slot-on"], ArrowLeft: GO["slot-back"],
        PageUp: GO["event-back"], PageDown: GO["event-on"], Home: () => show(0), End: () => show(scene.end),
    };

    for (const [name, go] of Object.entries(GO)) button(name).addEventListener("click", go);
    slider.addEventListener("input", () => show(Number(slider.value)));
    speed.addEventListener("change", () => { if (timer !== null) { pause(); play(); } });
    about.addEventListener("change", draw);
    if (choice) choice.addEventListener("change", () => choose(Number(choice.value)));
    figure.addEventListener("keydown", (event) => {
        const target = /** @type {HTMLElement} */ (event.target);
        if (!(event.key in KEYS) || target.matches("button, select, a")) return;
        event.preventDefault();
        KEYS[event.key]();
    });
    canvas.addEventListener("click", (event) => {
        const time = scene.slotAt(event), thing = scene.thingAt(event, slot);
        if (time !== undefined) show(time);
        if (thing === undefined) return;
        about.value = thing;
        draw();
    });
    canvas.addEventListener("mousemove", (event) => {
        const thing = scene.things[scene.thingAt(event, slot)];
        canvas.title = thing ? `${thing.name}: ${thing.tell(slot)}` : "";
    });
    function follow() {
        const asked = location.hash.match(/^#slot=(\d+)$/);
        if (asked) show(Number(asked[1]));
    }
    canvas.style.width = "100%";
    find(".still").classList.add("replaced");
    find(".played").hidden = false;
    if (together) together.addEventListener("shown", /** @type {any} */ (join));
    window.addEventListener("resize", () => { scene.arrange(); draw(); });
    window.addEventListener("hashchange", follow);
    choose(0);
    follow();
}
