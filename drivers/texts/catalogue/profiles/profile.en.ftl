profile_class-in-row = profile { $name }: { $key } gives { $given } in its row
    .remedy = write a rule in motion_rules, with its reason
profile_field-no-mapping = { $file }: { $field } must hold a mapping
    .remedy = correct the file, then see `servodeck profile check`
profile_field-twice = { $file }: { QUOTED($field) } is already given by another file
    .remedy = keep one of the two
profile_no-mapping = { $file }: the file must hold a mapping of profile fields
    .remedy = correct the file, then see `servodeck profile check`
profile_no-overlay-mapping = { $file }: the file must hold a mapping of overlay fields
    .remedy = correct the file, then see `servodeck profile check`
profile_no-yaml = { $file } is not well-formed YAML: { $detail }
    .remedy = correct the file, then see `servodeck profile check`
profile_not-readable = { $file } cannot be read: { $detail }
    .remedy = give the user that runs servodeck the right to read it
profile_not-utf8 = a file of profile { $name } is not UTF-8: { $detail }
    .remedy = save the file as UTF-8
profile_overlay-refused = overlay { $name }: { $refused }
    .remedy = correct the file, then see `servodeck profile check`
profile_refused = profile { $name }: { $errors ->
    [one] { $errors } error
   *[other] { $errors } errors
 }: { $refused }
    .remedy = correct the file, then see `servodeck profile check`
profile_shared-field = { $file }: shared is no field of a file
    .remedy = use common
profile_shared-record = { $folder } may hold common texts only: records belong to a family
    .remedy = move the texts of records to the folder of their family
profile_text-twice = { $file }: { $field } gives { $keys } again
    .remedy = keep one of the two
profile_unknown = no profile named { QUOTED($name) }; there are: { $known }
    .remedy = choose one of these
profile_brake-test-one-of = brake_test: give output_function or obstacle, and not both
profile_keys-missing = unknown parameters referred to: { $keys }
profile_keys-twice = parameter keys appear twice: { $keys }
profile_limits-reversed = { $key }: min_raw { $low } is above max_raw { $high }
profile_no-regular-expression = { QUOTED($pattern) } is no regular expression: { $cause }
profile_record = { $place } ({ $key }): { $reason }
