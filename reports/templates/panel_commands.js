// Commands for what a reader has chosen. They are made of the page's own names and numbers, and
// quoted for the shell.

/**
 * The positions of all sliders, and the policy.
 * @typedef { {positions: number[], policy: string}} Choice
 */

/**
 * A setting that a reader may change.
 * @typedef {object} Setting
 * @property {string} key
 * @property {string} name
 * @property {string} unit
 * @property {string} place - in which of several zones; otherwise empty
 * @property {string[]} texts - of its values
 * @property {string[]} options - of the command line, for each value
 * @property {number | null} default - the position that a command need not name
 */

/**
 * What commands begin with.
 * @typedef { {scenario: string, seed: number, fixed: string[], settings: Setting[]}} Named
 */

/** @type {(choice: Choice) => string} */
const keyOf = ({positions, policy}) => [policy, ...positions].join(" ");
const quoted = (/** @type {string} */ text) => /^[\w.=,-]+$/.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`;

/** @type {(about: Named, choice: Choice, option: string, isLeftOut: (setting: Setting, n: number) => boolean) => string[]} */
const optionsOf = ({settings}, {positions}, option, isLeftOut) => settings.flatMap((setting, n) =>
    isLeftOut(setting, n) ? [] : [`${option} ${quoted(setting.options[positions[n]])}`]);

/** @type {(about: Named, choice: Choice, option: string) => string[]} */
const allOptionsOf = (about, choice, option) => [
    ...about.fixed.map((setting) => `${option} ${quoted(setting)}`),
    ...optionsOf(about, choice, option, (setting, n) => choice.positions[n] === setting.default),
];

/**
 * A table as CSV, which says that it is exploration, and what a study of it is.
 * @type {(rows: (string | number)[][], command: string) => string}
 */
function csvOf(rows, command) {
    const cell = (/** @type {string | number} */ content) => /[",]/.test(String(content)) ? `"${String(content).replaceAll('"', '""')}"` : content;
    const lines = [...`${EXPLORATION}\n${command}`.trim().split("\n").map((line) => `# ${line}`), ...rows.map((row) => row.map(cell).join(","))];
    return `${lines.join("\n")}\n`;
}

/**
 * Let the reader save a file.
 * @type {(name: string, content: Blob) => void}
 */
function save(name, content) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(content);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** @type {(about: Named, choice: Choice, replication: number) => string} */
function simulateCommand(about, choice, replication) {
    return ["dess simulate", `--policy ${quoted(choice.policy)}`, `--scenario ${quoted(about.scenario)}`,
        ...allOptionsOf(about, choice, "--set"), `--seed ${about.seed}`, `--replication ${replication}`].join(" ");
}
