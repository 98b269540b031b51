// A mission that the engine of a page simulates slot by slot, as player.js shows it.
// `sea` is what the player draws of the scenario.
function replay(engine, replication, sea, title) {
    engine.exports.launch(replication);
    const [uavs] = engine.field("missions", "uavs"), [pads] = engine.field("missions", "pads");
    const fleet = {x: [], y: [], battery: [], node: [], charging: [], waiting: [], over: []}, residual = [];
    const field = (name) => engine.field("uavs", name).slice(0, uavs);

    function look() {
        for (const name of ["x", "y", "battery"]) fleet[name].push(field(name));
        const charging = field("charging"), active = field("active");
        fleet.charging.push(charging.map(Number));
        fleet.waiting.push(field("pad_request").map((slot, i) => Number(slot >= 0 && !charging[i])));
        fleet.node.push(residual.length ? field("served").map((node, i) => active[i] ? node : -1) : active.map(() => -1));
        fleet.over.push(active.map((isActive) => Number(!isActive)));
        residual.push([...engine.floats("residual")]);
    }

    look();
    while (!engine.exports.advance(1)) look();
    look();
    const end = residual.length - 1;
    const [start, complete] = ["charge_start", "charge_complete"].map((name) => engine.field("missions", name)[0]);
    const lost = engine.field("uav_records", "down").slice(0, uavs);
    const counts = [field("communications"), field("quota")];
    return {
        ...sea, title, pads, fleet, residual,
        colours: {...sea.colours, uavs: sea.colours.uavs.slice(0, uavs)},
        thresholds: {C_S: start, C_C: complete},
        filled: counts[0].map((count, i) => count >= counts[1][i] && !lost[i]),
        status: residual.map((data, slot) => statusOf(slot, end, data, fleet, pads, sea.units)),
        events: [...eventsOf(fleet)],
        note: EXPLORATION,
        ages: null,
        meanAge: null,
    };
}

function statusOf(slot, end, data, fleet, pads, {time: [unit, size], data: [amount, perUnit]}) {
    const written = (number) => Number(number.toPrecision(3)).toLocaleString("en-US");
    const used = fleet.charging[slot].reduce((sum, charges) => sum + charges, 0);
    const left = written(perUnit * data.reduce((sum, part) => sum + part, 0));
    const now = size === 1 ? `slot ${slot} of ${end}` : `${written(size * slot)} of ${written(size * end)} ${unit}`;
    return `${now} · ${left} ${amount} left · ${used} of ${pads} pads in use`;
}

// The slots at which charges begin and end, and at which a UAV has ended its mission.
function* eventsOf({charging, over}) {
    for (let slot = 1; slot < charging.length; slot++) {
        const words = charging[slot].flatMap((charges, i) => [
            ...(charges > charging[slot - 1][i] ? [`UAV ${i + 1} starts to charge`] : []),
            ...(charges < charging[slot - 1][i] ? [`UAV ${i + 1} stops charging`] : []),
            ...(over[slot][i] > over[slot - 1][i] ? [`the mission of UAV ${i + 1} is over`] : []),
        ]);
        if (words.length) yield [slot, words.join(", ")];
    }
}
