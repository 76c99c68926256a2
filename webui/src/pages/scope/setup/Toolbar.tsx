import { ActionIcon, Button, NativeSelect } from '@mantine/core'
import { useT } from '../../../i18n'
import { Icon } from '../../../widgets/layout/Icon'

const WINDOWS = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60]

export function Toolbar({
  count,
  window_s,
  frozen,
  cursors,
  fixed,
  onPick,
  onRun,
  onWindow,
  onMove,
  onCursors,
  onFit,
  onCsv,
}: {
  count: number
  window_s: number
  frozen: boolean
  cursors: boolean
  /** Some y scale does not follow its traces. */
  fixed: boolean
  onPick: () => void
  onRun: () => void
  onWindow: (seconds: number) => void
  /** Shift by a part of the width, and make the width so many times as large. */
  onMove: (part: number, factor: number) => void
  onCursors: () => void
  onFit: () => void
  onCsv: () => void
}) {
  const t = useT()
  return (
    <div className="row wrap middle">
      <h1 className="grow">{t('page.scope')}</h1>
      <Button onClick={onPick} leftSection={<Icon name="scope" />}>
        {t('scope.channels', { count })}
      </Button>
      <Button leftSection={<Icon name={frozen ? 'play' : 'pause'} />} onClick={onRun}>
        {t(frozen ? 'scope.follow' : 'scope.pause')}
      </Button>
      <NativeSelect
        aria-label={t('scope.window')}
        value={String(window_s)}
        onChange={(event) => onWindow(Number(event.currentTarget.value))}
        data={[...new Set([...WINDOWS, window_s])]
          .sort((a, b) => a - b)
          .map((each) => ({ value: String(each), label: t('scope.seconds', { value: each }) }))}
      />
      <ActionIcon aria-label={t('scope.panLeft')} onClick={() => onMove(-0.25, 1)}>
        <Icon name="left" />
      </ActionIcon>
      <ActionIcon aria-label={t('scope.panRight')} onClick={() => onMove(0.25, 1)}>
        <Icon name="right" />
      </ActionIcon>
      <Button aria-label={t('scope.zoomIn')} onClick={() => onMove(0, 0.5)}>
        +
      </Button>
      <Button aria-label={t('scope.zoomOut')} onClick={() => onMove(0, 2)}>
        −
      </Button>
      {fixed && <Button onClick={onFit}>{t('scale.fit')}</Button>}
      <Button aria-pressed={cursors} onClick={onCursors}>
        {t('scope.cursors')}
      </Button>
      <Button leftSection={<Icon name="download" />} onClick={onCsv} disabled={count === 0}>
        {t('scope.csv')}
      </Button>
    </div>
  )
}
