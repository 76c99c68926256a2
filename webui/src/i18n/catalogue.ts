import { axis } from './texts/axis'
import { bench } from './texts/bench'
import { box } from './texts/box'
import { drive } from './texts/drive'
import { frame } from './texts/frame'
import { functions } from './texts/functions'
import { handover } from './texts/handover'
import { health } from './texts/health'
import { library } from './texts/library'
import { notListed } from './texts/notlisted'
import { motionClass } from './texts/motion-class'
import { parameters } from './texts/parameters'
import { people } from './texts/people'
import { preflight } from './texts/preflight'
import { recordings } from './texts/recordings'
import { imported } from './texts/imported'
import { scales } from './texts/scales'
import { scene } from './texts/scene'
import { scope } from './texts/scope'
import { segment } from './texts/segment'
import { tour } from './texts/tour'
import { tuning } from './texts/tuning'
import { unwatched } from './texts/unwatched'

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
