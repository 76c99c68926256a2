import { Button, NativeSelect } from '@mantine/core'
import { useEffect, useRef, useState } from 'react'
import { api, ask } from '../../api/client'
import type { BrakingInfo, Regeneration, ResistorModel } from '../../api/schema'
import { type T, useT } from '../../i18n'
import { useReading } from '../../live/store'
import { figure } from '../../widgets/numbers/format'
import { NumberField } from '../../widgets/numbers/NumberField'
import { Panel } from '../../widgets/layout/Panel'
import { ParameterFields } from '../../widgets/parameters/ParameterFields'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useAction } from '../../widgets/requests/useAction'
import { useWrong } from '../../widgets/numbers/useWrong'
import { useRemembered } from '../../widgets/browser/remembered'
import { useGains } from '../response/design/useGains'

const NO_MODEL: ResistorModel = {
  model: '',
  resistance_ohm: null,
  power_w: null,
  min_external_ohm: null,
  max_external_w: null,
  capacitor_j: null,
}

/** Braking energy of a cycle against what this drive can take. */
export function RegenerationPanel({ drive, regen }: { drive: string; regen: Regeneration | null }) {
  const t = useT()
  const models = regen?.models ?? []
  const [name, setName] = useState('')
  const model = models.find((each) => each.model === name) ?? NO_MODEL
  const gains = useGains(drive).gains
  const threshold = useReading(drive, regen?.on_voltage_key ?? '')?.value
  const [inertia, setInertia] = useState<number | null>(null)
  const [speed, setSpeed] = useRemembered(drive, 'regen.speed', 1000)
  const [time, setTime] = useRemembered(drive, 'regen.time', 0.1)
  const [cycle, setCycle] = useRemembered(drive, 'regen.cycle', 1)
  const [stops, setStops] = useRemembered(drive, 'regen.stops', 2)
  const [fall, setFall] = useState<number | null>(0)
  const [limits, setLimits] = useState<ResistorModel>(NO_MODEL)
  const [voltage, setVoltage] = useState<number | null>(null)
  const [result, setResult] = useState<BrakingInfo | null>(null)
  const act = useAction()
  const wrong = useWrong()
  useEffect(() => setLimits(model), [name])
  useEffect(() => {
    const known = gains?.inertia_kgm2
    if (known) setInertia((old) => old ?? Number(known.toPrecision(4)))
  }, [gains?.inertia_kgm2])
  useEffect(() => {
    if (typeof threshold === 'number' && threshold > 0) setVoltage((old) => old ?? threshold)
  }, [threshold])
  const inputs = [inertia, speed, time, cycle, stops, fall, limits, voltage]
  /** Counts the changes of the form: an answer to what stood there before is dropped. */
  const changes = useRef(0)
  useEffect(() => {
    changes.current++
    setResult(null)
  }, inputs)
  const calculate = () =>
    act.run(async () => {
      if (inertia === null || speed === null || time === null || cycle === null) return
      const asked = changes.current
      const found = await ask(
        api.POST('/api/v1/calculate/braking', {
          body: {
            inertia_kgm2: inertia,
            speed_rpm: speed,
            deceleration_s: time,
            cycle_s: cycle,
            stops_per_cycle: stops ?? 2,
            efficiency: 1,
            fall_energy_j: fall ?? 0,
            capacitor_j: limits.capacitor_j ?? 0,
            built_in_ohm: limits.resistance_ohm ?? null,
            built_in_w: limits.power_w ?? null,
            min_external_ohm: limits.min_external_ohm ?? null,
            max_external_w: limits.max_external_w ?? null,
            on_voltage_v: voltage,
          },
        }),
      )
      if (asked === changes.current) setResult(found)
    })
  const limit = (key: Exclude<keyof ResistorModel, 'model'>, label: string, unit: string) => (
    <NumberField
      label={label}
      unit={unit}
      value={limits[key] ?? null}
      onChange={(value) => setLimits({ ...limits, [key]: value })}
      onWrong={wrong.of(key)}
      min={0}
      optional
    />
  )
  return (
    <div className="columns">
      <Panel title={t('regen.title')}>
        <p className="prose">{t('regen.help')}</p>
        <div className="fields">
          <NumberField
            label={t('regen.inertia')}
            unit="kg·m²"
            value={inertia}
            onChange={setInertia}
            above={0}
          />
          <NumberField
            label={t('regen.speed')}
            unit="rpm"
            value={speed}
            onChange={setSpeed}
            above={0}
          />
          <NumberField label={t('regen.time')} unit="s" value={time} onChange={setTime} above={0} />
          <NumberField
            label={t('regen.cycle')}
            unit="s"
            value={cycle}
            onChange={setCycle}
            above={0}
          />
          <NumberField label={t('regen.stops')} value={stops} onChange={setStops} above={0} />
          <NumberField label={t('regen.fall')} unit="J" value={fall} onChange={setFall} min={0} />
        </div>
        {models.length > 0 && (
          <NativeSelect
            label={t('regen.model')}
            value={name}
            onChange={(event) => setName(event.currentTarget.value)}
            data={[
              { value: '', label: t('regen.otherModel') },
              ...models.map((each) => ({ value: each.model, label: each.model })),
            ]}
          />
        )}
        <div className="fields">
          {limit('capacitor_j', t('regen.capacitor'), 'J')}
          {limit('resistance_ohm', t('regen.builtOhm'), 'Ω')}
          {limit('power_w', t('regen.builtPower'), 'W')}
          {limit('min_external_ohm', t('regen.minOhm'), 'Ω')}
          {limit('max_external_w', t('regen.maxPower'), 'W')}
          <NumberField
            label={t('regen.voltage')}
            unit="V"
            value={voltage}
            onChange={setVoltage}
            onWrong={wrong.of('voltage')}
            above={0}
            optional
          />
        </div>
        <Button
          variant="filled"
          disabled={wrong.any || [inertia, speed, time, cycle, stops, fall].includes(null)}
          loading={act.busy}
          onClick={() => void calculate()}
        >
          {t('regen.calculate')}
        </Button>
        <ProblemNote problem={act.problem} onClose={act.clear} />
        {result && <Result result={result} />}
        {regen?.notes && (
          <p className="dim">
            <ProfileText drive={drive} text={regen.notes} />
          </p>
        )}
        {regen && <p className="dim">{t('source', { source: regen.source })}</p>}
      </Panel>
      {regen && (regen.keys ?? []).length > 0 && (
        <Panel title={t('regen.settings')}>
          <ParameterFields drive={drive} keys={regen.keys ?? []} />
        </Panel>
      )}
    </div>
  )
}

function Result({ result }: { result: BrakingInfo }) {
  const t = useT()
  const good = result.verdict === 'capacitor' || result.verdict === 'built_in'
  const facts: [string, string][] = [
    [t('regen.kinetic'), `${figure(result.kinetic_j, 4)} J`],
    [t('regen.excess'), `${figure(result.excess_j, 4)} J`],
    [t('regen.average'), `${figure(result.average_w, 3)} W`],
    [t('regen.peak'), `${figure(result.peak_w, 3)} W`],
  ]
  return (
    <div
      className={`note ${good ? 'good' : result.verdict === 'external' ? 'warn' : 'fault'}`}
      role="status"
    >
      <p>
        <strong>
          {t(`regen.verdict.${result.verdict}`, {
            power: figure(result.external_w ?? result.average_w, 3),
            range: ohms(t, result.min_ohm, result.max_ohm),
          })}
        </strong>
      </p>
      {!result.possible && result.verdict === 'external' && <p>{t('regen.impossible')}</p>}
      <dl className="facts num">
        {facts.map(([name, text]) => (
          <div key={name} className="pair">
            <dt>{name}</dt>
            <dd>{text}</dd>
          </div>
        ))}
      </dl>
    </div>
  )
}

function ohms(t: T, min: number | null, max: number | null): string {
  const low = min === null ? null : figure(min, 3)
  const high = max === null ? null : figure(max, 3)
  if (low !== null && high !== null) return t('regen.between', { min: low, max: high })
  if (low !== null) return t('regen.from', { min: low })
  if (high !== null) return t('regen.upTo', { max: high })
  return t('regen.anyOhm')
}
