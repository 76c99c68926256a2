work_axis-already-moved = the axis is already moved by { QUOTED($other_title) }
    .remedy = wait for it to end, or stop it
work_of-drive = { $title }: { $drive }
work_run-already = { $bound } { $what } are already running
    .remedy = wait until one of them has ended, or cancel one
