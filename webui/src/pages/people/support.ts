import { api, ask } from '../../api/client'
import type { NewGrant, NewInvitation } from '../../api/schema'

const path = (invitation_id: string) => ({ params: { path: { invitation_id } } })

export const invite = (body: NewInvitation) => ask(api.POST('/api/v1/invitations', { body }))
export const revoke = (id: string) =>
  ask(api.DELETE('/api/v1/invitations/{invitation_id}', path(id)))
export const grant = (id: string, body: NewGrant) =>
  ask(api.PUT('/api/v1/invitations/{invitation_id}/grant', { ...path(id), body }))
export const withdraw = (id: string) =>
  ask(api.DELETE('/api/v1/invitations/{invitation_id}/grant', path(id)))
