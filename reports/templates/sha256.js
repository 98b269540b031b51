// The SHA-256 hash of bytes, as hexadecimal digits; browsers offer none on pages opened as files.

const [SHA_START, SHA_ROUNDS] = (() => {
    const primes = [];
    for (let n = 2; primes.length < 64; n++) if (primes.every((prime) => n % prime)) primes.push(n);
    const fraction = (root) => Math.floor((root - Math.floor(root)) * 2 ** 32);
    // The cube roots of primes below 2^9 have 30 bits of fraction and more in a double.
    return [primes.slice(0, 8).map((prime) => fraction(Math.sqrt(prime))), primes.map((prime) => fraction(Math.cbrt(prime)))];
})();

function sha256(bytes) {
    const length = Math.ceil((bytes.length + 9) / 64) * 64;
    const padded = new Uint8Array(length);
    padded.set(bytes);
    padded[bytes.length] = 0x80;
    const view = new DataView(padded.buffer);
    view.setUint32(length - 8, Math.floor(bytes.length / 2 ** 29));
    view.setUint32(length - 4, bytes.length << 3);
    const hash = Uint32Array.from(SHA_START), words = new Uint32Array(64);
    const turn = (word, bits) => (word >>> bits) | (word << (32 - bits));
    for (let block = 0; block < length; block += 64) {
        for (let n = 0; n < 16; n++) words[n] = view.getUint32(block + 4 * n);
        for (let n = 16; n < 64; n++) {
            const before = words[n - 15], last = words[n - 2];
            words[n] = words[n - 16] + words[n - 7]
                + (turn(before, 7) ^ turn(before, 18) ^ (before >>> 3))
                + (turn(last, 17) ^ turn(last, 19) ^ (last >>> 10));
        }
        let [a, b, c, d, e, f, g, h] = hash;
        for (let n = 0; n < 64; n++) {
            const one = h + (turn(e, 6) ^ turn(e, 11) ^ turn(e, 25)) + ((e & f) ^ (~e & g)) + SHA_ROUNDS[n] + words[n];
            const two = (turn(a, 2) ^ turn(a, 13) ^ turn(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
            [h, g, f, e, d, c, b, a] = [g, f, e, (d + one) | 0, c, b, a, (one + two) | 0];
        }
        [a, b, c, d, e, f, g, h].forEach((word, n) => { hash[n] += word; });
    }
    return [...hash].map((word) => word.toString(16).padStart(8, "0")).join("");
}
