import { SegmentedControl } from '@mantine/core'
import { useEffect, useState } from 'react'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { useDrive, useLink } from '../../live/store'
import { useRows } from '../../widgets/profile-text/rows'
import { useFunctions } from '../../widgets/drive/useFunctions'
import { BrakePanel } from './BrakePanel'
import { GearPanel } from './GearPanel'
import { GuidePanel } from './GuidePanel'
import { RegenerationPanel } from './RegenerationPanel'

type Tab = 'gear' | 'brake' | 'regen' | 'identification' | 'pole_identification'

/** What belongs to the machine: units, brake, braking resistor, the drive's own identification. */
export function SetupPage({ drive }: { drive: string }) {
  const t = useT()
  const { open } = useLink()
  const rows = useRows(drive)
  const summary = useDrive(drive)
  const functions = useFunctions(drive)
  const [tab, setTab] = useState<Tab>('gear')
  useEffect(() => {
    if (open && rows === null) void live.loadRows(drive).catch(() => {})
  }, [drive, open, rows])
  if (!functions) return <p className="empty">{t('loading')}</p>
  const guides = functions.guides
  const tabs: Tab[] = ['gear', 'brake', 'regen', ...guides.map((guide) => guide.name)]
  const shown = tabs.includes(tab) ? tab : 'gear'
  const guide = guides.find((each) => each.name === shown)
  return (
    <div className="page">
      <h1>
        {t('page.setup')} <small className="dim">{summary?.name}</small>
      </h1>
      <div className="tabs">
        <SegmentedControl
          value={shown}
          onChange={(next) => setTab(next)}
          data={tabs.map((value) => ({ value, label: t(`setup.tab.${value}`) }))}
        />
      </div>
      {shown === 'gear' && <GearPanel drive={drive} />}
      {shown === 'brake' && <BrakePanel drive={drive} brake={functions.brake ?? null} />}
      {shown === 'regen' && (
        <RegenerationPanel drive={drive} regen={functions.regeneration ?? null} />
      )}
      {guide && <GuidePanel key={guide.name} drive={drive} guide={guide} />}
    </div>
  )
}
