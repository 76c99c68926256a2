import * as React from 'react'
import { isValidElement, type ReactElement, type ReactNode } from 'react'

type Props = Record<string, unknown>
type Run = () => (() => void) | undefined
type Component<P> = (props: P) => ReactNode
type Element = ReactElement<Props>
interface Effect {
  deps: unknown[] | undefined
  end: (() => void) | undefined
}

/** The slot in which React looks for its hooks; there is no other way to run them without a DOM. */
const internals = (React as unknown as Record<string, { H: unknown }>)
  .__CLIENT_INTERNALS_DO_NOT_USE_OR_WARN_USERS_THEY_CANNOT_UPGRADE as { H: unknown }

const same = (a: unknown[] | undefined, b: unknown[] | undefined) =>
  a !== undefined && b?.length === a.length && a.every((each, i) => Object.is(each, b[i]))

/**
 * One component with its state and effects, without a DOM and without the components inside it:
 * these are elements with the props that it gives them.
 */
export class Shallow<P> {
  private readonly cells: unknown[] = []
  private at = 0
  private todo: (() => void)[] = []
  private dirty = false
  private tree: ReactNode = null

  constructor(
    private readonly component: Component<P>,
    private props: P,
  ) {
    this.render()
  }

  /** Other props, as its parent gives them. */
  update(props: P): void {
    this.props = props
    this.render()
  }

  private render(): void {
    for (let round = 0; round < 50; round++) {
      this.dirty = false
      this.at = 0
      const before = internals.H
      internals.H = this.hooks
      try {
        this.tree = this.component(this.props)
      } finally {
        internals.H = before
      }
      const effects = this.todo
      this.todo = []
      for (const run of effects) run()
      if (!this.dirty) return
    }
    throw new Error('drawn again without end')
  }

  /** Do something, wait for what follows from it, and draw again. */
  async act(work: () => unknown = () => {}): Promise<void> {
    await work()
    await new Promise((done) => setTimeout(done))
    this.render()
  }

  unmount(): void {
    for (const cell of this.cells) (cell as Effect | null)?.end?.()
  }

  /** All elements of a component or tag, by its name. */
  all(name: string): Element[] {
    return elements(this.tree).filter(({ type }) => nameOf(type) === name)
  }

  /** The only element of that name, or the first for which `fits` holds. */
  the(name: string, fits: (props: Props) => boolean = () => true): Element {
    const found = this.all(name).find(({ props }) => fits(props))
    if (!found) throw new Error(`no ${name}`)
    return found
  }

  has(name: string): boolean {
    return this.all(name).length > 0
  }

  /** All text that it writes itself. */
  get text(): string {
    return texts(this.tree).join(' ')
  }

  private cell<T>(make: () => T): T {
    const at = this.at++
    if (!(at in this.cells)) this.cells[at] = make()
    return this.cells[at] as T
  }

  private memo<T>(make: () => T, deps: unknown[] | undefined): T {
    const cell = this.cell<{ value: T; deps: unknown[] | undefined }>(() => ({
      value: make(),
      deps,
    }))
    if (!same(cell.deps, deps)) Object.assign(cell, { value: make(), deps })
    return cell.value
  }

  private effect(run: Run, deps?: unknown[]): void {
    const known = this.at in this.cells
    const cell = this.cell<Effect>(() => ({ deps, end: undefined }))
    if (known && same(cell.deps, deps)) return
    cell.deps = deps
    this.todo.push(() => {
      cell.end?.()
      cell.end = run()
    })
  }

  private reducer<S, A>(reduce: (state: S, action: A) => S, first: () => S): [S, (a: A) => void] {
    const cell = this.cell(() => {
      const made: { state: S; send: (action: A) => void } = { state: first(), send: () => {} }
      made.send = (action) => {
        const next = reduce(made.state, action)
        if (!Object.is(next, made.state)) this.dirty = true
        made.state = next
      }
      return made
    })
    return [cell.state, cell.send]
  }

  private readonly hooks = {
    useState: <S>(first: S | (() => S)) =>
      this.reducer(
        (old: S, next: S | ((old: S) => S)) =>
          typeof next === 'function' ? (next as (old: S) => S)(old) : next,
        () => (typeof first === 'function' ? (first as () => S)() : first),
      ),
    useReducer: <S, A>(reduce: (state: S, action: A) => S, first: S) =>
      this.reducer(reduce, () => first),
    useRef: <T>(first: T) => this.cell(() => ({ current: first })),
    useMemo: <T>(make: () => T, deps?: unknown[]) => this.memo(make, deps),
    useCallback: <T>(act: T, deps?: unknown[]) => this.memo(() => act, deps),
    useEffect: (run: Run, deps?: unknown[]) => this.effect(run, deps),
    useLayoutEffect: (run: Run, deps?: unknown[]) => this.effect(run, deps),
    useInsertionEffect: (run: Run, deps?: unknown[]) => this.effect(run, deps),
    useSyncExternalStore: <T>(_subscribe: unknown, read: () => T) => read(),
    useContext: (context: { _currentValue: unknown }) => context._currentValue,
    useId: () => 'id',
    useDebugValue: () => {},
  }
}

const nameOf = (type: unknown): string =>
  typeof type === 'string'
    ? type
    : ((type as { displayName?: string }).displayName?.replace('@mantine/core/', '') ??
      (type as { name?: string }).name ??
      '')

function elements(node: unknown): Element[] {
  if (Array.isArray(node)) return node.flatMap(elements)
  if (!isValidElement(node)) return []
  const element = node as Element
  return [element, ...Object.values(element.props).flatMap(elements)]
}

function texts(node: unknown): string[] {
  if (typeof node === 'string' || typeof node === 'number') return [String(node)]
  if (Array.isArray(node)) return node.flatMap(texts)
  return isValidElement(node) ? texts((node as Element).props.children) : []
}

/** A component that another one has drawn, by itself. */
export const inside = (element: Element): Shallow<Props> =>
  new Shallow(element.type as Component<Props>, element.props)
