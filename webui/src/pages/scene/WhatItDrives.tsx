import { Button, NativeSelect } from '@mantine/core'
import { useEffect, useState } from 'react'
import type { DriveSummary } from '../../api/schema'
import { href } from '../../app/navigation/router'
import { useT } from '../../i18n'
import { HOME_OFFSET, SOFTWARE_LIMITS } from '../../widgets/parameters/objects'
import { ParameterFields, useReachable } from '../../widgets/parameters/ParameterFields'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useRecord } from '../../widgets/drive/useFunctions'
import { type Form, KINDS } from '../setup/mechanics'
import { MechanicsFields } from '../setup/MechanicsFields'
import { useMechanics } from '../setup/useMechanics'

const LIMITS = [...SOFTWARE_LIMITS, HOME_OFFSET]

/** What an axis drives, and where its limits and its home are: changed here, seen at once. */
export function WhatItDrives({ drive }: { drive: DriveSummary }) {
  const t = useT()
  const [open, setOpen] = useState(false)
  const kind = useRecord(drive.id)?.mechanics?.kind ?? 'shaft'
  return (
    <details className="what" onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>
        <strong>{drive.name}</strong> {t('scene.drives', { what: t(`scene.${kind}`) })}
      </summary>
      {/* Only what is open reads from the drive. */}
      {open && (
        <div className="columns">
          <MechanicsForm drive={drive.id} />
          <Limits drive={drive.id} />
        </div>
      )}
    </details>
  )
}

function MechanicsForm({ drive }: { drive: string }) {
  const t = useT()
  const { kept, form, change, mechanics, keep, act } = useMechanics(drive)
  const [shaft, setShaft] = useState(true)
  const known = JSON.stringify(kept)
  useEffect(() => setShaft(kept === null), [drive, known])
  const wanted = shaft ? null : mechanics
  return (
    <div>
      <NativeSelect
        label={t('scene.what')}
        value={shaft ? 'shaft' : form.kind}
        onChange={(event) => {
          const chosen = event.currentTarget.value
          setShaft(chosen === 'shaft')
          if (chosen !== 'shaft') change({ kind: chosen as Form['kind'] })
        }}
        data={(['shaft', ...KINDS] as const).map((value) => ({
          value,
          label: t(`scene.${value}`),
        }))}
      />
      {!shaft && <MechanicsFields form={form} change={change} resolution={false} />}
      <div className="row wrap">
        <Button
          loading={act.busy}
          disabled={(!shaft && wanted === null) || JSON.stringify(wanted) === known}
          onClick={() => void keep(wanted)}
        >
          {t('scene.keep')}
        </Button>
        <Button component="a" href={href('setup', drive)}>
          {t('scene.gear')}
        </Button>
      </div>
      <p className="dim">{t('scene.keepHelp')}</p>
      <ProblemNote problem={act.problem} onClose={act.clear} />
    </div>
  )
}

/** The drive's own limits: written to the drive like every parameter, and read back. */
function Limits({ drive }: { drive: string }) {
  const t = useT()
  const reachable = useReachable(drive, LIMITS)
  return (
    <div>
      <h3>{t('scene.limits')}</h3>
      {reachable.length === 0 ? (
        <p className="dim">{t('scene.noLimits')}</p>
      ) : (
        <ParameterFields drive={drive} keys={LIMITS} />
      )}
    </div>
  )
}
