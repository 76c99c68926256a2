import * as React from 'react'

/** A drawn element of the page, with the properties that it was given. */
export interface Drawn {
  type: string
  props: Record<string, unknown>
  children: (Drawn | string)[]
}

interface Hook {
  value?: unknown
  changes?: readonly unknown[] | undefined
  end?: (() => void) | undefined
  source?: unknown
  run?: (() => undefined | (() => void)) | undefined
}

interface Instance {
  type: unknown
  hooks: Hook[]
  drawn: number
}

interface Node {
  type: unknown
  key: string | null
  props: Record<string, unknown>
}

type Kind = { $$typeof: symbol; type?: unknown; render?: unknown; _context?: unknown }

const differs = (a: readonly unknown[] | undefined, b: readonly unknown[] | undefined) =>
  !a || !b || a.length !== b.length || a.some((each, i) => !Object.is(each, b[i]))

/** Turns of the event loop that answers of the page's requests may take. */
const TURNS = 8
const ROUNDS = 60

/**
 * Draws components without a browser: their hooks keep their values, effects run, and every change
 * draws them again. There are no elements behind references, which stay null.
 */
export class Page {
  tree: (Drawn | string)[] = []
  private readonly instances = new Map<string, Instance>()
  private readonly contexts = new Map<unknown, unknown>()
  private round = 0
  private changed = true
  private current: Instance | null = null
  private at = 0

  constructor(private element: React.ReactNode) {
    this.draw()
  }

  /** Draw again until nothing changes any more. */
  draw(): void {
    for (let left = ROUNDS; this.changed; left--) {
      if (left === 0) throw new Error('the page never comes to rest')
      this.changed = false
      this.round += 1
      const before = internals.H
      internals.H = this.dispatcher()
      try {
        this.tree = this.walk(this.element, '')
      } finally {
        internals.H = before
      }
      for (const [path, each] of this.instances) {
        if (each.drawn === this.round) continue
        for (const hook of each.hooks) hook.end?.()
        this.instances.delete(path)
      }
      for (const each of this.instances.values()) {
        for (const hook of each.hooks) {
          if (!hook.run) continue
          const { run } = hook
          hook.run = undefined
          hook.end?.()
          hook.end = run()
        }
      }
    }
  }

  /** Do something to the page, and wait for what it asks and draws because of it. */
  async after(act: () => unknown = () => undefined): Promise<this> {
    act()
    this.draw()
    for (let turn = 0; turn < TURNS; turn++) {
      await new Promise((resolve) => setImmediate(resolve))
      this.draw()
    }
    return this
  }

  /** Draw something else in the same place. */
  async show(element: React.ReactNode): Promise<this> {
    this.element = element
    this.changed = true
    return this.after()
  }

  all(wanted: string | ((each: Drawn) => boolean)): Drawn[] {
    const fits = typeof wanted === 'string' ? (each: Drawn) => each.type === wanted : wanted
    const found: Drawn[] = []
    const look = (nodes: (Drawn | string)[]) => {
      for (const node of nodes) {
        if (typeof node === 'string') continue
        if (fits(node)) found.push(node)
        look(node.children)
      }
    }
    look(this.tree)
    return found
  }

  one(wanted: string | ((each: Drawn) => boolean)): Drawn {
    const found = this.all(wanted)
    if (found.length !== 1 || !found[0]) throw new Error(`${found.length} elements fit`)
    return found[0]
  }

  /** The element of a type that has these words as its text, label or name. */
  named(type: string, words: string): Drawn {
    return this.one(
      (each) =>
        each.type === type &&
        [textOf(each), each.props.label, each.props['aria-label']].includes(words),
    )
  }

  text(): string {
    return this.tree.map(textOf).join('')
  }

  end(): void {
    this.element = null
    this.changed = true
    this.draw()
  }

  private walk(node: unknown, path: string): (Drawn | string)[] {
    if (node === null || node === undefined || typeof node === 'boolean') return []
    if (typeof node === 'string' || typeof node === 'number') return [String(node)]
    if (Array.isArray(node)) {
      return node.flatMap((each: unknown, i) => {
        const key = React.isValidElement(each) ? each.key : null
        return this.walk(each, `${path}/${key ?? i}`)
      })
    }
    const { type, key, props } = node as Node
    const below = `${path}<${key ?? ''}`
    if (typeof type === 'string') {
      const children = this.walk(props.children, below)
      return [{ type, props, children }]
    }
    if (typeof type === 'function') {
      return this.walk(this.call(type as (props: unknown) => unknown, props, below), below)
    }
    if (typeof type === 'object' && type !== null) {
      const kind = type as Kind
      const name = String(kind.$$typeof)
      if (name.includes('memo')) return this.walk({ type: kind.type, key: null, props }, below)
      if (name.includes('forward_ref')) {
        return this.walk(this.call(kind.render as (props: unknown) => unknown, props, below), below)
      }
      if (name.includes('context')) {
        const before = this.contexts.get(kind)
        this.contexts.set(kind, props.value)
        const drawn = this.walk(props.children, below)
        this.contexts.set(kind, before)
        return drawn
      }
    }
    return this.walk(props.children, below)
  }

  private call(type: (props: unknown) => unknown, props: unknown, path: string): unknown {
    let own = this.instances.get(path)
    if (own?.type !== type) {
      for (const hook of own?.hooks ?? []) hook.end?.()
      own = { type, hooks: [], drawn: 0 }
      this.instances.set(path, own)
    }
    own.drawn = this.round
    const [before, at] = [this.current, this.at]
    ;[this.current, this.at] = [own, 0]
    try {
      return type(props)
    } finally {
      ;[this.current, this.at] = [before, at]
    }
  }

  private hook(): [Hook, boolean] {
    if (!this.current) throw new Error('a hook outside a component')
    const at = this.at++
    const known = this.current.hooks[at]
    const hook = known ?? {}
    this.current.hooks[at] = hook
    return [hook, known === undefined]
  }

  private dispatcher(): object {
    const state = (reduce: (old: unknown, act: unknown) => unknown, start: () => unknown) => {
      const [hook, made] = this.hook()
      if (made) hook.value = start()
      hook.source ??= (act: unknown) => {
        const next = reduce(hook.value, act)
        if (Object.is(next, hook.value)) return
        hook.value = next
        this.changed = true
      }
      return [hook.value, hook.source]
    }
    const effect = (run: Hook['run'], changes?: readonly unknown[]) => {
      const [hook, made] = this.hook()
      if (made || differs(hook.changes, changes)) hook.run = run
      hook.changes = changes
    }
    const memo = (make: () => unknown, changes?: readonly unknown[]) => {
      const [hook, made] = this.hook()
      if (made || differs(hook.changes, changes)) hook.value = make()
      hook.changes = changes
      return hook.value
    }
    return {
      useState: (start: unknown) =>
        state(
          (old, act) => (typeof act === 'function' ? (act as (old: unknown) => unknown)(old) : act),
          () => (typeof start === 'function' ? (start as () => unknown)() : start),
        ),
      useReducer: (reduce: (old: unknown, act: unknown) => unknown, start: unknown) =>
        state(reduce, () => start),
      useEffect: effect,
      useLayoutEffect: effect,
      useInsertionEffect: effect,
      useMemo: memo,
      useCallback: (call: unknown, changes?: readonly unknown[]) => memo(() => call, changes),
      useRef: (start: unknown) => {
        const [hook, made] = this.hook()
        if (made) hook.value = { current: start }
        return hook.value
      },
      useId: () => memo(() => `id-${this.at}`, []),
      useDebugValue: () => undefined,
      useDeferredValue: (value: unknown) => value,
      useImperativeHandle: () => this.hook(),
      useContext: (context: { _currentValue: unknown }) =>
        this.contexts.has(context) ? this.contexts.get(context) : context._currentValue,
      useSyncExternalStore: (
        subscribe: (changed: () => void) => () => void,
        snapshot: () => unknown,
      ) => {
        const [hook] = this.hook()
        hook.value = snapshot()
        hook.run = hook.end
          ? undefined
          : () =>
              subscribe(() => {
                if (!Object.is(snapshot(), hook.value)) this.changed = true
              })
        return hook.value
      },
    }
  }
}

const internals = (
  React as unknown as Record<
    '__CLIENT_INTERNALS_DO_NOT_USE_OR_WARN_USERS_THEY_CANNOT_UPGRADE',
    { H: unknown }
  >
).__CLIENT_INTERNALS_DO_NOT_USE_OR_WARN_USERS_THEY_CANNOT_UPGRADE

export function textOf(node: Drawn | string): string {
  return typeof node === 'string' ? node : node.children.map(textOf).join('')
}

/** What a person does to an element: its handler is called as the browser would call it. */
export function press(element: Drawn, name = 'onClick', event: object = {}): void {
  const handler = element.props[name]
  if (typeof handler !== 'function') throw new Error(`the element has no ${name}`)
  ;(handler as (event: object) => void)(event)
}

/** Type or choose a value. */
export function type(element: Drawn, value: string): void {
  press(element, 'onChange', { currentTarget: { value }, target: { value } })
}
