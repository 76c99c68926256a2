import { ActionIcon, Menu, useMantineColorScheme } from '@mantine/core'
import { useT } from '../i18n'
import { Icon } from '../widgets/layout/Icon'
import { useLink } from '../live/store'
import { leave, useSession } from './people/session'
import { setPlace, useHasTour } from './tour/tour'

/** Appearance, the time zone of what is shown, and who is logged in. */
export function Preferences({ onTour }: { onTour?: () => void }) {
  const t = useT()
  const session = useSession()
  const tour = useHasTour(useLink().open)
  const zone = Intl.DateTimeFormat().resolvedOptions().timeZone
  const { colorScheme, setColorScheme } = useMantineColorScheme()
  return (
    <Menu position="bottom-end" zIndex={260}>
      <Menu.Target>
        <ActionIcon className="preferences" aria-label={t('frame.preferences')}>
          <Icon name="theme" size={22} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>{t('frame.scheme')}</Menu.Label>
        {(['light', 'dark', 'auto'] as const).map((scheme) => (
          <Menu.Item
            key={scheme}
            rightSection={colorScheme === scheme ? <Icon name="check" /> : null}
            onClick={() => setColorScheme(scheme)}
          >
            {t(`scheme.${scheme}`)}
          </Menu.Item>
        ))}
        <Menu.Label>{t('frame.times', { zone })}</Menu.Label>
        {tour && (
          <Menu.Item
            onClick={() => {
              setPlace('offer')
              onTour?.()
            }}
          >
            {t('tour.menu')}
          </Menu.Item>
        )}
        {session?.login_required && session.person !== null && (
          <>
            <Menu.Label>{t('login.in', { name: session.person ?? '' })}</Menu.Label>
            <Menu.Item leftSection={<Icon name="left" />} onClick={() => void leave()}>
              {t('login.logOut')}
            </Menu.Item>
          </>
        )}
      </Menu.Dropdown>
    </Menu>
  )
}
