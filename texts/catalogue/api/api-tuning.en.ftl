api-tuning_give-either-gains-level = give either gains or a level
    .remedy = give one of the two
api-tuning_not-frequency-response = { $value } is not a frequency response
api-tuning_now-change-left-changed = { $drive }: { $parameter } is { $value } now, where this change had left { $left }: it was changed again since, so nothing was taken back
    .remedy = look at the list of changes; take it back all the same, or write the value that you want
api-tuning_too-large = { $name } is too large
    .remedy = import one measurement at a time, as this program exported it
