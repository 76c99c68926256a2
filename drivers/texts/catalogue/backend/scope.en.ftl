scope_already = { $most } are stored already, the permitted maximum
    .remedy = delete some that are not needed
scope_no = there is no { $value }
    .remedy = choose from the list
scope_no-snapshot-scope = { $value } is not a snapshot of the scope: { $why }
    .remedy = choose a file that the Scope page wrote
scope_not-stored-disk-nearly = { $path } was not stored: the disk is nearly full, { $free_mib } MiB are left
    .remedy = free some space
