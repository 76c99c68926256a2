/** The websocket's messages, both ways (backend/api/live_messages.py). */
import type {
  DrivesChanged,
  Hello,
  JobChanged,
  JogEnded,
  JogRenew,
  JogStart,
  JogStop,
  LeaseChanged,
  LeaseTake,
  Logged,
  Ping,
  Pong,
  Refused,
  ScopeInfo,
  ScopeStart,
  ScopeStop,
  StateChanged,
  StopAll,
  ValuesChanged,
  WatchState,
  WatchValues,
} from '../api/schema'

export type FromPage =
  | WatchState
  | WatchValues
  | JogStart
  | JogRenew
  | JogStop
  | StopAll
  | LeaseTake
  | ScopeStart
  | ScopeStop
  | Ping

export type ToPage =
  | Hello
  | StateChanged
  | DrivesChanged
  | ValuesChanged
  | JobChanged
  | LeaseChanged
  | JogEnded
  | ScopeInfo
  | Logged
  | Refused
  | Pong
