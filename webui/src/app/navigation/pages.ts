import { type ComponentType, lazy, type LazyExoticComponent } from 'react'
import { arrived } from '../notes/arrived'
import type { AxisPage, BenchPage } from './router'

type Shown<Props> = LazyExoticComponent<ComponentType<Props>> & { fetch: () => Promise<unknown> }

/** A page whose code comes when it is first shown, or ahead of that. */
function page<Props extends object>(load: () => Promise<ComponentType<Props>>): Shown<Props> {
  const module = async () => ({ default: await arrived(load) })
  // A failed fetch ahead is of no consequence: showing the page asks again.
  return Object.assign(lazy(module), { fetch: () => load().catch(() => null) })
}

export const AXIS: Record<AxisPage, Shown<{ drive: string }>> = {
  overview: page(async () => (await import('../../pages/overview/OverviewPage')).OverviewPage),
  parameters: page(
    async () => (await import('../../pages/parameters/ParametersPage')).ParametersPage,
  ),
  motion: page(async () => (await import('../../pages/motion/MotionPage')).MotionPage),
  tune: page(async () => (await import('../../pages/tune/TunePage')).TunePage),
  response: page(async () => (await import('../../pages/response/ResponsePage')).ResponsePage),
  gains: page(async () => (await import('../../pages/gains/GainsPage')).GainsPage),
  setup: page(async () => (await import('../../pages/setup/SetupPage')).SetupPage),
  io: page(async () => (await import('../../pages/io/IoPage')).IoPage),
  alarms: page(async () => (await import('../../pages/alarms/AlarmsPage')).AlarmsPage),
}

export const BENCH: Record<BenchPage, Shown<object>> = {
  connect: page(async () => (await import('../../pages/connect/ConnectPage')).ConnectPage),
  scope: page(async () => (await import('../../pages/scope/ScopePage')).ScopePage),
  rerun: page(async () => (await import('../../pages/rerun/RerunPage')).RerunPage),
  scene: page(async () => (await import('../../pages/scene/ScenePage')).ScenePage),
  files: page(async () => (await import('../../pages/files/FilesPage')).FilesPage),
  audit: page(async () => (await import('../../pages/audit/AuditPage')).AuditPage),
  people: page(async () => (await import('../../pages/people/PeoplePage')).PeoplePage),
}

/** After the first page has been drawn and its data asked for. */
const AHEAD_MS = 3000
let ahead = false

/**
 * Fetch the code of every page once there is a connection and nothing else to do: where the
 * Wi-Fi ends, the pages are there already, and going to one takes no time.
 */
export function fetchAhead(): void {
  if (ahead) return
  ahead = true
  setTimeout(() => void fetchAll(), AHEAD_MS)
}

/** One after the other: what the page says and hears has the line before them. */
async function fetchAll(): Promise<void> {
  for (const each of [...Object.values(AXIS), ...Object.values(BENCH)]) await each.fetch()
}
