// What a reader takes along: commands for what he has chosen, and tables as CSV.

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

const EXPLORATION = "exploration, not verified"; // what leaves a panel says so

/** @type {(choice: Choice) => string} */
const keyOf = ({positions, policy}) => [policy, ...positions].join(" ");

/**
 * A word for the shell, quoted as Python's shlex quotes it.
 * @type {(text: string) => string}
 */
const quoted = (text) => /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'"'"'`)}'`;

/**
 * Options of a command; one that is a list is repeated.
 * @type {(options: Record<string, string | number | string[]>) => string}
 */
const optionsInWords = (options) => Object.entries(options).flatMap(([name, value]) =>
    [value].flat().map((each) => `--${name} ${quoted(String(each))}`)).join(" ");

/** @type {(name: string, options: Record<string, string | number | string[]>) => string} */
const commandLine = (name, options) => `dess ${name} ${optionsInWords(options)}`;

/**
 * What commands have to say of the settings.
 * @type {(about: Named, choice: Choice) => string[]}
 */
const valuesOf = ({fixed, settings}, choice) => [...fixed, ...settings.flatMap((setting, n) =>
    choice.positions[n] === setting.default ? [] : [setting.options[choice.positions[n]]])];

/** @type {(about: Named, choice: Choice, replication: number) => string} */
const simulateCommand = (about, choice, replication) => commandLine("simulate", {
    policy: choice.policy, scenario: about.scenario, set: valuesOf(about, choice), seed: about.seed, replication,
});

/**
 * The study of two choices: both settings with both policies, and the prices.
 * @type {(about: Named, a: Choice, b: Choice, price: string[], missions: number) => string}
 */
function studyCommand(about, a, b, price, missions) {
    const policies = [...new Set([a.policy, b.policy])];
    const common = {scenario: about.scenario, seed: about.seed, missions: Math.max(missions, 2), price};
    const changes = about.settings.flatMap(({options}, n) =>
        a.positions[n] === b.positions[n] ? [] : [options[b.positions[n]]]);
    const policy = policies.join(",");
    if (!changes.length) return commandLine("sweep", {set: valuesOf(about, a), policy, ...common});
    // To what-if, names joined by commas are a team.
    return commandLine("what-if", {baseline: valuesOf(about, a), set: changes, policy: policies, ...common});
}

/**
 * A table as CSV, which says that it is exploration, and what a study of it is. As in Python, text
 * that a spreadsheet would take as a formula begins with an apostrophe.
 * @type {(rows: (string | number)[][], command: string) => string}
 */
function csvOf(rows, command) {
    const cell = (/** @type {string | number} */ content) => {
        const text = typeof content === "string" ? content.replace(/^[=+\-@\t\r]/, "'$&") : String(content);
        return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
    };
    const about = `${EXPLORATION}\n${command}`.trim().split("\n").map((line) => `# ${line}`);
    return [...about, ...rows.map((row) => row.map(cell).join(",")), ""].join("\n");
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

/** @type {(name: string, rows: (string | number)[][], command: string) => void} */
const saveTable = (name, rows, command) => save(name, new Blob([csvOf(rows, command)], {type: "text/csv"}));
