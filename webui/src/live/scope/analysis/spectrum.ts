export const WINDOWS = ['hann', 'flattop', 'rectangle'] as const
export type WindowKind = (typeof WINDOWS)[number]

export interface Peak {
  frequency: number
  amplitude: number
}

/** Amplitudes of the sines in a signal: a sine of amplitude A shows as A. */
export interface Spectrum {
  frequency: Float64Array
  amplitude: Float64Array
  /** Greatest first, placed between the lines. */
  peaks: Peak[]
  sampleRate: number
  samples: number
  /** Spacing of independent lines; padding makes the drawn ones denser. */
  resolution: number
  /** The samples were not equally spaced and were put onto a grid. */
  resampled: boolean
}

export interface Spectrogram {
  times: Float64Array
  frequency: Float64Array
  /** Column after column, amplitudes. */
  amplitude: Float64Array
  resampled: boolean
}

const MOST_SAMPLES = 1 << 18
const FEWEST_SAMPLES = 16
const PEAKS = 8
/** Peaks below this part of the greatest one are noise for the eye. */
const FAINTEST = 0.005
/**
 * Spacing may differ by this part before samples are put onto a grid. Cycles of a bus are equally
 * spaced though their time stamps waver; a cycle that is missing shows all the same.
 */
export const EVEN = { polled: 0.02, synchronous: 0.45 }

/** In place; the length is a power of two. Decimation in time (Cooley and Tukey, 1965). */
export function fft(re: Float64Array, im: Float64Array): void {
  const n = re.length
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1
    for (; j & bit; bit >>= 1) j ^= bit
    j ^= bit
    if (i < j) {
      ;[re[i], re[j]] = [re[j] as number, re[i] as number]
      ;[im[i], im[j]] = [im[j] as number, im[i] as number]
    }
  }
  const cos = new Float64Array(n / 2)
  const sin = new Float64Array(n / 2)
  for (let k = 0; k < n / 2; k++) {
    cos[k] = Math.cos((2 * Math.PI * k) / n)
    sin[k] = -Math.sin((2 * Math.PI * k) / n)
  }
  for (let size = 2; size <= n; size *= 2) {
    const half = size / 2
    const stride = n / size
    for (let begin = 0; begin < n; begin += size) {
      for (let k = 0; k < half; k++) {
        const [c, s] = [cos[k * stride] as number, sin[k * stride] as number]
        const [a, b] = [begin + k, begin + k + half]
        const [xr, xi] = [re[b] as number, im[b] as number]
        const tr = xr * c - xi * s
        const ti = xr * s + xi * c
        re[b] = (re[a] as number) - tr
        im[b] = (im[a] as number) - ti
        re[a] = (re[a] as number) + tr
        im[a] = (im[a] as number) + ti
      }
    }
  }
}

/** Samples of a window for spectra (periodic; flat top after D'Antona and Ferrero, 2006). */
function weights(kind: WindowKind, n: number): Float64Array {
  const terms = {
    rectangle: [1],
    hann: [0.5, -0.5],
    flattop: [0.21557895, -0.41663158, 0.277263158, -0.083578947, 0.006947368],
  }[kind]
  return Float64Array.from({ length: n }, (_, i) =>
    terms.reduce((sum, a, k) => sum + a * Math.cos((2 * Math.PI * k * i) / n), 0),
  )
}

/** Equally spaced samples, and whether they had to be made so. */
function evenly(
  times: Float64Array,
  values: Float64Array,
  tolerance = EVEN.polled,
): { values: Float64Array; interval: number; resampled: boolean } | null {
  const n = Math.min(times.length, MOST_SAMPLES)
  if (n < FEWEST_SAMPLES) return null
  const [t, v] = [times.subarray(times.length - n), values.subarray(values.length - n)]
  const first = t[0] as number
  const interval = ((t[n - 1] as number) - first) / (n - 1)
  if (!(interval > 0)) return null
  let even = true
  for (let i = 1; i < n && even; i++) {
    even = Math.abs((t[i] as number) - (t[i - 1] as number) - interval) <= tolerance * interval
  }
  if (even) return { values: v, interval, resampled: false }
  const grid = new Float64Array(n)
  for (let i = 0, k = 1; i < n; i++) {
    const time = Math.min(first + i * interval, t[n - 1] as number)
    while (k < n - 1 && (t[k] as number) < time) k++
    const [t0, t1] = [t[k - 1] as number, t[k] as number]
    const part = t1 > t0 ? (time - t0) / (t1 - t0) : 1
    grid[i] = (v[k - 1] as number) * (1 - part) + (v[k] as number) * part
  }
  return { values: grid, interval, resampled: true }
}

function powerOfTwo(n: number): number {
  return 2 ** Math.ceil(Math.log2(n))
}

/** One-sided amplitudes of windowed samples, padded with zeros to a power of two. */
function amplitudes(values: Float64Array, window: Float64Array, length: number): Float64Array {
  const re = new Float64Array(length)
  const im = new Float64Array(length)
  const mean = values.reduce((sum, value) => sum + value, 0) / values.length
  let gain = 0
  for (let i = 0; i < values.length; i++) {
    const weight = window[i] as number
    gain += weight
    // Without its mean, or that would hide the slow lines next to it.
    re[i] = ((values[i] as number) - mean) * weight
  }
  fft(re, im)
  const found = new Float64Array(length / 2 + 1)
  for (let k = 1; k < found.length; k++) {
    const sides = k === length / 2 ? 1 : 2
    found[k] = (sides * Math.hypot(re[k] as number, im[k] as number)) / gain
  }
  found[0] = Math.abs(mean)
  return found
}

/** Null where there are too few samples. `times` in seconds, `values` without gaps. */
export function spectrum(
  times: Float64Array,
  values: Float64Array,
  kind: WindowKind,
  tolerance = EVEN.polled,
): Spectrum | null {
  const even = evenly(times, values, tolerance)
  if (!even) return null
  const n = even.values.length
  const length = Math.min(2 * MOST_SAMPLES, 2 * powerOfTwo(n))
  const amplitude = amplitudes(even.values, weights(kind, n), length)
  const line = 1 / (length * even.interval)
  return {
    frequency: Float64Array.from(amplitude, (_, k) => k * line),
    amplitude,
    peaks: peaks(amplitude, line, length / n),
    sampleRate: 1 / even.interval,
    samples: n,
    resolution: 1 / (n * even.interval),
    resampled: even.resampled,
  }
}

/** Local maxima, each placed by a parabola through its three points in logarithm. */
function peaks(amplitude: Float64Array, line: number, padding: number): Peak[] {
  const greatest = amplitude.subarray(1).reduce((a, b) => Math.max(a, b), 0)
  const found: Peak[] = []
  // Lines nearer to zero than the window is wide are the mean's, not a sine's.
  for (let k = Math.ceil(padding); k < amplitude.length - 1; k++) {
    const [a, b, c] = [amplitude[k - 1], amplitude[k], amplitude[k + 1]] as [number, number, number]
    if (!(b > a && b >= c) || b < FAINTEST * greatest) continue
    const [la, lb, lc] = [a, b, c].map((x) => Math.log(Math.max(x, 1e-300))) as [
      number,
      number,
      number,
    ]
    const bend = la - 2 * lb + lc
    const shift = bend < 0 ? (la - lc) / (2 * bend) : 0
    found.push({
      frequency: (k + shift) * line,
      amplitude: Math.exp(lb - ((la - lc) * shift) / 4),
    })
  }
  return found.sort((x, y) => y.amplitude - x.amplitude).slice(0, PEAKS)
}

/** About `columns` spectra one after the other, each half over the next, Hann. */
export function spectrogram(
  times: Float64Array,
  values: Float64Array,
  columns: number,
  tolerance = EVEN.polled,
): Spectrogram | null {
  const even = evenly(times, values, tolerance)
  if (!even) return null
  const n = even.values.length
  const size = Math.max(FEWEST_SAMPLES, Math.min(4096, powerOfTwo((2 * n) / columns)))
  if (n < size) return null
  const count = Math.min(columns, 1 + Math.floor((n - size) / Math.max(1, size / 4)))
  const window = weights('hann', size)
  const rows = size / 2 + 1
  const amplitude = new Float64Array(rows * count)
  const middles = new Float64Array(count)
  const begin = (times[times.length - 1] as number) - (n - 1) * even.interval
  for (let column = 0; column < count; column++) {
    const start = count > 1 ? Math.round((column * (n - size)) / (count - 1)) : 0
    const part = even.values.subarray(start, start + size)
    amplitude.set(amplitudes(part, window, size), column * rows)
    middles[column] = begin + (start + size / 2) * even.interval
  }
  return {
    times: middles,
    frequency: Float64Array.from({ length: rows }, (_, k) => k / (size * even.interval)),
    amplitude,
    resampled: even.resampled,
  }
}
