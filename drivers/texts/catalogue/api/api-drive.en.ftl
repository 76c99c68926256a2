api-drive_back-forth = Reciprocating move: { $member_drive }
api-drive_cancelled-during = { $drive }: cancelled during “{ $title }”: { $why }
    .remedy = try again when it is safe
api-drive_choose-one = choose one of: { $names }
api-drive_commands-motion-axis-enabled = { $drive }: { $parameter } commands motion and the axis is enabled
    .remedy = use the Motion page, which sets limits and a dead-man timeout; or disable the axis
api-drive_cyclic-exchange-not-run = { $drive }: the cyclic exchange does not run
    .remedy = start it on the Connect page
api-drive_detail = { $shape ->
    [step] step
    [ramp] ramp
    [trapezoid] trapezoid
    [sine] sine
   *[chirp] chirp
 } in { $mode }: { $member_drive }
api-drive_fault-reset = Fault reset
api-drive_give-either-raw-value = { $drive }: { $parameter }: give either raw or value
    .remedy = send exactly one of the two
api-drive_has-none = this drive has none: use another way
api-drive_home-method = Home { $member_drive } (method { $method })
api-drive_identification-drive = Identification by the drive: { $member_drive }
api-drive_load = Load { $file } into { $member_drive }
api-drive_move = Move { $member_drive } ({ $mode })
api-drive_no-homing-method = { $drive } has no homing method { $value }
api-drive_no-mode = { $drive } has no mode { $value }
    .remedy = choose one of its modes
api-drive_no-number = { $drive }: { $parameter }: { NUM($given, format: "g") } is not a number
    .remedy = give a number that is finite
api-drive_no-parameter = { $drive } has no parameter { $key }
api-drive_no-parameter-search-parameters = { $drive } has no parameter { $parameter }
    .remedy = search the Parameters page for its name or number; keys look like 6040:00
api-drive_no-parameter-see-list = { $known_title } has no parameter { $parameter }
    .remedy = see the list of parameters
api-drive_no-procedure = { $drive } has no procedure { QUOTED($value) }
api-drive_no-terminals-overruled-like = { $drive }: no terminals are forced in this way now
    .remedy = start forcing again; it ends when the page stops responding
api-drive_nothing-put-back = { $drive }: there is nothing to restore
    .remedy = check its parameters; they may have been restored already
api-drive_read = Read { $member_drive }
api-drive_small-move = Small move by { $increments } increments: { $drive }
api-drive_use-page-of-function = use the page of the function that the object belongs to
