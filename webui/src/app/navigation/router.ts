import { useSyncExternalStore } from 'react'

export const AXIS_PAGES = [
  'overview',
  'parameters',
  'motion',
  'tune',
  'response',
  'gains',
  'setup',
  'io',
  'alarms',
] as const
export const BENCH_PAGES = [
  'connect',
  'scope',
  'rerun',
  'scene',
  'files',
  'audit',
  'people',
] as const
export type AxisPage = (typeof AXIS_PAGES)[number]
export type BenchPage = (typeof BENCH_PAGES)[number]
export type Page = AxisPage | BenchPage

interface Route {
  page: Page
  /** The axis of an axis page; on other pages the axis chosen last. */
  drive: string | null
  /** What of the page was asked for, as a parameter's key; null for the page as it is. */
  part: string | null
}

let lastDrive: string | null = null
let route: Route = read()

function read(): Route {
  const parts = window.location.hash.replace(/^#\/?/, '').split('/').map(decoded)
  if (parts[0] === 'axis' && parts[1]) {
    lastDrive = parts[1]
    const page = AXIS_PAGES.find((name) => name === parts[2]) ?? 'overview'
    return { page, drive: lastDrive, part: parts[3] || null }
  }
  const page = BENCH_PAGES.find((name) => name === parts[0]) ?? 'connect'
  return { page, drive: lastDrive, part: null }
}

/** A guest's place is followed by a click: what is no address must not keep the page from opening. */
function decoded(part: string): string {
  try {
    return decodeURIComponent(part)
  } catch {
    return part
  }
}

export const isAxisPage = (page: Page): page is AxisPage =>
  (AXIS_PAGES as readonly string[]).includes(page)

export function href(page: Page, drive: string | null, part = ''): string {
  if (!isAxisPage(page)) return `#/${page}`
  const whole = `#/axis/${encodeURIComponent(drive ?? '')}/${page}`
  return part === '' ? whole : `${whole}/${encodeURIComponent(part)}`
}

export function go(page: Page, drive: string | null = lastDrive): void {
  window.location.hash = href(page, drive).slice(1)
}

/** Choose an axis without leaving a page that is not about one. */
export function chooseDrive(drive: string | null): void {
  lastDrive = drive
  if (isAxisPage(route.page) && drive !== null) go(route.page, drive)
  else changed()
}

const listeners = new Set<() => void>()

function changed(): void {
  const next = read()
  const same = next.page === route.page && next.drive === route.drive && next.part === route.part
  if (!same) route = next
  for (const listener of listeners) listener()
}

window.addEventListener('hashchange', changed)

export function useRoute(): Route {
  return useSyncExternalStore(
    (listener) => {
      listeners.add(listener)
      return () => listeners.delete(listener)
    },
    () => route,
  )
}
