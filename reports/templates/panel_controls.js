// What a reader sets: the sliders of a setting, and perhaps its policy.

class Controls {
    /**
     * @param {any} root
     * @param {string} side - the beginning of the names of the inputs
     * @param {Pick<Setting, "key" | "texts" | "unit">[]} settings
     */
    constructor(root, side, settings) {
        this.settings = settings;
        this.sliders = settings.map(({key}) => root.querySelector(`[name="${side}-${key}"]`));
        this.policy = root.querySelector(`[name="${side}-policy"]`);
    }

    get positions() {
        return this.sliders.map(({value}) => Number(value));
    }

    /** @returns {Choice} */
    get choice() {
        return {positions: this.positions, policy: this.policy.value};
    }

    /** @param {Choice} choice */
    set choice({positions, policy}) {
        this.sliders.forEach((slider, n) => { slider.value = positions[n]; });
        this.policy.value = policy;
    }

    // Say beside each slider what it is set to, and mark those that are elsewhere than these.
    show(others = this.positions) {
        this.positions.forEach((position, n) => {
            const {texts, unit} = this.settings[n], text = `${texts[position]} ${unit}`.trim(), slider = this.sliders[n];
            slider.setAttribute("aria-valuetext", text);
            slider.parentElement.querySelector("output").textContent = text;
            slider.parentElement.classList.toggle("differs", position !== others[n]);
        });
    }
}

/** @type {(input: any, text?: string) => number} */
function priceOf(input, text = input.value) {
    if (text === "" && input.placeholder !== "") return NaN; // a lost UAV costs what it was bought for
    const price = Math.min(Math.max(Number(text) || 0, Number(input.min)), Number(input.max));
    return input.step === "1" ? Math.round(price) : price;
}

class Prices {
    /**
     * @param {any} root
     * @param { {name: string, label: string}[]} prices
     * @param {string[]} others - what commands say of prices beside them
     */
    constructor(root, prices, others) {
        this.prices = prices;
        this.others = others;
        this.inputs = prices.map(({name}) => root.querySelector(`[name="price-${name}"]`));
    }

    get amounts() {
        return this.inputs.map((input) => priceOf(input));
    }

    set amounts(amounts) {
        this.inputs.forEach((input, n) => { input.value = Number.isNaN(amounts[n]) ? "" : amounts[n]; });
    }

    // What commands say: those that have a price of their own, as `uav=20000`, and what is beside them.
    get options() {
        const priced = this.prices.flatMap(({name}, n) => Number.isNaN(this.amounts[n]) ? [] : [`${name}=${this.amounts[n]}`]);
        return [...priced, ...this.others];
    }

    /**
     * Those that are not the page's own, in words.
     * @param {number[]} amounts
     */
    changesInWords(amounts) {
        return this.prices.flatMap(({label}, n) => Object.is(amounts[n], priceOf(this.inputs[n], this.inputs[n].defaultValue))
            ? [] : [`${label} ${Number.isNaN(amounts[n]) ? this.inputs[n].placeholder : quantity(amounts[n])}`]);
    }
}
