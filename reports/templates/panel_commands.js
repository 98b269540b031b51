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

/** @type {(about: Named, choice: Choice, replication: number) => string} */
function simulateCommand(about, choice, replication) {
    return ["dess simulate", `--policy ${quoted(choice.policy)}`, `--scenario ${quoted(about.scenario)}`,
        ...allOptionsOf(about, choice, "--set"), `--seed ${about.seed}`, `--replication ${replication}`].join(" ");
}
