/**
 * The language of computed channels: numbers, channels (`c1`, `m2`), + − * / ^, brackets and a
 * fixed set of functions. Parsed into a tree; nothing of it is ever run as a program.
 */
export type Node =
  | { kind: 'number'; value: number }
  | { kind: 'channel'; name: string }
  | { kind: 'negative'; of: Node }
  | { kind: 'binary'; operator: '+' | '-' | '*' | '/' | '^'; left: Node; right: Node }
  | { kind: 'call'; name: FunctionName; of: Node[] }

/** Number of arguments of each function. */
export const FUNCTIONS = {
  abs: 1,
  sqrt: 1,
  sign: 1,
  sin: 1,
  cos: 1,
  min: 2,
  max: 2,
  bit: 2,
  derivative: 1,
  integral: 1,
  lowpass: 2,
  highpass: 2,
  mean: 2,
} as const
type FunctionName = keyof typeof FUNCTIONS
/** Functions whose second argument is a setting: a number, not a signal. */
const CONSTANT_SECOND: readonly FunctionName[] = ['bit', 'lowpass', 'highpass', 'mean']
const DEEPEST = 40

type ExpressionProblem =
  'empty' | 'unexpected' | 'end' | 'unknown' | 'arguments' | 'constant' | 'deep'

/** What is wrong, and with which part of the text. */
export class ExpressionError extends Error {
  constructor(
    readonly problem: ExpressionProblem,
    readonly part: string,
    readonly position: number,
  ) {
    super(`${problem}: ${part} at ${position}`)
  }
}

interface Token {
  kind: 'number' | 'name' | 'sign'
  text: string
  position: number
}

function tokens(text: string): Token[] {
  const pattern = /\s*(?:(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?)|([a-z]\w*)|(.))/giy
  const found: Token[] = []
  for (let match = pattern.exec(text); match; match = pattern.exec(text)) {
    const [whole, number, name, sign] = match
    const part = (number ?? name ?? sign) as string
    const position = match.index + whole.length - part.length
    found.push({
      kind: number !== undefined ? 'number' : name !== undefined ? 'name' : 'sign',
      text: part.replace('−', '-').replace('·', '*').replace('×', '*'),
      position,
    })
  }
  return found
}

/** Parse a text. Throws ExpressionError. */
export function parse(text: string): Node {
  if (text.trim() === '') throw new ExpressionError('empty', '', 0)
  const parser = new Parser(tokens(text), text.length)
  return parser.whole()
}

class Parser {
  private at = 0
  private depth = 0

  constructor(
    private readonly all: Token[],
    private readonly length: number,
  ) {}

  whole(): Node {
    const node = this.sum()
    const rest = this.all[this.at]
    if (rest) throw new ExpressionError('unexpected', rest.text, rest.position)
    return node
  }

  private sum(): Node {
    if (++this.depth > DEEPEST) {
      throw new ExpressionError('deep', '', this.all[this.at]?.position ?? this.length)
    }
    let node = this.product()
    for (let sign = this.sign('+-'); sign; sign = this.sign('+-')) {
      node = { kind: 'binary', operator: sign as '+' | '-', left: node, right: this.product() }
    }
    this.depth--
    return node
  }

  private product(): Node {
    let node = this.signed()
    for (let sign = this.sign('*/'); sign; sign = this.sign('*/')) {
      node = { kind: 'binary', operator: sign as '*' | '/', left: node, right: this.signed() }
    }
    return node
  }

  private signed(): Node {
    let negative = false
    for (let sign = this.sign('+-'); sign; sign = this.sign('+-')) {
      if (sign === '-') negative = !negative
    }
    const base = this.primary()
    const node: Node = this.sign('^')
      ? { kind: 'binary', operator: '^', left: base, right: this.signed() }
      : base
    return negative ? { kind: 'negative', of: node } : node
  }

  private primary(): Node {
    const token = this.all[this.at++]
    if (!token) throw new ExpressionError('end', '', this.length)
    if (token.kind === 'number') return { kind: 'number', value: Number(token.text) }
    if (token.text === '(') {
      const node = this.sum()
      this.need(')')
      return node
    }
    if (token.kind !== 'name') {
      throw new ExpressionError('unexpected', token.text, token.position)
    }
    const name = token.text.toLowerCase()
    if (name === 'pi') return { kind: 'number', value: Math.PI }
    if (/^[cm]\d{1,3}$/.test(name)) return { kind: 'channel', name }
    if (!Object.hasOwn(FUNCTIONS, name)) {
      throw new ExpressionError('unknown', token.text, token.position)
    }
    return this.call(name as FunctionName, token)
  }

  private call(name: FunctionName, token: Token): Node {
    this.need('(')
    const of = [this.sum()]
    while (this.sign(',')) of.push(this.sum())
    this.need(')')
    if (of.length !== FUNCTIONS[name]) {
      throw new ExpressionError('arguments', name, token.position)
    }
    if (CONSTANT_SECOND.includes(name) && channelsOf(of[1] as Node).length > 0) {
      throw new ExpressionError('constant', name, token.position)
    }
    return { kind: 'call', name, of }
  }

  private sign(signs: string): string | null {
    const token = this.all[this.at]
    if (token?.kind !== 'sign' || !signs.includes(token.text)) return null
    this.at++
    return token.text
  }

  private need(sign: string): void {
    if (this.sign(sign)) return
    const token = this.all[this.at]
    throw token
      ? new ExpressionError('unexpected', token.text, token.position)
      : new ExpressionError('end', sign, this.length)
  }
}

/** Channels that are named, each once, in the order of the text. */
export function channelsOf(node: Node): string[] {
  switch (node.kind) {
    case 'number':
      return []
    case 'channel':
      return [node.name]
    case 'negative':
      return channelsOf(node.of)
    case 'binary':
      return [...new Set([...channelsOf(node.left), ...channelsOf(node.right)])]
    case 'call':
      return [...new Set(node.of.flatMap(channelsOf))]
  }
}

/** A tree that takes one time and one value of each channel after the other. */
export type Step = (time: number, value: (channel: string) => number) => number

/** Make it ready to run; derivative, integral and filters begin with their first sample. */
export function compile(node: Node): Step {
  switch (node.kind) {
    case 'number':
      return () => node.value
    case 'channel':
      return (_time, value) => value(node.name)
    case 'negative': {
      const of = compile(node.of)
      return (time, value) => -of(time, value)
    }
    case 'binary': {
      const [left, right] = [compile(node.left), compile(node.right)]
      const apply = OPERATORS[node.operator]
      return (time, value) => apply(left(time, value), right(time, value))
    }
    case 'call': {
      const first = compile(node.of[0] as Node)
      const second = node.of[1] && compile(node.of[1])
      const apply = STEPS[node.name]()
      return (time, value) => apply(first(time, value), second?.(time, value) ?? 0, time)
    }
  }
}

const OPERATORS: Record<'+' | '-' | '*' | '/' | '^', (a: number, b: number) => number> = {
  '+': (a, b) => a + b,
  '-': (a, b) => a - b,
  '*': (a, b) => a * b,
  '/': (a, b) => a / b,
  '^': (a, b) => a ** b,
}

type Apply = (x: number, setting: number, time: number) => number

const STEPS: Record<FunctionName, () => Apply> = {
  abs: () => Math.abs,
  sqrt: () => Math.sqrt,
  sign: () => Math.sign,
  sin: () => Math.sin,
  cos: () => Math.cos,
  min: () => Math.min,
  max: () => Math.max,
  bit: () => (x, bit) => (Number.isFinite(x) ? Math.abs(Math.floor(x / 2 ** bit) % 2) : x),
  derivative,
  integral,
  lowpass,
  highpass: () => {
    const low = lowpass()
    return (x, hz, time) => x - low(x, hz, time)
  },
  mean,
}

/** Slope from the sample before, per second. */
function derivative(): Apply {
  let before: { x: number; time: number } | null = null
  return (x, _, time) => {
    const last = before
    before = Number.isFinite(x) ? { x, time } : null
    return last && before && time > last.time ? (x - last.x) / (time - last.time) : Number.NaN
  }
}

/** By the trapezoidal rule, in seconds, from the first sample on; what is not valid is left out. */
function integral(): Apply {
  let sum = 0
  let before: { x: number; time: number } | null = null
  return (x, _, time) => {
    if (!Number.isFinite(x)) return x
    if (before) sum += ((x + before.x) / 2) * (time - before.time)
    before = { x, time }
    return sum
  }
}

/** First order, its corner at `hz`; exact for an input that is held between samples. */
function lowpass(): Apply {
  let y = Number.NaN
  let last = 0
  return (x, hz, time) => {
    if (!Number.isFinite(x)) return x
    if (!Number.isFinite(y)) y = x
    else y += (x - y) * -Math.expm1(-2 * Math.PI * hz * (time - last))
    last = time
    return y
  }
}

/** Of the samples of the last `seconds`. */
function mean(): Apply {
  const window: { x: number; time: number }[] = []
  let sum = 0
  let begin = 0
  return (x, seconds, time) => {
    if (!Number.isFinite(x)) return x
    window.push({ x, time })
    sum += x
    for (
      let oldest = window[begin];
      oldest && oldest.time <= time - seconds && begin < window.length - 1;
      oldest = window[begin]
    ) {
      sum -= oldest.x
      begin++
    }
    if (begin > 4096) {
      window.splice(0, begin)
      begin = 0
      // Rounding does not add up over hours.
      sum = window.reduce((all, each) => all + each.x, 0)
    }
    return sum / (window.length - begin)
  }
}
