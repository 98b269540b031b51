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
 * @property {boolean} isListed - whether the list of runs has it
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

// Of Python: the digits of numbers, and the verdicts by what is known of a bound.
const {digits: DIGITS, verdicts: VERDICTS} = JSON.parse('{{ rules() | tojson }}');

const minus = (/** @type {string} */ text) => text.replaceAll("-", Number(text.replaceAll(",", "")) ? "−" : "");
const grouped = (/** @type {number} */ number) => number.toLocaleString("en-US");

/**
 * A number with so many decimals, as Python writes it: of two that are equally near, the even one. `Intl.NumberFormat`
 * rounds the shortest decimals of a number, and so makes 0.2 of 0.15, which is less than that.
 * @type {(number: number, decimals: number) => string}
 */
function fixed(number, decimals) {
    const rounded = number.toFixed(decimals), exact = number.toFixed(decimals + 40);
    const isTie = /50{39}$/.test(exact), isOdd = Number(rounded.at(-1)) % 2 === 1;
    return isTie && isOdd ? exact.slice(0, -40).replace(/\.$/, "") : rounded;
}

/** @param {number} share */
const percent = (share) => minus(fixed(100 * share, DIGITS.percent));

/** @param {number} number */
function quantity(number) {
    const size = Math.abs(number);
    if (size < DIGITS.zero) return "0";
    if (size >= DIGITS.whole) return minus(grouped(Number(fixed(number, 0))));
    const [mantissa, exponent] = number.toExponential(DIGITS.quantity - 1).split("e").map(Number);
    if (exponent < -4) return minus(`${mantissa}e-${String(-exponent).padStart(2, "0")}`);
    return minus(String(Number(fixed(number, DIGITS.quantity - 1 - exponent))));
}

/** @type {(metric: Metric, number: number) => string} */
const amount = (metric, number) => metric.percent ? percent(number) : quantity(number);

/** @type {(metric: Metric, number: number) => string} */
const written = (metric, number) => `${amount(metric, number)} ${metric.percent ? "%" : metric.unit}`.trim();

/** @type {(metric: Metric, estimate: Pick<Estimate, "mean" | "low" | "high">) => string} */
function interval(metric, {mean, low, high}) {
    const ends = [low, high].map((number) => Number.isFinite(number) ? amount(metric, number) : "?");
    return `${written(metric, mean)} [${ends.join(", ")}]`;
}

/**
 * A difference with its unit; shares differ by percentage points.
 * @type {(metric: Metric, estimate: Pick<Estimate, "mean" | "low" | "high">) => string}
 */
function difference(metric, {mean, low, high}) {
    const [middle, ...ends] = [mean, low, high].map((number) => signed(metric, number));
    return `${middle} [${ends.join(", ")}] ${unitOfDifference(metric)}`.trim();
}

/** @type {(metric: Metric) => string} */
const unitOfDifference = ({percent, unit}) => percent ? "points" : unit;

/** @type {(metric: Metric, number: number) => string} */
function signed(metric, number) {
    if (!Number.isFinite(number)) return "?";
    const text = amount(metric, number);
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
 * About how many missions bring the end of an interval as near to the mean as a distance. What was seen makes it
 * narrower with the root of their number; what allows for failures that were not, with the number itself.
 * @type {(count: number, gap: number, gapSeen: number, distance: number) => number}
 */
function missionsUntil(count, gap, gapSeen, distance) {
    const seen = Math.min(gap, gapSeen), allowed = gap - seen;
    return count * ((seen + Math.sqrt(seen ** 2 + 4 * allowed * distance)) / (2 * distance)) ** 2;
}

/** @param {number} missions */
const aboutMissions = (missions) => missions < 1e6 ? `about ${quantity(Number(missions.toPrecision(1)))}` : "far";

/**
 * How many more missions may decide a difference.
 * @type {(estimate: Estimate) => string}
 */
function moreMissions({mean, low, high, lowSeen, highSeen, count}) {
    const needed = missionsUntil(count, (high - low) / 2, (highSeen - lowSeen) / 2, Math.abs(mean)) - count;
    return needed > 0 ? `, ${aboutMissions(needed)} more missions` : "";
}

/** @type {(requirement: Requirement) => string} */
function requirementInWords({metric, bound}) {
    const text = metric.percent ? `${quantity(100 * bound)} %` : written(metric, bound);
    return `${metric.name} of at ${metric.less ? "most" : "least"} ${text}`;
}

/**
 * By how much a mean, or an end of its interval, keeps a bound; negative if it breaks it.
 * @type {(requirement: Requirement, number: number) => number}
 */
const roomOf = ({metric, bound}, number) => metric.less ? bound - number : number - bound;

/**
 * Whether a whole interval keeps a bound, breaks it, or neither. Both are known only within the
 * tolerance of the bound: there the mean decides.
 * @type {(requirement: Requirement, estimate: Estimate, tolerance?: number) => string}
 */
function verdict(requirement, {mean, low, high, count}, tolerance = 0) {
    const rooms = count ? [low, high].map((end) => roomOf(requirement, end)) : [NaN];
    const isKept = Math.min(...rooms) >= -tolerance, isBroken = Math.max(...rooms) < tolerance;
    const isMeanGood = roomOf(requirement, mean) >= 0, {table} = VERDICTS;
    return table[Number(isKept)][Number(isBroken)] ?? table[Number(isMeanGood)][Number(!isMeanGood)];
}

/**
 * About how many missions show whether a requirement is met, within its tolerance, if all are like those so far.
 * @type {(requirement: Requirement, estimate: Estimate) => number}
 */
function missionsToJudge(requirement, {mean, low, high, lowSeen, highSeen, count}) {
    const {tolerance} = requirement.metric, room = roomOf(requirement, mean), isGood = room >= 0;
    const gap = (/** @type {number[]} */ ...ends) => Math.max(...ends.map((end) =>
        isGood ? room - roomOf(requirement, end) : roomOf(requirement, end) - room));
    return missionsUntil(count, gap(low, high), gap(lowSeen, highSeen), Math.abs(room) + tolerance);
}
