import type { FoundDrive, ImportedDescription } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'
import { ProfileExport } from './ProfileExport'

type Finding = ImportedDescription['findings'][number]

/** What an import made, and everything that was odd about the file. */
export function ImportReport({
  made,
  found,
}: {
  made: ImportedDescription
  found?: FoundDrive | undefined
}) {
  const t = useT()
  return (
    <div className="note info">
      <p>
        <strong>
          {t('notListed.made', {
            title: made.title,
            count: made.parameters,
            profile: made.profile,
          })}
        </strong>
      </p>
      {found && otherProduct(made, found) && (
        <p className="warn-text">
          {t('notListed.otherProduct', {
            vendor: hex(made.vendor_id),
            product: hex(made.product_code),
            driveVendor: hex(found.vendor_id),
            driveProduct: hex(found.product_code),
          })}
        </p>
      )}
      <p>{t('notListed.before')}</p>
      <p className="dim">{t('notListed.path', { path: made.path })}</p>
      <ProfileExport profile={made.profile} links={made.links} />
      {made.findings.length > 0 && (
        <details>
          <summary>{t('notListed.odd', { count: made.findings.length + made.not_listed })}</summary>
          <ul>
            {made.findings.map((finding, number) => (
              <FindingLine key={number} finding={finding} />
            ))}
          </ul>
          {made.not_listed > 0 && <p>{t('notListed.more', { count: made.not_listed })}</p>}
        </details>
      )}
    </div>
  )
}

function FindingLine({ finding }: { finding: Finding }) {
  const t = useT()
  const say = useSay()
  return (
    <li>
      <strong>{t(`notListed.outcome.${finding.outcome}`)}</strong> {finding.place}:{' '}
      {say.message(finding.text_message, finding.text)}
    </li>
  )
}

function hex(number: number | null): string {
  return number === null ? '–' : `0x${number.toString(16).toUpperCase()}`
}

/** Both sides name a product, and not the same one. */
export function otherProduct(
  made: Pick<ImportedDescription, 'vendor_id' | 'product_code'>,
  found: Pick<FoundDrive, 'vendor_id' | 'product_code'>,
): boolean {
  const differs = (one: number | null, other: number | null) =>
    one !== null && other !== null && one !== other
  return differs(made.vendor_id, found.vendor_id) || differs(made.product_code, found.product_code)
}
