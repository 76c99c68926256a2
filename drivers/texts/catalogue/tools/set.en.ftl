set_belongs-motor-file-saved = { $drive }: { $parameter } { $key } belongs to the motor that the file was saved with; nothing was written
    .remedy = untick this row, or accept explicitly that the motor is the same
set_file-another-drive-nothing = { $drive }: the file is of another drive: { $other }; nothing was written
    .remedy = compare the values, then accept the other drive explicitly
set_file-drive-nothing-written = the file is of a { $value } drive, { $drive } is a { $limit }; nothing was written
    .remedy = choose a file of the same drive family
set_file-no-usable-value = { $drive }: the file has no usable value for { $parameter }; nothing was written
    .remedy = untick this row
set_no-parameter-read-nothing = { $drive }: no parameter could be read, so nothing was saved
    .remedy = check the connection
set_storing-present-values = storing the present values
set_writing = writing { $key }
set_written-in-part = { $cause }; { $written } of { $rows } rows were written before { $key }; what was there before is in the set “{ $backup }”
set_keeps-other-value = the drive keeps { $after } instead of { $raw }
set_without = {" "}without { $count ->
        [one] { $count } setting
       *[other] { $count } settings
    } that could not be read ({ $keys })
