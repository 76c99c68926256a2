import { useEffect, useReducer, useSyncExternalStore } from 'react'
import type {
  AxisState,
  DriveSummary,
  JobInfo,
  JogEnded,
  JogGap,
  LogEntry,
  ParameterRow,
  ParameterValue,
  Problem,
  ScopeChannelInfo,
  ScopeInfo,
  StopResult,
} from '../api/schema'
import { serverNow } from './server-clock'
import type { LinkState } from './worker/socket'
import type { TriggerState } from './worker/worker-messages'

/** What the server said last. Nothing here is ever a value that a person typed. */
interface Contents {
  link: LinkState
  everOpen: boolean
  /** When the connection was lost; null while there is one. What is shown is from then. */
  lostAt: number | null
  connection: string | null
  drives: DriveSummary[] | null
  jobs: Map<string, JobInfo>
  states: Map<string, AxisState>
  rows: Map<string, ParameterRow[]>
  readings: Map<string, Map<string, ParameterValue>>
  log: LogEntry[]
  jogEnded: JogEnded | null
  jogGap: JogGap | null
  /** What the server said of the subscriptions that there are, and of every channel ever asked. */
  scopeInfo: Map<number, ScopeInfo>
  scopeChannels: Map<string, ScopeChannelInfo>
  /** Of the scope, which seeks it on other pages too. */
  trigger: TriggerState
  refused: { request: string; problem: Problem; at: number } | null
  /** When the server last said that this page's STOP has gone out, and what it reached. */
  stopTaken: { press: number | null } | null
  stopReached: { press: number | null; result: StopResult } | null
}

const LOG_LENGTH = 500
/** Type of the problem of a job that the server has forgotten. */
export const FORGOTTEN = 'urn:servodeck:page:forgotten'

export const contents: Contents = {
  link: { open: false, attempt: 0, roundTripMs: null },
  everOpen: false,
  lostAt: null,
  connection: null,
  drives: null,
  jobs: new Map(),
  states: new Map(),
  rows: new Map(),
  readings: new Map(),
  log: [],
  jogEnded: null,
  jogGap: null,
  scopeInfo: new Map(),
  scopeChannels: new Map(),
  trigger: 'off',
  refused: null,
  stopTaken: null,
  stopReached: null,
}

const listeners = new Map<string, Set<() => void>>()

export function subscribe(topic: string, listener: () => void): () => void {
  let set = listeners.get(topic)
  if (!set) {
    set = new Set()
    listeners.set(topic, set)
  }
  set.add(listener)
  return () => set.delete(listener)
}

export function publish(topic: string): void {
  for (const listener of listeners.get(topic) ?? []) listener()
}

/** A value of the store that re-renders with its topic. `pick` must return the same object
 * while nothing changed. */
export function useStore<T>(topic: string, pick: () => T): T {
  return useSyncExternalStore((listener) => subscribe(topic, listener), pick)
}

export const useLink = () => useStore('link', () => contents.link)
export const useDrives = () => useStore('drives', () => contents.drives)
export const useDrive = (id: string | null) =>
  useStore('drives', () => contents.drives?.find((drive) => drive.id === id) ?? null)
export const useAxisState = (id: string | null) =>
  useStore(`state ${id}`, () => (id === null ? null : (contents.states.get(id) ?? null)))
/** The states of several axes; null for one that was not reported yet. */
export function useAxisStates(ids: readonly string[]): (AxisState | null)[] {
  const [, again] = useReducer((count: number) => count + 1, 0)
  const key = ids.join(' ')
  useEffect(() => {
    const ends = key.split(' ').map((id) => subscribe(`state ${id}`, again))
    return () => {
      for (const end of ends) end()
    }
  }, [key])
  return ids.map((id) => contents.states.get(id) ?? null)
}
export const useJobs = () => useStore('jobs', () => contents.jobs)
export const useJob = (id: string | null) =>
  useStore('jobs', () => (id === null ? null : (contents.jobs.get(id) ?? null)))
export const useLog = () => useStore('log', () => contents.log)
export const useReading = (drive: string, key: string) =>
  useStore(`value ${drive} ${key}`, () => contents.readings.get(drive)?.get(key) ?? null)
export const useOriginalRows = (drive: string) =>
  useStore(`rows ${drive}`, () => contents.rows.get(drive) ?? null)
export const useReadings = (drive: string) =>
  useStore(`values ${drive}`, () => contents.readings.get(drive) ?? null)

/** Keep word of the connection. Without one nothing that was said before is current any more. */
export function setLink(link: LinkState, now: number): void {
  contents.link = link
  contents.everOpen ||= link.open
  if (link.open) contents.lostAt = null
  else if (contents.everOpen && contents.lostAt === null) {
    contents.lostAt = now
    for (const state of contents.states.values()) {
      const old = { ...state, fresh: false, problem: '', problem_message: null }
      contents.states.set(state.drive, old)
      former.add(old)
      publish(`state ${state.drive}`)
    }
    for (const readings of contents.readings.values()) {
      for (const value of readings.values()) former.add(value)
    }
  }
  publish('link')
}

/** What distinguishes a drive from another one that has its id. */
export interface DriveIdentity {
  profile: string
  serial: number | null
  /** Bus and station of each port. */
  places: string[]
}

function identityOf(drive: DriveSummary): DriveIdentity {
  const { profile, serial, ports } = drive as Pick<DriveSummary, 'profile'> & Partial<DriveSummary>
  const places = (ports ?? []).map(({ url, station }) => `${url} ${station}`)
  return { profile, serial: serial ?? null, places }
}

/** By the serial numbers; where a drive has none, by its place. */
export function sameDrive(one: DriveIdentity, other: DriveIdentity): boolean {
  if (one.profile !== other.profile) return false
  if (one.serial !== null && other.serial !== null) return one.serial === other.serial
  const placed = one.places.length > 0 && other.places.length > 0
  return !placed || one.places.some((place) => other.places.includes(place))
}

const identities = new Map<string, DriveIdentity>()

/** Ids that have another drive now, or none. A serial number that was said once is kept. */
function identify(drives: DriveSummary[]): string[] {
  const changed: string[] = []
  for (const [id, was] of [...identities]) {
    const drive = drives.find((each) => each.id === id)
    if (drive && sameDrive(was, identityOf(drive))) continue
    identities.delete(id)
    changed.push(id)
  }
  for (const drive of drives) {
    const now = identityOf(drive)
    identities.set(drive.id, {
      ...now,
      serial: now.serial ?? identities.get(drive.id)?.serial ?? null,
    })
  }
  return changed
}

/** The drive that has an id now; null where that is not known. */
export const identityNow = (id: string): DriveIdentity | null => identities.get(id) ?? null

/**
 * The drives as they are now. An id is used again: of one that is gone, or that another drive has
 * now, nothing that was said holds. Returns those that are there and of which more was known.
 */
export function setDrives(drives: DriveSummary[]): string[] {
  const changed = identify(drives)
  contents.drives = drives
  const again: string[] = []
  for (const id of changed) {
    const known = contents.rows.delete(id)
    contents.states.delete(id)
    contents.readings.delete(id)
    if (known && drives.some((each) => each.id === id)) again.push(id)
    for (const act of goneListeners) act(id)
  }
  publish('drives')
  for (const id of changed) {
    for (const topic of ['state', 'rows', 'values']) publish(`${topic} ${id}`)
  }
  return again
}

const goneListeners: ((drive: string) => void)[] = []

/** Called with a drive of which nothing that was said holds any more. */
export function whenGone(act: (drive: string) => void): void {
  goneListeners.push(act)
}

/** What was said over a connection that is lost: the next word of it replaces it. */
const former = new WeakSet<AxisState | ParameterValue>()
/** No answer is overtaken by more than this: the clock of the server was set back. */
const OVERTAKEN_MS = 5000

/**
 * Whether something was overtaken on its way by what is known already. `streamed`: it came over
 * the websocket, which keeps the order; only an answer to a request may have been faster.
 */
function overtaken(
  known: AxisState | ParameterValue,
  time: string | null,
  streamed: boolean,
): boolean {
  if (former.has(known) || !known.time) return false
  if (!time) return true
  const behind = Date.parse(known.time) - Date.parse(time)
  return behind > 0 && !(streamed && behind > OVERTAKEN_MS)
}

export function setState(state: AxisState, streamed = false): void {
  const known = contents.states.get(state.drive)
  if (known && overtaken(known, state.time, streamed)) return
  contents.states.set(state.drive, state)
  publish(`state ${state.drive}`)
}

/** What was refused is asked for again: the refusal must not stand above what it now does. */
export function askedAgain(request: string): void {
  if (contents.refused?.request !== request) return
  contents.refused = null
  publish('refused')
}

/** A job that has ended stays ended: the answer to its start may come after word of its end. */
export function setJob(job: JobInfo): void {
  const known = contents.jobs.get(job.id)
  if (known && known.state !== 'running' && job.state === 'running') return
  contents.jobs = new Map(contents.jobs).set(job.id, job)
  publish('jobs')
}

export const runningJobs = () =>
  [...contents.jobs.values()].filter((job) => job.state === 'running').map((job) => job.id)

/** Jobs that ran at `before` and that the server does not know any more: it was restarted. */
export function endForgotten(before: string[], known: JobInfo[]): void {
  for (const id of before) {
    const job = contents.jobs.get(id)
    if (!job || job.state !== 'running' || known.some((each) => each.id === id)) continue
    const problem = { type: FORGOTTEN, title: job.title, status: 0, detail: '' }
    setJob({ ...job, state: 'failed', ended: new Date(serverNow()).toISOString(), problem })
  }
}

export function setRows(drive: string, rows: ParameterRow[]): void {
  contents.rows.set(drive, rows)
  setReadings(
    drive,
    rows.map((row) => row.reading),
  )
  publish(`rows ${drive}`)
}

/** Newer readings replace older ones; an answer that was overtaken on its way changes nothing. */
export function setReadings(drive: string, values: ParameterValue[], streamed = false): void {
  const known = new Map(contents.readings.get(drive))
  const changed: string[] = []
  for (const value of values) {
    const old = known.get(value.key)
    if (old && overtaken(old, value.time, streamed)) continue
    known.set(value.key, value)
    changed.push(value.key)
  }
  contents.readings.set(drive, known)
  for (const key of changed) publish(`value ${drive} ${key}`)
  publish(`values ${drive}`)
}

export function setScopeInfo(info: ScopeInfo): void {
  contents.scopeInfo = new Map(contents.scopeInfo).set(info.subscription, info)
  const channels = new Map(contents.scopeChannels)
  for (const each of info.channels) channels.set(`${each.drive} ${each.key}`, each)
  contents.scopeChannels = channels
  publish('scopeInfo')
}

/** Only these subscriptions are left; what was said of others is old. */
export function keepScopeInfo(subscriptions: number[]): void {
  const kept = [...contents.scopeInfo].filter(([number]) => subscriptions.includes(number))
  contents.scopeInfo = new Map(kept)
  publish('scopeInfo')
}

export function addLog(entries: LogEntry[]): void {
  contents.log = [...contents.log, ...entries].slice(-LOG_LENGTH)
  publish('log')
}
