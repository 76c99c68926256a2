import { useEffect, useState } from 'react'
import { api, ask } from '../../../api/client'
import type { EthercatPermissions } from '../../../api/schema'
import { useSay, useT } from '../../../i18n'

const REAL = /^ethercat:\/\/(?!virtual)[^/\s]+$/

/** What is missing to use the interface of a URL, before it is opened. */
export function InterfacePermissions({ url }: { url: string }) {
  const [report, setReport] = useState<EthercatPermissions | null>(null)
  useEffect(() => {
    setReport(null)
    if (!REAL.test(url)) return
    let wanted = true
    ask(api.GET('/api/v1/ethercat/permissions', { params: { query: { url } } })).then(
      (reported) => wanted && setReport(reported),
      () => {},
    )
    return () => {
      wanted = false
    }
  }, [url])
  return report && <Permissions report={report} />
}

/** Missing permissions as text, with the commands that grant them. */
export function Permissions({ report }: { report: EthercatPermissions }) {
  const t = useT()
  const say = useSay()
  return (
    <div className={`note ${report.ready ? 'good' : 'warn'}`} role="status">
      <p>
        <strong className="mono">{report.interface}</strong>{' '}
        {report.ready ? t('segment.permitted') : say.message(report.text_message, report.text)}
      </p>
      {report.advised.length > 0 && (
        <p>{t('segment.advised', { names: report.advised.join(', ') })}</p>
      )}
      {report.commands.length > 0 && (
        <>
          <p>{t(report.missing.length > 0 ? 'segment.eitherCommand' : 'segment.command')}</p>
          {report.commands.map((command) => (
            <pre key={command} className="command">
              {command}
            </pre>
          ))}
        </>
      )}
      {report.missing.length > 0 && <p className="dim">{t('segment.commandsWhy')}</p>}
    </div>
  )
}
