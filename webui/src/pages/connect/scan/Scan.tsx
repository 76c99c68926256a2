import { Button, Checkbox, NativeSelect, TextInput } from '@mantine/core'
import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { FoundDrive, ImportedDescription, MissingPort, ProfileInfo } from '../../../api/schema'
import { plainResult } from '../../../api/results'
import { href } from '../../../app/navigation/router'
import { type T, useT } from '../../../i18n'
import { setJob, useDrives, useJob, useJobs } from '../../../live/store'
import { JobNote } from '../../../widgets/jobs/JobNote'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { Said } from '../../../widgets/messages/Said'
import { useAction } from '../../../widgets/requests/useAction'
import { isSerial, LineSearch } from './LineSearch'
import { NotListedButton } from '../profiles/NotListed'
import { parseStations } from './stations'

export function Scan({ url, onUrl }: { url: string; onUrl: (url: string) => void }) {
  const t = useT()
  const [stations, setStations] = useState('')
  const [id, setId] = useState<string | null>(null)
  const [early, setEarly] = useState(true)
  const scan = useAction()
  const jobs = useJobs()
  // A scan that was begun before this page was loaded again is still this page's.
  const left = [...jobs.values()].findLast((each) => each.kind === 'scan')
  const unseen = id === null && left?.state === 'running' ? left.id : null
  useEffect(() => {
    if (unseen) setId(unseen)
  }, [unseen])
  const job = useJob(id)
  const list = stations.trim() === '' ? null : parseStations(stations)
  const bad = stations.trim() !== '' && list === null
  const running = job?.state === 'running'
  const ready = url !== '' && !bad && !running && !scan.busy
  const found = (plainResult(job?.result).found ?? []) as FoundDrive[]
  const start = () =>
    scan.run(async () => {
      const begun = await ask(
        api.POST('/api/v1/scan', { body: { url, stations: list, stop_after_first: early } }),
      )
      setJob(begun)
      setId(begun.id)
    })
  return (
    <>
      {/* While it searches, word of that stands where it was asked for, and pushes nothing away. */}
      {running && (
        <div className="scan-place">
          <JobNote id={id} />
        </div>
      )}
      <div className={running ? 'gone' : 'scan-place'}>
        <div className="row">
          <TextInput
            className="grow"
            label={t('connect.stations')}
            placeholder={t('connect.stationsAll')}
            value={stations}
            error={bad ? t('connect.stationsBad') : null}
            onChange={(event) => setStations(event.currentTarget.value)}
            onKeyDown={(event) => {
              if (event.key === 'Enter' && ready) void start()
            }}
          />
          <Button
            variant="filled"
            disabled={!ready}
            loading={scan.busy}
            onClick={() => void start()}
          >
            {t('connect.scan')}
          </Button>
        </div>
        <Checkbox
          label={t('connect.early')}
          checked={early}
          onChange={(event) => setEarly(event.currentTarget.checked)}
        />
      </div>
      <ProblemNote problem={scan.problem} onClose={scan.clear} />
      {/* Without onClose: what was found stays until the next scan. */}
      {!running && <JobNote id={id} />}
      {isSerial(url) && <LineSearch url={url} stations={list} onFound={onUrl} />}
      {job?.state === 'done' && (
        <section aria-label={t('connect.results')} ref={reveal}>
          <h3>{t('connect.found', { count: found.length })}</h3>
          {found.length === 0 && <p>{t('connect.foundNone')}</p>}
          {found.map((drive) => (
            <Found key={`${drive.url} ${drive.station}`} found={drive} />
          ))}
        </section>
      )}
    </>
  )
}

/** What was found is below the fold of a small screen. */
function reveal(section: HTMLElement | null): void {
  section?.scrollIntoView({ block: 'nearest' })
}

function identity(t: T, found: FoundDrive): string {
  const hex = (n: number) => `0x${n.toString(16).toUpperCase()}`
  return [
    found.vendor_id !== null && `${t('identity.vendor')} ${hex(found.vendor_id)}`,
    found.product_code !== null && `${t('identity.product')} ${hex(found.product_code)}`,
    found.revision !== null && `${t('identity.revision')} ${hex(found.revision)}`,
    found.serial !== null && `${t('identity.serial')} ${found.serial}`,
    found.hardware && `${t('identity.hardware')} ${found.hardware}`,
    found.firmware && `${t('identity.firmware')} ${found.firmware}`,
    found.alias !== null && `${t('identity.alias')} ${found.alias}`,
  ]
    .filter(Boolean)
    .join(' · ')
}

/** A bus URL begins with the kind of its bus. */
function kindOf(url: string): MissingPort['kind'] {
  return url.split(':', 1)[0] as MissingPort['kind']
}

function Found({ found }: { found: FoundDrive }) {
  const t = useT()
  const connect = useAction()
  const drives = useDrives() ?? []
  const [profiles, setProfiles] = useState<ProfileInfo[]>([])
  const [profile, setProfile] = useState(found.matches[0]?.profile ?? '')
  const [name, setName] = useState('')
  const [accept, setAccept] = useState(false)
  const [notListed, setNotListed] = useState(false)
  const reload = () => ask(api.GET('/api/v1/profiles')).then(setProfiles, () => {})
  useEffect(() => {
    void reload()
  }, [])
  const [matches, setMatches] = useState(found.matches)
  const match = matches.find((each) => each.profile === profile)
  const used = drives.find((drive) =>
    drive.ports.some((port) => port.url === found.url && port.station === found.station),
  )
  const addPort = async (drive: string) => {
    const added = await connect.run(() =>
      ask(
        api.POST('/api/v1/drives/{drive_id}/ports', {
          params: { path: { drive_id: drive } },
          body: { url: found.url, station: found.station, accept_difference: accept },
        }),
      ),
    )
    // Agreed to for one try, and only after the difference has been reported.
    setAccept(false)
    setNotListed(!added)
  }
  /** A profile was made for this drive: offer it, with how well it fits. */
  const take = async (made: ImportedDescription) => {
    await reload()
    setProfile(made.profile)
    const { name, vendor_id, product_code } = found
    const query = { kind: kindOf(found.url), name, vendor_id, product_code }
    ask(api.GET('/api/v1/profiles/matches', { params: { query } })).then(setMatches, () => {})
  }
  return (
    <div className="found">
      <p>
        <strong>{t('connect.station', { station: found.station })}</strong>{' '}
        {found.name || t('connect.nameless')}{' '}
        <span className="dim">
          <Said message={found.state_message} words={found.state} />
        </span>
      </p>
      <p className="dim num">{identity(t, found) || t('connect.noIdentity')}</p>
      {found.notes.map((note, place) => (
        <p key={note} className="dim">
          <Said message={found.note_messages[place]} words={note} />
        </p>
      ))}
      {used ? (
        <p>
          {t('connect.inUse', { name: used.name })}{' '}
          <a className="lone" href={href('overview', used.id)}>
            {t('connect.goOn')}
          </a>
        </p>
      ) : (
        <div className="row">
          <NativeSelect
            className="grow"
            label={t('connect.profile')}
            value={profile}
            onChange={(event) => setProfile(event.currentTarget.value)}
            data={[
              ...(profile === '' ? [{ value: '', label: t('connect.choose') }] : []),
              ...matches.map((each) => ({
                value: each.profile,
                label: `${each.title} — ${t(`confidence.${each.confidence}`)}`,
              })),
              ...profiles
                .filter((each) => !matches.some((known) => known.profile === each.profile))
                .filter((each) => each.problem === '')
                .map((each) => ({
                  value: each.profile,
                  label: `${each.title} — ${t('confidence.none')}`,
                })),
            ]}
          />
          <TextInput
            label={t('connect.name')}
            value={name}
            maxLength={60}
            onChange={(event) => setName(event.currentTarget.value)}
          />
          <Button
            variant="filled"
            disabled={profile === ''}
            loading={connect.busy}
            onClick={() =>
              void connect.run(() =>
                ask(
                  api.POST('/api/v1/drives', {
                    body: { url: found.url, station: found.station, profile, name },
                  }),
                ),
              )
            }
          >
            {t('connect.connect')}
          </Button>
        </div>
      )}
      {!used &&
        drives
          .filter((drive) => drive.profile === profile)
          .map((drive) => (
            <Button key={drive.id} loading={connect.busy} onClick={() => void addPort(drive.id)}>
              {t('connect.secondPort', { name: drive.name })}
            </Button>
          ))}
      {!used && notListed && (
        <Checkbox
          label={t('connect.acceptDifference')}
          checked={accept}
          onChange={(event) => setAccept(event.currentTarget.checked)}
        />
      )}
      {!used && profile !== '' && (
        <p className={match?.confidence === 'certain' ? 'dim' : 'warn-text'}>
          {match ? <Said message={match.why_message} words={match.why} /> : t('connect.noMatch')}
        </p>
      )}
      <ProblemNote problem={connect.problem} onClose={connect.clear} />
      {!used && !matches.some((each) => each.confidence === 'certain') && (
        <NotListedButton found={found} onMade={(made) => void take(made)} />
      )}
    </div>
  )
}
