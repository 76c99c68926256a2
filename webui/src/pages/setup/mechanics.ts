import type { Mechanics } from '../../api/schema'

/** What was typed; the sent mechanics hold only the dimensions of the chosen kind. */
export interface Form {
  kind: Mechanics['kind']
  belt: 'diameter' | 'teeth'
  rack: 'module' | 'pitch'
  lead_mm: number | null
  diameter_mm: number | null
  pitch_mm: number | null
  module_mm: number | null
  teeth: number | null
  motor_turns: number | null
  load_turns: number | null
  resolution: number | null
}

export const KINDS = ['screw', 'belt', 'rack', 'rotary'] as const

export const START: Form = {
  kind: 'screw',
  belt: 'diameter',
  rack: 'module',
  lead_mm: null,
  diameter_mm: null,
  pitch_mm: null,
  module_mm: null,
  teeth: null,
  motor_turns: 1,
  load_turns: 1,
  resolution: 0.001,
}

type Dimension = 'lead_mm' | 'diameter_mm' | 'pitch_mm' | 'module_mm' | 'teeth'

function needed(form: Form): Dimension[] {
  switch (form.kind) {
    case 'screw':
      return ['lead_mm']
    case 'belt':
      return form.belt === 'diameter' ? ['diameter_mm'] : ['pitch_mm', 'teeth']
    case 'rack':
      return form.rack === 'module' ? ['module_mm', 'teeth'] : ['pitch_mm', 'teeth']
    case 'rotary':
      return []
  }
}

export function complete(form: Form): boolean {
  const always = [form.motor_turns, form.load_turns, form.resolution]
  return [...always, ...needed(form).map((name) => form[name])].every((value) => value !== null)
}

/** Only for a complete form. */
export function toMechanics(form: Form): Mechanics {
  const used = new Set(needed(form))
  const of = (name: Dimension) => (used.has(name) ? form[name] : null)
  return {
    kind: form.kind,
    lead_mm: of('lead_mm'),
    diameter_mm: of('diameter_mm'),
    pitch_mm: of('pitch_mm'),
    module_mm: of('module_mm'),
    teeth: of('teeth'),
    motor_turns: form.motor_turns ?? 1,
    load_turns: form.load_turns ?? 1,
    resolution: form.resolution ?? 0.001,
  }
}

export function formOf(mechanics: Mechanics): Form {
  return {
    ...START,
    kind: mechanics.kind,
    belt: mechanics.kind === 'belt' && mechanics.diameter_mm == null ? 'teeth' : 'diameter',
    rack: mechanics.kind === 'rack' && mechanics.module_mm == null ? 'pitch' : 'module',
    lead_mm: mechanics.lead_mm ?? null,
    diameter_mm: mechanics.diameter_mm ?? null,
    pitch_mm: mechanics.pitch_mm ?? null,
    module_mm: mechanics.module_mm ?? null,
    teeth: mechanics.teeth ?? null,
    motor_turns: mechanics.motor_turns ?? 1,
    load_turns: mechanics.load_turns ?? 1,
    resolution: mechanics.resolution ?? 0.001,
  }
}
