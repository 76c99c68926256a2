/** The websocket's messages, both ways (backend/api/live/messages.py). */
import type {
  Chat,
  ChatLine,
  CursorMoved,
  EnablePress,
  EnableRelease,
  EnableRenew,
  LeaseAnswer,
  LeaseAsk,
  LeaseHand,
  LeaseNotice,
  LeaseOverride,
  PeopleHere,
  PlotCursor,
  Pointer,
  PointerMoved,
  Where,
  DrivesChanged,
  Hello,
  JobChanged,
  JogEnded,
  JogGap,
  JogRenew,
  JogStart,
  JogStop,
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
  StopReached,
  StopTaken,
  ValuesChanged,
  WatchState,
  WatchValues,
} from '../api/schema'

/** Why a held button was released; the words are made where they are shown. */
export type Release = NonNullable<JogStop['reason']>

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
  | LeaseAsk
  | LeaseAnswer
  | LeaseHand
  | LeaseOverride
  | Where
  | Pointer
  | PlotCursor
  | Chat
  | EnablePress
  | EnableRenew
  | EnableRelease

export type ToPage =
  | Hello
  | StateChanged
  | DrivesChanged
  | ValuesChanged
  | JobChanged
  | JogEnded
  | JogGap
  | ScopeInfo
  | Logged
  | Refused
  | StopTaken
  | StopReached
  | Pong
  | PeopleHere
  | LeaseNotice
  | PointerMoved
  | CursorMoved
  | ChatLine
