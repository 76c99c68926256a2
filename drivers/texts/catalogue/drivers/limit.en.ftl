
limit_above-zero = above 0
limit_at-least = at least { NUM($value, format: ".10g") } { $unit }
limit_at-least-number = at least { NUM($value, format: ".10g") }
limit_below = below { NUM($value, format: ".10g") } { $unit }
limit_between = { NUM($low, format: ".10g") } to { NUM($high, format: ".10g") } { $unit }
limit_between-numbers = { NUM($low, format: ".10g") } to { NUM($high, format: ".10g") }
limit_bytes = { NUM($count, format: ".10g") } bytes
limit_bytes-as = such as { $example }
limit_certain-scale = a certain scale
limit_characters = { NUM($count, format: ".10g") } characters
limit_columns = { $count } columns
limit_days = { $count } days
limit_each-way = { $distance } each way
limit_ethercat-port = { $port ->
    [none] a port that is not the office's
   *[other] { $port }
}
limit_file-name = letters, digits, spaces, . - _, at most 100
limit_fixed-process-data = fixed process data: { $own }
limit_from-start = { $distance } from the start
limit_header = the header { $header }
limit_host-name = 1 to 63 of a to z, 0 to 9 and -, not - first or last
limit_imported-objects = objects of imported profiles that no standard describes
limit_interface-name = 1 to 15 letters, digits and . _ - @ :, as eth0
limit_jitter = within { NUM($percent, format: ".0f") }% of { NUM($usual_ms, format: ".6g") } ms
limit_length = { $least } to { $most } characters
limit_lines = { $count } lines
limit_look-only = look only
limit_none = none
limit_notch-there = a notch at that frequency
limit_objects = { $count } objects
limit_one-of-columns = one of the columns { $numbers }
limit_per-cycle = { $longest } per cycle
limit_place-of-contents = a folder, or s3:// with the extra servodeck[s3] installed
limit_printable = { $least } to { $most } printable characters
limit_profile-name = lower-case letters, digits and _, a letter first
limit_serial-device = the path of a serial device, as /dev/ttyUSB0, or COM1 to COM999
limit_stays-free = { $mebibytes } MiB stay free
limit_tags = { $tags } tags of { $count } characters
limit_up-to-over = up to { NUM($above, format: ".10g") } over { NUM($below, format: ".10g") }
limit_version-7 = version 7
limit_within-time = { $wanted } within { NUM($timeout_s, format: "g") } s
limit_from-to = { $low } to { $high }
limit_no-limit = no limit
limit_number-too-large = a number beyond all measure
limit_raw = { $value } (raw { $raw })
limit_choice = { $number } ({ $meaning })
