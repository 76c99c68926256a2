import { Button } from '@mantine/core'
import { useT } from '../../i18n'
import { Icon } from '../../widgets/layout/Icon'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { offerDownload } from '../../widgets/browser/download'
import { type Curve, toCsv } from './plot/bode'
import { bodeSvg, toPng } from './plot/picture'
import type { Sweep } from './results'

const FORMATS = ['csv', 'json', 'svg', 'png'] as const

/** The response as numbers or as a picture. Colours are those of the light appearance. */
export function ExportButtons({
  file,
  sweep,
  curves,
  title,
}: {
  file: string
  sweep: Sweep
  curves: Curve[]
  title: string
}) {
  const t = useT()
  const act = useAction()
  const name = file.replace(/\.sdmeas$/, '')
  const save = (format: (typeof FORMATS)[number]) =>
    act.run(async () => {
      if (format === 'csv') offerDownload(`${name}.csv`, [toCsv(sweep)], 'text/csv')
      if (format === 'json') {
        offerDownload(`${name}.json`, [JSON.stringify(sweep, null, 1)], 'application/json')
      }
      const picture = bodeSvg(curves, title, sweep.unit, sweep.valid_band_hz)
      if (format === 'svg') offerDownload(`${name}.svg`, [picture], 'image/svg+xml')
      if (format === 'png') offerDownload(`${name}.png`, [await toPng(picture)], 'image/png')
    })
  return (
    <>
      {FORMATS.map((format) => (
        <Button
          key={format}
          leftSection={<Icon name="download" size={14} />}
          loading={act.busy}
          aria-label={t('export.as', { format: format.toUpperCase() })}
          onClick={() => void save(format)}
        >
          {format.toUpperCase()}
        </Button>
      ))}
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </>
  )
}
