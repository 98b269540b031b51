// How a panel writes numbers: as they are written everywhere on its page.

/**
 * A metric, as the panel writes it.
 * @typedef {object} Metric
 * @property {number} column - its column in the values of missions
 * @property {string} key
 * @property {string} name
 * @property {boolean} percent - whether it is a share, and is written in percent
 * @property {string} unit
 * @property {boolean} less - whether less is better
 * @property {boolean} neutral - whether neither more nor less is better
 * @property {boolean} isOutcome - whether it is 0 or 1 in each mission: what allows for failures is then exact
 * @property {boolean} isOffered - whether a reader may require it
 * @property {number} tolerance - how far from a bound either verdict of the grid is right
 * @property {string} suffix - of an amount on the command line
 * @property {string} option - its name on the command line, if a search can require it
 */

/**
 * A mean, the ends of its interval, and the ends of the one that allows for no failure but those that were seen.
 * @typedef { {mean: number, low: number, high: number, lowSeen: number, highSeen: number, count: number}} Estimate
 */

/**
 * A bound on the mean of a metric.
 * @typedef { {metric: Metric, bound: number}} Requirement
 */

const minus = (/** @type {string} */ text) => (Number(text.replaceAll(",", "")) ? text.replace("-", "−") : text.replace("-", ""));

/** @param {number} number */
function grouped(number, digits = 0) {
    return number.toLocaleString("en-US", {minimumFractionDigits: digits, maximumFractionDigits: digits});
}

/**
 * One decimal; a number in the middle of two becomes the even one, as in Python.
 * @param {number} number
 */
function tenths(number) {
    const isTie = Number.isInteger(number * 4) && !Number.isInteger(number * 2);
    if (!isTie) return number.toFixed(1);
    const below = Math.floor(number * 10);
    return ((below % 2 ? below + 1 : below) / 10).toFixed(1);
}

/** @param {number} number */
function quantity(number) {
    if (Math.abs(number) < 1e-12) return "0";
    if (Math.abs(number) >= 1000) return minus(grouped(number));
    return minus(String(Number(number.toPrecision(4))));
}

/** @type {(metric: Metric, number: number) => string} */
function written({percent, unit}, number) {
    if (percent) return `${minus(tenths(100 * number))} %`;
    return `${quantity(number)} ${unit}`.trim();
}

/** @type {(metric: Metric, estimate: Estimate) => string} */
function interval(metric, {mean, low, high}) {
    const end = (/** @type {number} */ number) => metric.percent ? minus(tenths(100 * number)) : quantity(number);
    const ends = [low, high].map((number) => Number.isFinite(number) ? end(number) : "?");
    return `${written(metric, mean)} [${ends.join(", ")}]`;
}

/**
 * A difference with its unit; shares differ by percentage points.
 * @type {(metric: Metric, estimate: Pick<Estimate, "mean" | "low" | "high">) => string}
 */
function difference(metric, {mean, low, high}) {
    const write = (/** @type {number} */ number) => signed(metric, number);
    return `${write(mean)} [${write(low)}, ${write(high)}] ${unitOfDifference(metric)}`.trim();
}

/** @type {(metric: Metric) => string} */
const unitOfDifference = ({percent, unit}) => percent ? "points" : unit;

/** @type {(metric: Metric, number: number) => string} */
function signed({percent}, number) {
    if (!Number.isFinite(number)) return "?";
    const text = percent ? minus(tenths(100 * number)) : quantity(number);
    return number > 0 && Number(text) !== 0 ? `+${text}` : text;
}

// As the pages say it of a study (dess.analysis.stats.verdict).
const SEEN = "in what was seen", NOT_RULED_OUT = "a rare failure is not ruled out";

/**
 * Whether B is higher or lower, and better if that can be said, or about how many more missions may decide it. Where the
 * interval contains 0 only because it allows for failures that were not seen, it is so in what was seen.
 * @type {(metric: Metric, estimate: Estimate) => string}
 */
function decision(metric, estimate) {
    const {mean, low, high, lowSeen, highSeen} = estimate;
    const side = sideOf(metric, low, high);
    if (side) return `decided: B is ${side}`;
    if (!Number.isFinite(high - low)) return "not decided";
    if (low === high) return "no difference seen";
    if (!mean) return `no difference seen; at most ${signed(metric, high).slice(1)} ${unitOfDifference(metric)}`.trim();
    const sideSeen = metric.isOutcome ? "" : sideOf(metric, lowSeen, highSeen);
    const more = moreMissions(estimate);
    if (sideSeen) return `${SEEN}, B is ${sideSeen}; ${NOT_RULED_OUT}${more}`;
    return `not decided${more}`;
}

/**
 * On which side of 0 a whole interval is, and whether that is better if it can be said; nothing if it contains 0.
 * @type {(metric: Metric, low: number, high: number) => string}
 */
function sideOf(metric, low, high) {
    if (!(low > 0 || high < 0)) return "";
    const side = low > 0 ? "higher" : "lower";
    if (metric.neutral) return side;
    const isBetter = metric.less ? high < 0 : low > 0;
    return `${side}, which is ${isBetter ? "better" : "worse"}`;
}

/**
 * About how many more missions may decide a difference: an interval becomes narrower with about the root of their number.
 * @type {(estimate: Estimate) => string}
 */
function moreMissions({mean, low, high, count}) {
    const needed = count * ((high - low) / 2 / Math.abs(mean)) ** 2 - count;
    return needed > 0 && needed < 1e6 ? `, about ${quantity(Number(needed.toPrecision(1)))} more missions` : "";
}

/** @type {(requirement: Requirement) => string} */
function requirementInWords({metric, bound}) {
    const amount = metric.percent ? `${quantity(100 * bound)} %` : written(metric, bound);
    return `${metric.name} of at ${metric.less ? "most" : "least"} ${amount}`;
}

/**
 * By how much a mean, or an end of its interval, keeps a bound; negative if it breaks it.
 * @type {(requirement: Requirement, number: number) => number}
 */
const roomOf = ({metric, bound}, number) => metric.less ? bound - number : number - bound;

/**
 * The verdicts by what is known of a bound, as ``stats/verdict.py`` has them.
 * @typedef { {mostSeriousFirst: string[], table: (string | null)[][]}} Rule
 */

/**
 * Whether a whole interval keeps a bound, breaks it, or neither. Both are known only within the
 * tolerance of the bound: there the mean decides.
 * @type {(rule: Rule, requirement: Requirement, estimate: Estimate, tolerance?: number) => string}
 */
function verdict({table}, requirement, {mean, low, high, count}, tolerance = 0) {
    const rooms = count ? [low, high].map((end) => roomOf(requirement, end)) : [NaN];
    const isKept = Math.min(...rooms) >= -tolerance, isBroken = Math.max(...rooms) < tolerance;
    const isMeanGood = roomOf(requirement, mean) >= 0;
    return table[Number(isKept)][Number(isBroken)] ?? table[Number(isMeanGood)][Number(!isMeanGood)];
}
