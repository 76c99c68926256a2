import { Checkbox } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../../api/client'
import type { ToolInfo } from '../../../../api/schema'
import { useLanguage } from '../../../../i18n'
import { NumberField } from '../../../../widgets/numbers/NumberField'
import type { Wrong } from '../../../../widgets/numbers/useWrong'
import type { Limits } from '../../../response/plot/limits'
import { MotionWarning } from '../../steps/MotionWarning'
import { warnsOfMotion } from './toolMotion'
import { unitOf } from './toolUnit'

/** What the form of the limits asks for already. */
const LIMITS = new Set([
  'travel_limit',
  'speed_limit',
  'torque_limit',
  'time_limit_s',
  'rated_torque_nm',
  'cycle_ms',
  'consent',
])

interface Field {
  name: string
  type: 'number' | 'integer' | 'boolean'
  optional: boolean
  limits: { min?: number; max?: number; above?: number }
  initial: number | boolean | null
}

interface Property {
  type?: string
  anyOf?: Property[]
  default?: unknown
  minimum?: number
  maximum?: number
  exclusiveMinimum?: number
}

/** The fields of a tool's own settings, from its JSON schema. */
export function fieldsOf(settings: Record<string, unknown>): Field[] {
  const properties = (settings.properties ?? {}) as Record<string, Property>
  return Object.entries(properties).flatMap(([name, property]): Field[] => {
    const shape = property.anyOf?.find((each) => each.type !== 'null') ?? property
    const { type } = shape
    if (LIMITS.has(name) || (type !== 'number' && type !== 'integer' && type !== 'boolean')) {
      return []
    }
    const initial = property.default
    return [
      {
        name,
        type,
        optional: property.anyOf !== undefined,
        limits: {
          ...(shape.minimum !== undefined && { min: shape.minimum }),
          ...(shape.maximum !== undefined && { max: shape.maximum }),
          ...(shape.exclusiveMinimum !== undefined && { above: shape.exclusiveMinimum }),
        },
        initial: typeof initial === 'number' || typeof initial === 'boolean' ? initial : null,
      },
    ]
  })
}

export type Values = Record<string, number | boolean | null>

let asked: Promise<ToolInfo[]> | undefined

/** All tools, asked for once; again after a request that failed. */
function tools(): Promise<ToolInfo[]> {
  asked ??= ask(api.GET('/api/v1/tools')).catch((error: unknown) => {
    asked = undefined
    throw error
  })
  return asked
}

/** A tool as the server describes it, and its texts in the language of the page. */
export function useTool(kind: string) {
  const [tool, setTool] = useState<ToolInfo | null>(null)
  const column = useLanguage() === 'zh' ? 1 : 0
  useEffect(() => {
    let current = true
    // Without an answer there is no panel; the page says that the server is silent.
    tools().then(
      (all) => current && setTool(all.find((each) => each.kind === kind) ?? null),
      () => undefined,
    )
    return () => {
      current = false
    }
  }, [kind])
  const text = (name: string, values: Record<string, string> = {}) =>
    (tool?.texts[name]?.[column] ?? name).replace(
      /\{(\w+)\}/g,
      (whole: string, key: string) => values[key] ?? whole,
    )
  return { tool, text }
}

/** The form of a tool's own settings, and the warning of its motion within the limits. */
export function ToolForm({
  tool,
  limits,
  fields,
  values,
  wrong,
  text,
  onChange,
}: {
  tool: ToolInfo
  /** null: none are permitted yet, or the tool has its own. */
  limits: Limits | null
  fields: Field[]
  values: Values
  wrong: Wrong
  text: (name: string) => string
  onChange: (values: Values) => void
}) {
  const set = (name: string, value: number | boolean | null) =>
    onChange({ ...values, [name]: value })
  return (
    <>
      <div className="fields">
        {fields.map((field) =>
          field.type === 'boolean' ? (
            <Checkbox
              key={field.name}
              label={text(`field.${field.name}`)}
              checked={values[field.name] === true}
              onChange={(event) => set(field.name, event.currentTarget.checked)}
            />
          ) : (
            <NumberField
              key={field.name}
              label={text(`field.${field.name}`)}
              {...unitOf(field.name, text)}
              {...field.limits}
              value={typeof values[field.name] === 'number' ? (values[field.name] as number) : null}
              onChange={(value) => set(field.name, value)}
              onWrong={wrong.of(field.name)}
              integer={field.type === 'integer'}
              optional={field.optional}
            />
          ),
        )}
      </div>
      {limits && warnsOfMotion(tool) && <MotionWarning limits={limits} />}
    </>
  )
}

/** Whether every field that must have a value has one. */
export const complete = (fields: Field[], values: Values): boolean =>
  fields.every(({ name, optional }) => optional || values[name] !== null)

export const initialValues = (fields: Field[]): Values =>
  Object.fromEntries(fields.map((field) => [field.name, field.initial]))
