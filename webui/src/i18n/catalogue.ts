import { axis } from './texts/axis/axis'
import { bench } from './texts/connect/bench'
import { box } from './texts/connect/box'
import { drive } from './texts/axis/drive'
import { frame } from './texts/frame/frame'
import { functions } from './texts/axis/functions'
import { handover } from './texts/records/handover'
import { health } from './texts/tuning/health'
import { library } from './texts/records/library'
import { notListed } from './texts/connect/notlisted'
import { motionClass } from './texts/axis/motion-class'
import { parameters } from './texts/axis/parameters'
import { people } from './texts/frame/people'
import { preflight } from './texts/connect/preflight'
import { recordings } from './texts/records/recordings'
import { imported } from './texts/tuning/imported'
import { scales } from './texts/axis/scales'
import { scene } from './texts/frame/scene'
import { scope } from './texts/records/scope'
import { segment } from './texts/connect/segment'
import { tour } from './texts/frame/tour'
import { tuning } from './texts/tuning/tuning'
import { unwatched } from './texts/axis/unwatched'

/** Every text of the page, in every language. A key that is not here does not compile. */
export const catalogue = {
  ...frame,
  ...bench,
  ...box,
  ...axis,
  ...drive,
  ...functions,
  ...handover,
  ...health,
  ...motionClass,
  ...parameters,
  ...people,
  ...preflight,
  ...recordings,
  ...library,
  ...notListed,
  ...scales,
  ...tour,
  ...scene,
  ...scope,
  ...segment,
  ...tuning,
  ...imported,
  ...unwatched,
}
export type Key = keyof typeof catalogue
