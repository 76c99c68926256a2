import type { ChatLine, CursorMoved, LeaseNotice, PeopleHere, PointerMoved } from '../api/schema'
import { publish, useStore } from './store'

/** People on the station, as the server said last. */
interface People {
  here: PeopleHere | null
  notices: (LeaseNotice & { at: number })[]
  pointers: Map<string, PointerMoved>
  cursors: Map<string, CursorMoved>
  chat: ChatLine[]
}

const CHAT_KEPT = 200
const NOTICES_KEPT = 4

export const people: People = {
  here: null,
  notices: [],
  pointers: new Map(),
  cursors: new Map(),
  chat: [],
}

export const usePeople = () => useStore('people', () => people.here)
export const useNotices = () => useStore('notices', () => people.notices)
export const usePointers = () => useStore('pointers', () => people.pointers)
export const useChat = () => useStore('chat', () => people.chat)

export function setPeople(here: PeopleHere): void {
  people.here = here
  const known = new Set(here.people.map((each) => each.connection))
  forget(people.pointers, known, 'pointers', (next) => (people.pointers = next))
  forget(people.cursors, known, 'cursors', (next) => (people.cursors = next))
  publish('people')
}

/** Who is gone points at nothing. */
function forget<T extends { connection: string }>(
  all: Map<string, T>,
  known: Set<string>,
  topic: string,
  set: (next: Map<string, T>) => void,
): void {
  const left = new Map([...all].filter(([, each]) => known.has(each.connection)))
  if (left.size === all.size) return
  set(left)
  publish(topic)
}

export function addNotice(notice: LeaseNotice): void {
  people.notices = [...people.notices, { ...notice, at: Date.now() }].slice(-NOTICES_KEPT)
  publish('notices')
}

export function dropNotice(at: number): void {
  people.notices = people.notices.filter((each) => each.at !== at)
  publish('notices')
}

export function setPointer(moved: PointerMoved): void {
  people.pointers = new Map(people.pointers).set(moved.connection, moved)
  publish('pointers')
}

export function setCursor(moved: CursorMoved): void {
  const cursors = new Map(people.cursors)
  const key = `${moved.connection} ${moved.plot}`
  if (moved.x === null) cursors.delete(key)
  else cursors.set(key, moved)
  people.cursors = cursors
  publish('cursors')
}

export function addChat(lines: ChatLine[]): void {
  const byNumber = new Map(people.chat.map((each) => [each.number, each]))
  for (const line of lines) byNumber.set(line.number, line)
  people.chat = [...byNumber.values()].sort((a, b) => a.number - b.number).slice(-CHAT_KEPT)
  publish('chat')
}
