import { expect, test } from 'vitest'
import type { SafetyResult } from '../../../../api/schema'
import { notesOf, rowsOf } from './safety'

const text = (name: string, values?: Record<string, string>) =>
  `${name} ${Object.values(values ?? {}).join(' ')}`.trim()

const made = (changed: Partial<SafetyResult>): SafetyResult =>
  ({
    tool: 'safety-check',
    function: 'sto',
    verdict: 'within_limits',
    device: 'S1',
    person: 'Ann',
    measured_at: '2026-11-25T10:00:00+00:00',
    torque_noise_percent: 0.3,
    ...changed,
  }) as SafetyResult

test('a record always says that it is no certificate, and whether it is signed', () => {
  for (const verdict of ['within_limits', 'torque_remains'] as const) {
    const words = notesOf(made({ verdict }), text).map((each) => each.words)
    expect(words).toContain('no_certificate')
    expect(words).toContain('unsigned')
  }
  const signature = { person: 'Ben', signed: '2026-11-25T11:00:00', sha256: 'f', intact: false }
  const words = notesOf(made({ signature: { ...signature, notes: '' } }), text)
  expect(words.map((each) => each.words)).toContain('signature_broken')
})

test('only what is within given limits is shown as good', () => {
  const tone = (changed: Partial<SafetyResult>) => notesOf(made(changed), text)[0]?.tone
  expect(tone({})).toBe('good')
  expect(tone({ verdict: 'recorded' })).toBe('info')
  expect(tone({ verdict: 'not_triggered' })).toBe('warn')
  expect(tone({ verdict: 'not_shown', obstacle: 'torque_in_noise' })).toBe('warn')
})

test('what could not be shown has a row without a value', () => {
  const rows = rowsOf(made({ torque_free_ms: null, stop_ms: 90 }), text)
  expect(rows.find((each) => each.name === 'torque_free')?.value).toBeNull()
  expect(rows.find((each) => each.name === 'stop_time')?.value).toBe(90)
  const limit = rowsOf(made({ function: 'limit_positive' }), text)
  expect(limit.map((each) => each.name)).not.toContain('torque_free')
})
