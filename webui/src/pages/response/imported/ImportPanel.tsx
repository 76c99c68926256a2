import { Button, FileButton, NativeSelect, useComputedColorScheme } from '@mantine/core'
import { useMemo, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { RecordingPreview } from '../../../api/schema'
import { useT } from '../../../i18n'
import { figure } from '../../../widgets/numbers/format'
import { Icon } from '../../../widgets/layout/Icon'
import { NumberField } from '../../../widgets/numbers/NumberField'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useAction } from '../../../widgets/requests/useAction'
import { useWrong, type Wrong } from '../../../widgets/numbers/useWrong'
import { TRACE_COLORS } from '../../scope/setup/channels'
import {
  guessed,
  INPUT_UNITS,
  OUTPUT_UNITS,
  type Said,
  statable,
  STRUCTURES,
  TIME_UNITS,
} from './imports'
import { StepPlot } from '../plot/StepPlot'

const NO_TIME = ''
const asFile = {
  bodySerializer: (body: unknown) => body as BodyInit,
  headers: { 'Content-Type': 'application/octet-stream' },
}

/** A recording of another program: choose its columns, say what they are, evaluate and store. */
export function ImportPanel({ onStored }: { onStored: (file: string) => void }) {
  const t = useT()
  const act = useAction()
  const [file, setFile] = useState<File | null>(null)
  const [found, setFound] = useState<RecordingPreview | null>(null)
  const [said, setSaid] = useState<Said | null>(null)
  const wrong = useWrong()
  const choose = (next: File) => {
    setFile(null)
    setFound(null)
    void act.run(async () => {
      const answer = await ask(
        api.POST('/api/v1/measurements/import/preview', {
          params: { query: { name: next.name.slice(-200) } },
          body: next as never,
          ...asFile,
        }),
      )
      setFile(next)
      setFound(answer)
      setSaid(guessed(answer))
    })
  }
  const go = () =>
    act.run(async () => {
      if (!file || !said) return
      const answer = await ask(
        api.POST('/api/v1/measurements/import', {
          params: { query: { ...said, name: file.name.slice(-200) } },
          body: file as never,
          ...asFile,
        }),
      )
      onStored(answer.file)
    })
  return (
    <Panel
      title={t('import.title')}
      tools={
        <FileButton onChange={(next) => next && choose(next)}>
          {(props) => (
            <Button {...props} loading={act.busy} leftSection={<Icon name="upload" />}>
              {t('import.choose')}
            </Button>
          )}
        </FileButton>
      }
    >
      <p className="dim">{t('import.help')}</p>
      {file && found && said && (
        <>
          <p className="num">
            <strong>{file.name}</strong>{' '}
            <span className="dim">{t('import.rows', { rows: found.rows, form: found.form })}</span>
          </p>
          <Columns found={found} />
          <Choice found={found} said={said} wrong={wrong} onChange={setSaid} />
          <Curves found={found} said={said} />
          <Button
            loading={act.busy}
            disabled={wrong.any || !statable(said)}
            onClick={() => void go()}
          >
            {t('import.go')}
          </Button>
        </>
      )}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </Panel>
  )
}

/** What each column holds, so that nobody has to guess by its name. */
function Columns({ found }: { found: RecordingPreview }) {
  const t = useT()
  return (
    <div className="scroll-table">
      <table>
        <thead>
          <tr>
            <th className="right">#</th>
            <th>{t('import.column')}</th>
            <th>{t('import.first')}</th>
            <th>{t('import.range')}</th>
          </tr>
        </thead>
        <tbody className="num">
          {found.columns.map((each) => (
            <tr key={each.number}>
              <td className="right">{each.number}</td>
              <td>{each.name}</td>
              <td>
                {each.first
                  .slice(0, 3)
                  .map((v) => (v === null ? '—' : figure(v, 4)))
                  .join('  ')}
              </td>
              <td>
                {figure(each.low, 4)} … {figure(each.high, 4)}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}

function Choice({
  found,
  said,
  wrong,
  onChange,
}: {
  found: RecordingPreview
  said: Said
  wrong: Wrong
  onChange: (said: Said) => void
}) {
  const t = useT()
  const columns = found.columns.map((each) => ({
    value: String(each.number),
    label: `${each.number} ${each.name}`,
  }))
  const set = (part: Partial<Said>) => onChange({ ...said, ...part })
  const share = ['rated', 'percent', 'permille'].includes(said.input_unit)
  const unitName = (unit: string) =>
    unit === '1' || unit === 'rated' || unit === 'percent' || unit === 'permille'
      ? t(`import.unit.${unit}`)
      : unit
  return (
    <>
      <div className="fields">
        <NativeSelect
          label={t('import.time')}
          value={said.time ?? NO_TIME}
          onChange={(event) => {
            const time = event.currentTarget.value || null
            // The server takes a time column or a rate, not both.
            set({ time, sample_rate_hz: null })
          }}
          data={[...columns, { value: NO_TIME, label: t('import.noTime') }]}
        />
        {said.time === null ? (
          <NumberField
            label={t('import.rate')}
            unit="Hz"
            value={said.sample_rate_hz}
            onChange={(value) => set({ sample_rate_hz: value })}
            onWrong={wrong.of('sample_rate_hz')}
            min={10}
          />
        ) : (
          <NativeSelect
            label={t('import.timeUnit')}
            value={said.time_unit}
            onChange={(event) => set({ time_unit: event.currentTarget.value as Said['time_unit'] })}
            data={[...TIME_UNITS]}
          />
        )}
        <NativeSelect
          label={t('import.input')}
          value={said.input}
          onChange={(event) => set({ input: event.currentTarget.value })}
          data={columns}
        />
        <NativeSelect
          label={t('import.inputUnit')}
          value={said.input_unit}
          onChange={(event) =>
            set({
              input_unit: event.currentTarget.value as Said['input_unit'],
              rated_torque_nm: null,
              torque_constant_nm_a: null,
            })
          }
          data={INPUT_UNITS.map((value) => ({ value, label: unitName(value) }))}
        />
        {share && (
          <NumberField
            label={t('import.rated')}
            unit="Nm"
            value={said.rated_torque_nm}
            onChange={(value) => set({ rated_torque_nm: value })}
            onWrong={wrong.of('rated_torque_nm')}
            above={0}
            optional
          />
        )}
        {(said.input_unit === 'A' || said.input_unit === 'mA') && (
          <NumberField
            label={t('import.constant')}
            unit="Nm/A"
            value={said.torque_constant_nm_a}
            onChange={(value) => set({ torque_constant_nm_a: value })}
            onWrong={wrong.of('torque_constant_nm_a')}
            above={0}
            optional
          />
        )}
        <NativeSelect
          label={t('import.output')}
          value={said.output}
          onChange={(event) => set({ output: event.currentTarget.value })}
          data={columns}
        />
        <NativeSelect
          label={t('import.outputUnit')}
          value={said.output_unit}
          onChange={(event) =>
            set({ output_unit: event.currentTarget.value as Said['output_unit'] })
          }
          data={OUTPUT_UNITS.map((value) => ({ value, label: unitName(value) }))}
        />
      </div>
      <NativeSelect
        label={t('import.structure')}
        value={said.structure}
        onChange={(event) =>
          // What was typed in fields that go away must not count.
          set({
            structure: event.currentTarget.value as Said['structure'],
            output_filter_hz: null,
            current_bandwidth_hz: null,
            loop_delay_s: null,
          })
        }
        data={STRUCTURES.map((value) => ({ value, label: t(`import.structure.${value}`) }))}
      />
      <Drive said={said} wrong={wrong} set={set} />
    </>
  )
}

/** What narrows the band, and what gains need to know of the drive. */
function Drive({
  said,
  wrong,
  set,
}: {
  said: Said
  wrong: Wrong
  set: (part: Partial<Said>) => void
}) {
  const t = useT()
  const ms = said.loop_delay_s === null ? null : said.loop_delay_s * 1e3
  return (
    <details>
      <summary>{t('import.more')}</summary>
      <div className="fields">
        <NumberField
          label={t('signal.from')}
          unit="Hz"
          value={said.f_min_hz}
          onChange={(value) => set({ f_min_hz: value })}
          onWrong={wrong.of('f_min_hz')}
          min={0}
          optional
        />
        <NumberField
          label={t('signal.to')}
          unit="Hz"
          value={said.f_max_hz}
          onChange={(value) => set({ f_max_hz: value })}
          onWrong={wrong.of('f_max_hz')}
          above={said.f_min_hz ?? 0}
          optional
        />
        {said.structure === 'motor_speed' && (
          <>
            <NumberField
              label={t('import.filter')}
              unit="Hz"
              value={said.output_filter_hz}
              onChange={(value) => set({ output_filter_hz: value })}
              onWrong={wrong.of('output_filter_hz')}
              above={0}
              optional
              help={t('import.filterHelp')}
            />
            <NumberField
              label={t('import.current')}
              unit="Hz"
              value={said.current_bandwidth_hz}
              onChange={(value) => set({ current_bandwidth_hz: value })}
              onWrong={wrong.of('current_bandwidth_hz')}
              above={0}
              optional
            />
            <NumberField
              label={t('import.delay')}
              unit="ms"
              value={ms}
              onChange={(value) => set({ loop_delay_s: value === null ? null : value / 1e3 })}
              onWrong={wrong.of('loop_delay_s')}
              min={0}
              max={100}
              optional
            />
          </>
        )}
      </div>
    </details>
  )
}

/** Both signals, each over its own size: a wrong column shows at once. */
function Curves({ found, said }: { found: RecordingPreview; said: Said }) {
  const t = useT()
  const dark = useComputedColorScheme('light') === 'dark'
  const traces = useMemo(
    () =>
      [said.input, said.output].flatMap((number, i) => {
        const each = found.columns.find((column) => String(column.number) === number)
        if (!each) return []
        const size = Math.max(Math.abs(each.low), Math.abs(each.high)) || 1
        const step = found.rows / Math.max(each.curve.length, 1)
        return [
          {
            label: each.name,
            color: TRACE_COLORS[dark ? 'dark' : 'light'][i] ?? '',
            time: each.curve.map((_, n) => Math.round(n * step)),
            value: each.curve.map((v) => v / size),
          },
        ]
      }),
    [found, said.input, said.output, dark],
  )
  return (
    <StepPlot
      traces={traces}
      unit=""
      label={t('import.curves')}
      timeLabel="n"
      dark={dark}
      height={150}
    />
  )
}
