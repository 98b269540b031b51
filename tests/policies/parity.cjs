// Fly missions with the WebAssembly module: node parity.cjs FOLDER MISSIONS
// The folder has the module and the arrays of an image; the records are written into it.
"use strict";
const fs = require("node:fs");

const [folder, missions] = process.argv.slice(2);
const read = (name) => fs.readFileSync(`${folder}/${name}`);
const WORDS = 5;
const compiled = new WebAssembly.Module(read("module.wasm"));
const { exports: calls } = new WebAssembly.Instance(compiled, {});
const arrays = JSON.parse(read("arrays.json").toString("utf8"));
const table = new BigInt64Array(arrays.length * WORDS);
const places = {};
arrays.forEach(([name, size, shape], row) => {
  places[name] = calls.reserve(size);
  table[row * WORDS] = BigInt(places[name]);
  shape.forEach((length, axis) => {
    table[row * WORDS + 1 + axis] = BigInt(length);
  });
});
const memory = () => new Uint8Array(calls.memory.buffer);
for (const [name, , , hasContent] of arrays) {
  if (hasContent) memory().set(read(name), places[name]);
}
memory().set(new Uint8Array(table.buffer), Number(calls.arrays()));
calls.prepare();
if (calls.play(0, Number(missions)) !== Number(missions)) throw new Error("missions are left");
for (const [name, size] of arrays) {
  if (name === "mission_records" || name === "uav_records") {
    fs.writeFileSync(`${folder}/${name}.out`, memory().slice(places[name], places[name] + size));
  }
}
