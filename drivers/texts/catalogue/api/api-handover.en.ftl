api-handover_drive = { $value } is of a { $profile } drive, { $drive } is a { $profile_drive }
    .remedy = choose a set of the same drive family
api-handover_esi-file-not-base64 = the ESI file is not base64
    .remedy = send it again
api-handover_larger-bytes = { $file } is larger than { $max_bytes } bytes
    .remedy = choose another file
api-handover_no-hand-over = { $drive_name } has no hand-over { $value }
    .remedy = choose one of the list
