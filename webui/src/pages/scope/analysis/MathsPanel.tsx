import { ActionIcon, Button, TextInput } from '@mantine/core'
import type { ScopeMath, ScopeSetup } from '../../../api/schema'
import { useT } from '../../../i18n'
import { FUNCTIONS } from '../../../live/scope/analysis/expression'
import { Icon } from '../../../widgets/layout/Icon'
import { freeId, GREATEST_MATHS, mathProblem } from '../setup/setup'

/** Computed channels: their names, units and texts. */
export function MathsPanel({
  setup,
  onChange,
}: {
  setup: ScopeSetup
  onChange: (maths: ScopeMath[]) => void
}) {
  const t = useT()
  const { maths } = setup
  const change = (i: number, part: Partial<ScopeMath>) =>
    onChange(maths.map((each, n) => (n === i ? { ...each, ...part } : each)))
  const add = () => {
    const id = freeId(setup, 'm')
    const first = setup.traces[0]?.id ?? 'c1'
    onChange([...maths, { id, name: '', unit: '', expression: `derivative(${first})` }])
  }
  return (
    <section aria-label={t('scope.tab.maths')}>
      <p className="dim">{t('maths.help', { functions: Object.keys(FUNCTIONS).join(', ') })}</p>
      {maths.map((math, i) => {
        const problem = mathProblem(math)
        return (
          <div className="row wrap maths-row" key={math.id}>
            <strong className="num">{math.id} =</strong>
            <TextInput
              className="grow"
              label={t('maths.expression')}
              value={math.expression}
              maxLength={300}
              spellCheck={false}
              error={
                problem &&
                t(`maths.${problem.problem}`, { part: problem.part, place: problem.position + 1 })
              }
              onChange={(event) => change(i, { expression: event.currentTarget.value })}
            />
            <TextInput
              label={t('maths.name')}
              value={math.name}
              maxLength={60}
              onChange={(event) => change(i, { name: event.currentTarget.value })}
            />
            <TextInput
              className="unit-input"
              label={t('column.unit')}
              value={math.unit}
              maxLength={20}
              onChange={(event) => change(i, { unit: event.currentTarget.value })}
            />
            <ActionIcon
              aria-label={t('maths.remove', { name: math.id })}
              onClick={() => onChange(maths.filter((_, n) => n !== i))}
            >
              <Icon name="cross" />
            </ActionIcon>
          </div>
        )
      })}
      <Button onClick={add} disabled={maths.length >= GREATEST_MATHS}>
        {t('maths.add')}
      </Button>
    </section>
  )
}
