api_no = there is no { $path }
api_no-time-utc = { $moment } is not a time in UTC
    .remedy = choose a later or earlier day
api_nobody-logged = nobody is logged in
    .remedy = log in
api_nothing = there is nothing at /{ $path }
    .remedy = see /api/v1/openapi.json
api_see-interface = see /api/v1/openapi.json for what this address takes
