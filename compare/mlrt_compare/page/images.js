// Images of the report: how they are stored, and how floats become colours.

// Bytes of deflated base64 text.
async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Words of 32 bits whose bytes are stored plane by plane, the lowest first.
function words(bytes) {
  const count = bytes.length / 4;
  const result = new Uint32Array(count);
  for (let i = 0; i < count; i++) {
    result[i] = bytes[i] | (bytes[count + i] << 8) | (bytes[2 * count + i] << 16) |
      (bytes[3 * count + i] << 24);
  }
  return result;
}

async function decodeImages(data) {
  const first = words(await inflate(data.images[0]));
  const second = words(await inflate(data.images[1]));
  // The second is stored as its difference in bits from the first.
  for (let i = 0; i < second.length; i++) second[i] ^= first[i];
  const cost = data.cost === null ? null : words(await inflate(data.cost));
  return {
    width: data.width,
    height: data.height,
    first: new Float32Array(first.buffer),
    second: new Float32Array(second.buffer),
    cost: cost && new Float32Array(cost.buffer),
  };
}

// Codes of sRGB for linear values from 0 to 1, by their square roots: fine in the dark.
const CODES = 8192;
const SRGB = Uint8ClampedArray.from({ length: CODES + 1 }, (_, i) => {
  const linear = (i / CODES) ** 2;
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);
});

function code(linear) {
  return SRGB[Math.round(CODES * Math.sqrt(Math.min(Math.max(linear, 0), 1)))];
}

// The colour map inferno at equal distances, of matplotlib (CC0).
const STOPS = [
  [0, 0, 4], [31, 12, 72], [85, 15, 109], [136, 34, 106], [186, 54, 85], [227, 89, 51],
  [249, 140, 10], [249, 201, 50], [252, 255, 164],
];

function heat(share, out, at) {
  const place = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
  const stop = Math.min(Math.floor(place), STOPS.length - 2);
  for (let c = 0; c < 3; c++) {
    out[at + c] = STOPS[stop][c] + (place - stop) * (STOPS[stop + 1][c] - STOPS[stop][c]);
  }
}

function magenta(out, at) {
  out[at] = 255; out[at + 1] = 0; out[at + 2] = 255;
}

// RGBA of an image of floats; what is not finite becomes magenta.
function developed(image, exposure) {
  const gain = 2 ** exposure;
  const out = new Uint8ClampedArray(image.length / 3 * 4).fill(255);
  for (let p = 0, i = 0; i < image.length; p += 4, i += 3) {
    if (isFinite(image[i] + image[i + 1] + image[i + 2])) {
      for (let c = 0; c < 3; c++) out[p + c] = code(gain * image[i + c]);
    } else {
      magenta(out, p);
    }
  }
  return out;
}

// RGBA of the difference of two images, taken on their float values. `white` is the
// difference that is shown with full brightness. Signed: orange where the first is brighter,
// blue where the second is. Absolute and relative (to the larger): logarithmic, over four
// powers of ten below `white`.
function differences(first, second, kind, white) {
  const out = new Uint8ClampedArray(first.length / 3 * 4).fill(255);
  for (let p = 0, i = 0; i < first.length; p += 4, i += 3) {
    let mean = 0, largest = 0;
    for (let c = 0; c < 3; c++) {
      const a = first[i + c], b = second[i + c];
      const delta = a - b;
      mean += delta / 3;
      const scale = kind === "relative" ? Math.max(Math.abs(a), Math.abs(b)) || 1 : 1;
      largest = Math.max(largest, Math.abs(delta) / scale);
      if (!isFinite(delta)) largest = NaN;
    }
    if (!isFinite(mean) || Number.isNaN(largest)) {
      magenta(out, p);
    } else if (kind === "signed") {
      const strength = Math.abs(mean) / white;
      const hue = mean > 0 ? [1, 0.55, 0.1] : [0.2, 0.55, 1];
      for (let c = 0; c < 3; c++) out[p + c] = code(strength * hue[c]);
    } else {
      heat(largest > 0 ? 1 + Math.log10(largest / white) / 4 : 0, out, p);
    }
  }
  return out;
}

function quantile(values, share) {
  const sorted = values.slice().sort();
  return sorted[Math.floor(share * (sorted.length - 1))];
}

// RGBA of the traversal cost as a heat map from 0 to `most`.
function costMap(cost, most) {
  const out = new Uint8ClampedArray(cost.length * 4).fill(255);
  for (let i = 0; i < cost.length; i++) heat(cost[i] / most, out, 4 * i);
  return out;
}
